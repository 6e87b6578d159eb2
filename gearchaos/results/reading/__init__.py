"""Evaluation of results: slices, stages, jumps, crises, ensembles, overview and tables."""
