"""Ranges of valid numbers."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

LARGEST_VALUE = 1e300
"""Largest value of a sweep: sums and differences of such values are finite."""


class Range(NamedTuple):
    """The valid numbers: finite, and within these bounds."""

    gt: float | None = None
    ge: float | None = None
    lt: float | None = None
    le: float | None = None

    @property
    def bounds(self) -> str:
        """The bounds in words, such as ``> 0 and < 90``; empty where there are none."""
        signs = zip((">", ">=", "<", "<="), self, strict=True)
        return " and ".join(f"{sign} {bound:.12g}" for sign, bound in signs if bound is not None)

    @property
    def rule(self) -> str:
        """The whole range in words, such as ``finite and >= 0``."""
        return f"finite and {self.bounds}" if self.bounds else "finite"

    def admits(self, value: npt.ArrayLike) -> bool:
        """Whether every entry of a value is valid."""
        values = np.asarray(value, dtype=np.float64)
        valid = np.isfinite(values)
        tests = zip((np.greater, np.greater_equal, np.less, np.less_equal), self, strict=True)
        for test, bound in tests:
            if bound is not None:
                valid = valid & test(values, bound)
        return bool(np.all(valid))
