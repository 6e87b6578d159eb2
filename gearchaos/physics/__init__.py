"""The gear pair: its geometry, mesh and pitch error, its dimensionless groups, its Jacobian."""
