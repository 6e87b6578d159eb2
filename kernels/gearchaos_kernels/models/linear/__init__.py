"""Any piecewise-linear system: matrices, clearance elements, and harmonics that excite them."""
