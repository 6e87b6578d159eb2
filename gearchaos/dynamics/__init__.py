"""What one asks of a system: orbits, loss of stability, exponents, mesh forces."""
