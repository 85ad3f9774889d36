"""Coordinates of the state in which the Lyapunov matrix of a feedback is near a multiple of the identity.

x~ = T x with T'T = P, and P of the H-infinity Riccati equation a little above the smallest gamma for which SciPy
finds it, else of the linear-quadratic regulator. It is a guess, and only a guess: what is solved in these
coordinates is certified there. Units of the states, time and slow modes drop out; margins are meant in these
coordinates. Gains, norms and poles do not depend on T.
"""

from __future__ import annotations

import numpy as np

_SMALL = 1e-8  # of a weight's mean: what is added so that it is definite
_FLOOR = 1e-6  # of the mean variance: what is added to each state's
_STEPS, _ABOVE = 16, 1.03  # of bisection for gamma; how far above the last one P is taken


def balanced(A: np.ndarray, B: np.ndarray, E: np.ndarray, C: np.ndarray, D: np.ndarray) -> np.ndarray:
    """Return T, (n, n), regular, for x' = A x + B u + E w and z = C x + D u.

    Parameters
    ----------
    A : (n, n). B : (n, m). E : (n, q). C : (p, n). D : (p, m).

    Notes
    -----
    Where nothing stabilises the plant T is diagonal, of powers of two: zeros of the data stay, and proofs hang on them.
    """
    units = _units(A, B, E, C, D)
    a, b, e, c = A / units[:, None] * units, B / units[:, None], E / units[:, None], C * units
    best = _riccati(a, b, e, c, D, np.inf)
    if best is None:
        return np.diag(1 / units)
    scale = float(np.linalg.norm(c, 2) * np.linalg.norm(e, 2)) / max(float(np.linalg.norm(a, 2)), 1e-300)
    low, high = 1e-6, 1e6  # of that scale
    for _ in range(_STEPS if scale > 0 else 0):
        gamma = np.sqrt(low * high)
        found = _riccati(a, b, e, c, D, gamma * scale)
        low, high = (gamma, high) if found is None else (low, gamma)
        above = _riccati(a, b, e, c, D, _ABOVE * gamma * scale) if found is not None else None
        best = best if above is None else above
    return _root(best) / units


def _riccati(
    a: np.ndarray, b: np.ndarray, e: np.ndarray, c: np.ndarray, d: np.ndarray, gamma: float
) -> np.ndarray | None:
    """Return the positive definite stabilising solution, (n, n), or None; an infinite gamma leaves w out."""
    from scipy.linalg import solve_continuous_are

    R, cross = _definite(d.T @ d), c.T @ d
    if np.isfinite(gamma):
        b, cross = np.hstack([b, e / gamma]), np.hstack([cross, np.zeros_like(e)])
        corner = np.zeros((len(R), e.shape[1]))
        R = np.block([[R, corner], [corner.T, -np.eye(e.shape[1])]])
    try:
        P = solve_continuous_are(a, b, _definite(c.T @ c), R, s=cross)
        P = (P + P.T) / 2
        loop = a - b @ np.linalg.solve(R, b.T @ P + cross.T)
        if not np.all(np.isfinite(P)) or np.linalg.eigvals(loop).real.max() >= 0:
            return None
        np.linalg.cholesky(P)
    except (np.linalg.LinAlgError, ValueError):
        return None
    return P


def _root(P: np.ndarray) -> np.ndarray:
    """Return the upper factor T of P = T'T."""
    return np.linalg.cholesky(P).T


def _units(A: np.ndarray, B: np.ndarray, E: np.ndarray, C: np.ndarray, D: np.ndarray) -> np.ndarray:
    """Return units of the states, powers of two, (n,), that bring what enters each and what leaves it to like size.

    The inputs and outputs, whose units are those of the norm, close the loop: a chain of integrators has no units in A.
    """
    from scipy.linalg import matrix_balance

    n, inputs, outputs = len(A), B.shape[1] + E.shape[1], len(C)
    loop = np.zeros((n + inputs + outputs, n + inputs + outputs))
    loop[:n, : n + inputs] = np.hstack([A, B, E])
    loop[n : n + inputs, n + inputs :] = 1.0
    loop[n + inputs :, : n + B.shape[1]] = np.hstack([C, D])
    _, (units, _) = matrix_balance(loop, permute=False, separate=True)
    return np.asarray(units[:n], dtype=float)


def _definite(weight: np.ndarray) -> np.ndarray:
    mean = float(np.trace(weight)) / len(weight)
    return weight + _SMALL * (mean if mean > 0 else 1 / _SMALL) * np.eye(len(weight))


def covariance_root(A: np.ndarray, B: np.ndarray, E: np.ndarray, C: np.ndarray, D: np.ndarray) -> np.ndarray:
    """Return T^-1, (n, n), so that T x has a covariance near one, of the regulator's loop with white noise on E.

    Arguments are as of `balanced`. Where nothing stabilises the plant T is diagonal.
    """
    from scipy.linalg import solve_continuous_lyapunov

    units = _units(A, B, E, C, D)
    a, b, e, c = A / units[:, None] * units, B / units[:, None], E / units[:, None], C * units
    P = _riccati(a, b, e, c, D, np.inf)
    if P is None:
        return np.diag(units)
    loop = a - b @ _gain(P, b, c, D)
    X = solve_continuous_lyapunov(loop, -e @ e.T)
    X = (X + X.T) / 2 + _FLOOR * float(np.trace(X)) / len(X) * np.eye(len(X))
    try:
        return units[:, None] * np.linalg.cholesky(X)
    except np.linalg.LinAlgError:
        return np.diag(units)


def regulator(A: np.ndarray, B: np.ndarray, C: np.ndarray, D: np.ndarray) -> np.ndarray:
    """Return K, (m, n), of the linear-quadratic regulator u = -K x for z = C x + D u; zeros where there is none."""
    units = _units(A, B, np.zeros((len(A), 0)), C, D)
    a, b, c = A / units[:, None] * units, B / units[:, None], C * units
    P = _riccati(a, b, np.zeros((len(a), 1)), c, D, np.inf)
    if P is None:
        return np.zeros((B.shape[1], len(A)))
    return _gain(P, b, c, D) / units


def _gain(P: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    return np.linalg.solve(_definite(d.T @ d), b.T @ P + (c.T @ d).T)
