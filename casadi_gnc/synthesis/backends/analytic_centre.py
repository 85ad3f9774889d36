"""The analytic centre: the point with the largest determinants, by damped Newton steps on the log-det barrier.

A wide box keeps it finite where the set has no end.
S. Boyd, L. Vandenberghe, Convex Optimization, 2004, sections 9.6 and 8.5.
"""

from __future__ import annotations

import numpy as np

from casadi_gnc.synthesis.backends.cones import Cone

_BOX = 1e7  # walls of the box, in scaled units, where data and usual answers are near one


def analytic_centre(
    slopes: np.ndarray, right: np.ndarray, cone: Cone, x: np.ndarray, budget: int
) -> tuple[np.ndarray, int]:
    """Return the centre, (N,), or how far the budget of Newton steps has come, and the steps.

    Parameters
    ----------
    slopes : (rows, N). right : (rows,). The set is slopes x + right in the cone.
    x : (N,), strictly inside; returned as it is where it is not.
    """
    walls = np.vstack([np.eye(len(x)), -np.eye(len(x))])
    slope = np.vstack([slopes[: cone.plain], walls])
    base = np.concatenate([right[: cone.plain], np.full(len(walls), _BOX)])
    tensors, last = cone.tensors(slopes), np.inf
    here = _barrier(slopes, right, cone, slope, base, x)
    for step in range(budget):
        if not np.isfinite(here):
            return x, step
        gradient, hessian = _derivatives(cone, tensors, slopes @ x + right, slope, base + slope @ x)
        unit = 1 / np.sqrt(np.maximum(np.diag(hessian), 1e-300))
        direction = -unit * np.linalg.lstsq(hessian * np.outer(unit, unit), unit * gradient, rcond=1e-15)[0]
        decrement = -float(gradient @ direction)
        # Newton's method squares it near the end: where it does not, rounding has taken over.
        if not decrement > 1e-9 or (last < 0.1 and decrement > last / 2):
            return x, step
        last, length = decrement, 1.0 if decrement < 0.1 else 1 / (1 + np.sqrt(decrement))
        while length > 1e-12:
            there = _barrier(slopes, right, cone, slope, base, x + length * direction)
            if there - here <= -0.1 * length * decrement + 1e-12 * abs(here):
                break
            length /= 2
        else:
            return x, step
        x, here = x + length * direction, there
    return x, budget


def _barrier(
    slopes: np.ndarray, right: np.ndarray, cone: Cone, slope: np.ndarray, base: np.ndarray, x: np.ndarray
) -> float:
    """Return -sum log det, infinite outside."""
    rows, (_, matrices) = base + slope @ x, cone.split(slopes @ x + right)
    if not (np.all(rows > 0) and np.all(np.isfinite(x))):
        return np.inf
    total = -float(np.sum(np.log(rows)))
    try:
        for matrix in matrices:
            total -= 2 * float(np.sum(np.log(np.diag(np.linalg.cholesky(matrix)))))
    except np.linalg.LinAlgError:
        return np.inf
    return total


def _derivatives(
    cone: Cone, tensors: list[np.ndarray], values: np.ndarray, slope: np.ndarray, rows: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return gradient, (N,), and Hessian, (N, N), of the barrier inside."""
    share = slope / rows[:, None]
    gradient, hessian = -share.sum(axis=0), share.T @ share
    for matrix, tensor in zip(cone.split(values)[1], tensors, strict=True):
        inverse = np.linalg.inv(np.linalg.cholesky(matrix))
        relative = inverse @ tensor @ inverse.T
        gradient -= np.trace(relative, axis1=1, axis2=2)
        flat = relative.reshape(len(tensor), -1)
        hessian += flat @ flat.T
    return gradient, hessian
