"""Linear programs of one shape that differ in their data, solved as one: the set-up of each costs more than it does.

Clarabel's interior point takes them, to ten digits. Where it does not end well, and of programs without an answer,
SciPy's simplex has the word: importing it takes longer than a check does.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np

#: Largest share that is looked for.
_MOST = 1e6
#: Where a program counts as unsolved, for numbers hundreds of decades apart may never end: by iterations, so that what
#: is found is the same on a busy machine, and by seconds where not even one ends.
_PATIENCE = {"maxiter": 50_000, "time_limit": 15.0}
_UNSOLVED = 1
#: Gap and feasibility that Clarabel is asked for.
_TOLERANCE = 1e-10
#: Digits of a share, after the point and in all, beyond which it is that tolerance's rounding.
_DIGITS = 9


def least(
    cost: np.ndarray, inequalities: Any, equalities: Any, known: np.ndarray, box: np.ndarray
) -> np.ndarray | None:
    """Return x of the least cost.x with A x <= 0, E x = e and bounds; None if there is none, NaN if not solved.

    Parameters
    ----------
    cost : (n,).
    inequalities, equalities : A, E, sparse; (M, n), (K, n).
    known : e, (K,).
    box : least and largest x, (2, n); infinite where there is no bound.
    """
    found = _interior_point(cost, inequalities, equalities, known, box)
    return _simplex(cost, inequalities, equalities, known, box) if found is None else found


def _interior_point(
    cost: np.ndarray, inequalities: Any, equalities: Any, known: np.ndarray, box: np.ndarray
) -> np.ndarray | None:
    """Return Clarabel's answer; None where it is not sure of one."""
    from scipy import sparse

    clarabel: Any = import_module("clarabel")  # it tells type checkers nothing
    lower, upper = np.isfinite(box)
    eye: Any = sparse.identity(cost.size, format="csr")
    rows = sparse.vstack([equalities, inequalities, -eye[lower], eye[upper]], format="csc")
    right = np.r_[known, np.zeros(inequalities.shape[0]), -box[0][lower], box[1][upper]]
    settings = clarabel.DefaultSettings()
    settings.verbose, settings.time_limit = False, _PATIENCE["time_limit"]
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = _TOLERANCE
    cones = [clarabel.ZeroConeT(known.size), clarabel.NonnegativeConeT(right.size - known.size)]
    none = sparse.csc_matrix((cost.size, cost.size))
    if not (np.isfinite(rows.data).all() and np.isfinite(right).all()):
        return None
    solution = clarabel.DefaultSolver(none, cost, rows, right, cones, settings).solve()
    return np.array(solution.x) if str(solution.status) == "Solved" else None


def _simplex(
    cost: np.ndarray, inequalities: Any, equalities: Any, known: np.ndarray, box: np.ndarray
) -> np.ndarray | None:
    from scipy.optimize import linprog

    found = linprog(
        cost,
        A_ub=inequalities,
        b_ub=np.zeros(inequalities.shape[0]),
        A_eq=equalities,
        b_eq=known,
        bounds=box.T,
        options=_PATIENCE,
    )
    if found.status == _UNSOLVED:
        return np.full(cost.size, np.nan)
    return np.array(found.x) if found.status == 0 else None


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

    count, n = len(wanted), matrix.shape[1]
    # Rows in their own units: arms of kilometres beside centimetres are no reason to fail.
    reach = _units(np.abs(matrix) @ np.maximum(np.abs(np.array(lower)), np.abs(np.array(upper))))
    matrix, wanted = matrix / reach[:, None], wanted / reach
    parts = [sparse.kron(sparse.identity(count), matrix), sparse.block_diag([-effort[:, None] for effort in wanted])]
    found = least(
        np.r_[np.zeros(count * n), -np.ones(count)],
        sparse.csr_array((0, count * (n + 1))),
        sparse.hstack(parts, format="csr"),
        np.zeros(wanted.size),
        np.array([[*lower] * count + [0.0] * count, [*upper] * count + [_MOST] * count]),
    )
    if found is not None:
        return _shares(found[count * n :])
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

    count, n = len(gain), gain.shape[2]
    bounds = bounds / _units(np.abs(bounds).max(axis=1))[:, None]
    size = _units(np.abs(gain).max(axis=2))
    gain, load = gain / size[:, :, None], load / size
    eye = sparse.identity(count)
    found = least(
        np.r_[np.zeros(count * n), np.ones(count)],
        sparse.hstack([sparse.kron(eye, bounds[:, :n]), sparse.kron(eye, bounds[:, n:])], format="csr"),
        sparse.hstack([sparse.block_diag(list(gain)), sparse.csr_array((load.size, count))], format="csr"),
        -load.ravel(),
        np.array([[-np.inf] * (count * n) + [0.0] * count, [np.inf] * (count * (n + 1))]),
    )
    if found is not None:
        return _shares(found[count * n :])
    if count == 1:
        return np.array([np.inf])
    return np.hstack([least_shares(bounds, g[None], d[None]) for g, d in zip(gain, load, strict=True)])


def _shares(found: np.ndarray) -> np.ndarray:
    """Return shares without the digits that are rounding: one that is 1 counts as 1."""
    return np.array([float(f"{round(float(share), _DIGITS):.{_DIGITS}g}") for share in found])


def _units(sizes: np.ndarray) -> np.ndarray:
    """Return sizes to divide by; of what is nothing, or has no number, 1."""
    return np.where((sizes > 0) & np.isfinite(sizes), sizes, 1.0)
