"""Linear programs of one shape that differ in their data, solved as one: the set-up of each costs more than it does.

SciPy's programs are imported where they are solved: a flight does without.
"""

from __future__ import annotations

from typing import Any

import numpy as np

#: Largest share that is looked for.
_MOST = 1e6
#: Where a program counts as unsolved, for numbers hundreds of decades apart may never end: by iterations, so that what
#: is found is the same on a busy machine, and by seconds where not even one ends.
PATIENCE = {"maxiter": 50_000, "time_limit": 15.0}
UNSOLVED = 1


def largest_shares(matrix: np.ndarray, wanted: np.ndarray, lower: Any, upper: Any) -> np.ndarray:
    """Return for each wanted effort w the largest s with matrix F = s w and F within bounds, (K,).

    0 if there is none, NaN where it is not found in time.

    Parameters
    ----------
    matrix : (R, N).
    wanted : (K, R).
    lower, upper : bounds of F, (N,).
    """
    from scipy import sparse
    from scipy.optimize import linprog

    count, n = len(wanted), matrix.shape[1]
    # Rows in their own units: arms of kilometres beside centimetres are no reason to fail.
    reach = _units(np.abs(matrix) @ np.maximum(np.abs(np.array(lower)), np.abs(np.array(upper))))
    matrix, wanted = matrix / reach[:, None], wanted / reach
    parts = [sparse.kron(sparse.identity(count), matrix), sparse.block_diag([-effort[:, None] for effort in wanted])]
    found = linprog(
        np.r_[np.zeros(count * n), -np.ones(count)],
        A_eq=sparse.hstack(parts, format="csr"),
        b_eq=np.zeros(wanted.size),
        bounds=[*zip(lower, upper, strict=True)] * count + [(0, _MOST)] * count,
        options=PATIENCE,
    )
    if found.status == 0:
        return np.array(found.x)[count * n :]
    if found.status == UNSOLVED:
        return np.full(count, np.nan)
    # One that has no answer leaves all without one.
    return np.zeros(1) if count == 1 else np.hstack([largest_shares(matrix, w[None], lower, upper) for w in wanted])


def least_shares(bounds: np.ndarray, gain: np.ndarray, load: np.ndarray) -> np.ndarray:
    """Return for each load d the least s >= 0 with G F = -d and bounds (F, s) <= 0, (K,).

    Infinite if there is none, NaN where it is not found in time.

    Parameters
    ----------
    bounds : (M, N + 1), the same for all.
    gain, load : G, (K, n, N), and d, (K, n).
    """
    from scipy import sparse
    from scipy.optimize import linprog

    count, n = len(gain), gain.shape[2]
    bounds = bounds / _units(np.abs(bounds).max(axis=1))[:, None]
    size = _units(np.abs(gain).max(axis=2))
    gain, load = gain / size[:, :, None], load / size
    eye = sparse.identity(count)
    found = linprog(
        np.r_[np.zeros(count * n), np.ones(count)],
        A_ub=sparse.hstack([sparse.kron(eye, bounds[:, :n]), sparse.kron(eye, bounds[:, n:])], format="csr"),
        b_ub=np.zeros(count * len(bounds)),
        A_eq=sparse.hstack([sparse.block_diag(list(gain)), sparse.csr_array((load.size, count))], format="csr"),
        b_eq=-load.ravel(),
        bounds=[(None, None)] * (count * n) + [(0, None)] * count,
        options=PATIENCE,
    )
    if found.status == 0:
        return np.array(found.x)[count * n :]
    if found.status == UNSOLVED:
        return np.full(count, np.nan)
    if count == 1:
        return np.array([np.inf])
    return np.hstack([least_shares(bounds, g[None], d[None]) for g, d in zip(gain, load, strict=True)])


def _units(sizes: np.ndarray) -> np.ndarray:
    """Return sizes to divide by; of what is nothing, or has no number, 1."""
    return np.where((sizes > 0) & np.isfinite(sizes), sizes, 1.0)
