"""Types of arrays by what they hold; a docstring gives the shape of one in brackets."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
Floats = NDArray[np.float64]
Arrays = Mapping[str, Array]
"""Arrays by the name of their variable."""
Complex = NDArray[np.complex128]
Mask = NDArray[np.bool_]

Integers = NDArray[np.intp]  # Numbers of lanes, values or points.
Counts = NDArray[np.int32]  # Periods and bands, as a file holds them.
Codes = NDArray[np.uint8]  # Kinds, whose meanings an enumeration gives.
