"""Any piecewise-linear machine: matrices, clearance elements and forces from a configuration."""
