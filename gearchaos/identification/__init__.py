"""Identification of unknown parameters of a gear pair from observations of its diagram."""
