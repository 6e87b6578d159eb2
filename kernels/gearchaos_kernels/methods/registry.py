"""All methods."""

from gearchaos_kernels.methods.flow_map.method import FLOW_MAP
from gearchaos_kernels.methods.protocol import Method
from gearchaos_kernels.methods.rk4.method import RK4
from gearchaos_kernels.methods.taylor.method import TAYLOR

METHODS: dict[str, Method] = {method.name: method for method in (RK4, FLOW_MAP, TAYLOR)}
"""All methods by their names."""
