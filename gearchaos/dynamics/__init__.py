"""Orbits, their stability, Lyapunov exponents, labels and attractors of a system."""
