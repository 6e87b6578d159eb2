"""The compiled layer: arrays and numbers in, arrays out."""

from gearchaos_kernels.batch import integrate
from gearchaos_kernels.block_memory import LANES
from gearchaos_kernels.compilation import CACHE_FOLDER, source_hash
from gearchaos_kernels.status import STATUS_TEXTS, Status
from gearchaos_kernels.system import STATES, Effects, Groups, MeshMotion, Outcome, Plan, System
from gearchaos_kernels.threads import current_threads, most_threads, processor, use_threads
