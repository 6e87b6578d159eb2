"""The Gauss-Lobatto rule that integrates signals along a smooth piece of a step."""

import numpy as np

POINTS = 9
"""Number of points of the rule. It is exact up to the last term of a signal."""


def _gauss_lobatto(count: int) -> tuple[list[float], list[float]]:
    """Return points and weights of the Gauss-Lobatto rule from -1 to 1."""
    last = np.polynomial.legendre.Legendre.basis(count - 1)
    points = np.concatenate([[-1.0], np.sort(last.deriv().roots().real), [1.0]])
    weights = 2.0 / (count * (count - 1) * last(points) ** 2)
    return points.tolist(), weights.tolist()


PLACES, WEIGHTS = _gauss_lobatto(POINTS)
"""Points of the rule, from -1 to 1, and their weights."""
