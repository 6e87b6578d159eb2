"""Period, bands, label and exponents of a recorded motion: NumPy only."""
