"""Unknown parameters of a pair, fitted to what was observed of its bifurcation diagram."""
