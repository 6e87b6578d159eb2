"""Recorders of every lane during an integration, one per file."""
