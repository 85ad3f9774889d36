"""H-infinity Riccati equations by SciPy, and the smallest gamma they allow by bisection: the oracle of the recipes."""

import numpy as np
from scipy.linalg import solve_continuous_are


def riccati(a, b, e, q, r, gamma):
    """Return the stabilising P >= 0 of a'P + P a + q - P (b b'/r - e e'/gamma^2) P = 0, or None."""
    weights = np.diag(np.concatenate([np.full(b.shape[1], r), np.full(e.shape[1], -(gamma**2))]))
    try:
        P = solve_continuous_are(a, np.hstack([b, e]), q, weights)
    except (np.linalg.LinAlgError, ValueError):
        return None
    poles = np.linalg.eigvals(a - b @ b.T @ P / r + e @ e.T @ P / gamma**2)
    # Below the smallest gamma SciPy returns solutions whose loop lies on the axis, to rounding.
    strictly = poles.real.max() < -1e-7 * np.abs(poles).max()
    return P if strictly and np.linalg.eigvalsh(P)[0] > -1e-9 * np.linalg.norm(P) else None


def smallest_gamma(a, b, e, q, r):
    """Return the smallest gamma for which the equation has such a solution."""
    low, high = 1e-3, 1e3
    for _ in range(50):
        middle = np.sqrt(low * high)
        low, high = (low, middle) if riccati(a, b, e, q, r, middle) is not None else (middle, high)
    return high
