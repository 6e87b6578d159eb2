"""From a configuration to the lanes of a sweep, computed block by block by the kernels."""
