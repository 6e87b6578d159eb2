"""What is read off a result: slices, stages, jumps, crises, ensembles, overview and tables."""
