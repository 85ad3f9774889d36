"""Descent of functions that have kinks: the quasi-Newton step with the line search of Lewis and Overton.

The search asks for less descent than the slope promises and for a slope that became flatter (weak Wolfe conditions); it
needs no smoothness, and BFGS with it ends at kinks as a rule, though no theorem says so (A. S. Lewis, M. L. Overton,
2013, doi:10.1007/s10107-012-0514-2). A value may be infinite: such a step is shortened.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Sloped = Callable[[np.ndarray], tuple[float, np.ndarray]]  # a point, (n,), to value and gradient, (n,)

_LESS, _FLATTER = 1e-4, 0.5  # of the slope: descent that is asked for, and how flat it is to become
_HALVINGS, _PATIENCE = 40, 8


def descend(
    sloped: Sloped, start: np.ndarray, *, steps: int = 200, relative: float = 1e-5, enough: float = -np.inf
) -> tuple[float, np.ndarray]:
    """Return the least value that was found, and its point, (n,).

    Parameters
    ----------
    sloped : returns value and gradient; the value at the start is finite.
    start : (n,).
    steps : most of them.
    relative : descent, of the value or of one, below which several steps in a row end the search.
    enough : value below which it ends.
    """
    point = start
    value, gradient = sloped(point)
    inverse, first, idle = np.eye(len(point)), True, 0
    for _ in range(steps):
        if value < enough or idle >= _PATIENCE or not np.any(gradient):
            break
        direction = -inverse @ gradient
        if not gradient @ direction < 0:
            inverse, first = np.eye(len(point)), True
            direction = -gradient
        if first:
            direction = direction / max(1.0, float(np.linalg.norm(direction)))
        found = _along(sloped, point, value, gradient, direction)
        if found is None:
            if first:
                break
            inverse, first = np.eye(len(point)), True
            continue
        step, new, other = found
        moved, turned = step * direction, other - gradient
        idle = idle + 1 if value - new <= relative * max(abs(value), 1.0) else 0
        curved = float(moved @ turned)
        if curved > 0:
            if first:
                inverse = curved / float(turned @ turned) * np.eye(len(point))
            part = np.eye(len(point)) - np.outer(moved, turned) / curved
            inverse = part @ inverse @ part.T + np.outer(moved, moved) / curved
            first = False
        point, value, gradient = point + moved, new, other
    return value, point


def _along(
    sloped: Sloped, point: np.ndarray, value: float, gradient: np.ndarray, direction: np.ndarray
) -> tuple[float, float, np.ndarray] | None:
    """Return a step along a direction of descent with value and gradient behind it; None where none descends."""
    low, high, step = 0.0, np.inf, 1.0
    slope, best = float(gradient @ direction), None
    for _ in range(_HALVINGS):
        new, other = sloped(point + step * direction)
        if not new < value + _LESS * step * slope:
            high = step
        else:
            best = (step, new, other)
            if float(other @ direction) >= _FLATTER * slope:
                break
            low = step
        step = (low + high) / 2 if np.isfinite(high) else 2 * low
    return best
