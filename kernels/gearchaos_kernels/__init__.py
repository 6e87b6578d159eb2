"""Compiled integration of many lanes: arrays and numbers in, arrays out.

`integrate` integrates a batch of lanes (`GearPairs` or another `LaneSystem`) as a `Plan` says and
returns an `Outcome`. `jacobian`, `evaluate` and `mesh_motion` evaluate the equations on given
states. Everything is in the units of the equations; time is the dimensionless tau.
"""

from gearchaos_kernels.batch import integrate, maps_are_kept, maps_memory
from gearchaos_kernels.compilation import CACHE_FOLDER, source_hash
from gearchaos_kernels.control import Control
from gearchaos_kernels.evaluation import Motion, evaluate, jacobian
from gearchaos_kernels.gaps import Gaps, gap_polynomials, gaps_along, steps_taken
from gearchaos_kernels.memory.rows import LANES
from gearchaos_kernels.methods.registry import METHODS
from gearchaos_kernels.models.gear_pair.evaluation import mesh_motion
from gearchaos_kernels.models.gear_pair.groups import STATES, Effects, Groups
from gearchaos_kernels.models.gear_pair.pairs import GearPairs, MeshMotion
from gearchaos_kernels.models.gear_pair.tooth_errors import Teeth
from gearchaos_kernels.models.lane_system import LaneSystem
from gearchaos_kernels.plan import STATUS_TEXTS, Outcome, Plan, Status
from gearchaos_kernels.turns import ForkedProcessError, require_threads
