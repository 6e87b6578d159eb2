"""All recorders."""

from dataclasses import make_dataclass
from typing import Any

from gearchaos_kernels.recorders.amplitudes import AMPLITUDES
from gearchaos_kernels.recorders.contact import CONTACT
from gearchaos_kernels.recorders.frame import FRAME
from gearchaos_kernels.recorders.growth import GROWTH
from gearchaos_kernels.recorders.history import HISTORY
from gearchaos_kernels.recorders.loads import LOADS
from gearchaos_kernels.recorders.protocol import Recorders
from gearchaos_kernels.recorders.section import SECTION
from gearchaos_kernels.scene import implement

RECORDERS = (SECTION, HISTORY, GROWTH, FRAME, CONTACT, LOADS, AMPLITUDES)
"""All recorders in the order of their calls: a frame adds to the growth that has been written, and
amplitudes read rows that loads have written.
"""

Recorded = make_dataclass("Recorded", [(one.name, Any, None) for one in RECORDERS], frozen=True)
Recorded.__module__ = __name__
"""Flags of the recorders of a scene, one for each name."""

implement(Recorded, Recorders(RECORDERS))
