"""LMIs by a primal-dual interior point in a few files of NumPy: no solver beyond them.

Equalities are eliminated by a basis of their null space; the rest is `primal_dual`. Without an objective the analytic
centre may be asked for: the point with the largest determinants, by damped Newton steps on the log-det barrier inside
a wide box. S. Boyd, L. Vandenberghe, Convex Optimization, 2004, section 9.6.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from casadi_gnc.synthesis.backends import Claim, Found
from casadi_gnc.synthesis.backends.analytic_centre import analytic_centre
from casadi_gnc.synthesis.backends.cones import Cone
from casadi_gnc.synthesis.backends.primal_dual import embedded
from casadi_gnc.synthesis.conic import Kind
from casadi_gnc.synthesis.scaling import Scaled

REQUIRES = ()
_RANK = 1e-13  # of the largest, below which a singular value is rounding


def solve(scaled: Scaled, *, tolerance: float = 1e-10, max_iterations: int = 200, centre: bool = False) -> Found:
    """Return the interior point's answer.

    Parameters
    ----------
    scaled : what to solve.
    tolerance : of gap and feasibility, relative; of certificates too.
    max_iterations : of the interior point, and of Newton's steps to the centre.
    centre : whether, without an objective, the analytic centre is returned: it is unique and does
        not depend on the scaling, but far out where the set is unbounded.
    """
    started = time.perf_counter()
    equal = np.zeros(len(scaled.right), dtype=bool)
    for block in scaled.data.blocks:
        equal[block.rows] = block.kind is Kind.EQUAL
    dense = scaled.matrix.toarray()
    rows, values = dense[equal], scaled.right[equal]
    particular = np.linalg.lstsq(rows, -values, rcond=None)[0]
    residual, dual = rows @ particular + values, np.zeros(len(equal))
    if np.linalg.norm(residual) > 1e-9 * (1 + np.linalg.norm(values)):
        dual[equal] = -residual  # orthogonal to the range: a certificate as it stands
        return Found(particular, dual, Claim.INFEASIBLE, 0, time.perf_counter() - started)
    basis = _null_space(rows, dense.shape[1])
    blocks = [block for block in scaled.data.blocks if block.kind is not Kind.EQUAL]
    cone = Cone(
        sum(block.size for block in blocks if block.kind is Kind.NONNEGATIVE),
        tuple(block.size for block in blocks if block.kind is Kind.SEMIDEFINITE),
    )
    idle = _idle(dense[~equal] @ basis)
    free = basis @ (idle @ (idle.T @ (basis.T @ scaled.cost)))
    if np.linalg.norm(free) > 1e-9 * np.linalg.norm(scaled.cost):  # it costs, and nothing holds it
        return Found(-free, dual, Claim.UNBOUNDED, 0, time.perf_counter() - started)
    basis = basis @ _null_space(idle.T, basis.shape[1])
    slopes, right = dense[~equal] @ basis, (dense @ particular + scaled.right)[~equal]
    found = embedded(slopes, right, basis.T @ scaled.cost, cone, tolerance, max_iterations)
    x, steps = found.x, found.iterations
    if centre and found.claim is Claim.SOLVED and not np.any(scaled.cost):
        x, more = analytic_centre(slopes, right, cone, x, max_iterations)
        steps += more
    dual[~equal] = found.z
    wanted = np.zeros(dense.shape[1]) if found.claim is Claim.INFEASIBLE else scaled.cost
    dual[equal] = np.linalg.lstsq(rows.T, wanted - dense.T @ dual, rcond=None)[0]
    point = basis @ x if found.claim is Claim.UNBOUNDED else particular + basis @ x
    return Found(point, dual, found.claim, steps, time.perf_counter() - started)


def _null_space(rows: np.ndarray, count: int) -> np.ndarray:
    if not len(rows):
        return np.eye(count)
    _, singular, right = np.linalg.svd(rows)
    rank = int(np.sum(singular > 1e-12 * singular[0])) if singular[0] > 0 else 0
    return right[rank:].T


def _idle(slopes: np.ndarray) -> np.ndarray:
    """Return a basis, (N, k), of the unknowns that no constraint feels; mostly there are none."""
    from scipy.linalg import qr

    size = np.linalg.norm(slopes, axis=0)
    size = np.where(size > 0, size, 1.0)
    factored: Any = qr(slopes / size, mode="r", pivoting=True, check_finite=False)
    diagonal = np.abs(np.diag(factored[0]))
    if len(diagonal) == len(size) and np.all(diagonal > _RANK * diagonal[0]):
        return np.zeros((len(size), 0))
    _, singular, right = np.linalg.svd(slopes / size)
    rank = int(np.sum(singular > _RANK * np.max(singular, initial=1e-300)))
    return np.linalg.qr(right[rank:].T / size[:, None])[0]
