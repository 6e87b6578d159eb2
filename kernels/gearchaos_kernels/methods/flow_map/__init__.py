"""Flow maps: exact steps of piecewise-linear systems."""
