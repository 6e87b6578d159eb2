"""The compiled layer: arrays and numbers in, arrays out."""

from gearchaos_kernels.batch import STATE_ROWS, Outcome, Plan, Scene, integrate
from gearchaos_kernels.coefficients import Model
from gearchaos_kernels.lane import LANES
from gearchaos_kernels.status import STATUS_TEXTS, Status
from gearchaos_kernels.threads import current_threads, most_threads, processor, use_threads

__all__ = [
    "LANES",
    "STATE_ROWS",
    "STATUS_TEXTS",
    "Model",
    "Outcome",
    "Plan",
    "Scene",
    "Status",
    "current_threads",
    "integrate",
    "most_threads",
    "processor",
    "use_threads",
]
