"""Clearance elements: their forces, their branches, and where a motion leaves a branch."""
