"""The compiled layer: arrays and numbers in, arrays out."""

from gearchaos_kernels.batch import integrate
from gearchaos_kernels.compilation import CACHE_FOLDER, source_hash
from gearchaos_kernels.evaluation import jacobian, mesh_motion
from gearchaos_kernels.flow_map import maps_are_kept, maps_memory
from gearchaos_kernels.rows import LANES
from gearchaos_kernels.system import (
    STATES,
    STATUS_TEXTS,
    Effects,
    Groups,
    MeshMotion,
    Outcome,
    Plan,
    Status,
    System,
    Teeth,
)
from gearchaos_kernels.turns import ForkedProcessError, require_threads
