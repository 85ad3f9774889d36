"""A primal-dual interior point on the self-dual embedding: a point, or multipliers or a ray instead of one.

    minimise cost'x  subject to  s = slopes x + right in K,     K as in `casadi_gnc.synthesis.backends.cones`

| symbol | code | meaning |
|---|---|---|
| x, s, z | `x`, `s`, `z` | unknowns, slack, multipliers, all times tau |
| tau, kappa | `tau`, `kappa` | tau > 0: solved; kappa > 0: there is no point, or no minimum |
| W, lambda | `scaling` | Nesterov and Todd's scaling at (s, z) |

    -slopes'z + cost tau = 0,   s - slopes x - right tau = 0,   kappa + cost'x + right'z = 0,   s'z + tau kappa = 0

Y. Ye, M. J. Todd, S. Mizuno, 1994, doi:10.1287/moor.19.1.53; steps by Mehrotra's predictor and corrector. Newton's
equations are least squares in W^-T slopes, solved by an orthogonal factor, which squares no condition number.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from casadi_gnc.synthesis.backends import Claim
from casadi_gnc.synthesis.backends.cones import Cone, Scaling

_SHORT = 0.99  # of the step to the boundary
_SMALLEST = 1e-6  # steps below get nowhere
_IDLE = 15  # iterations in which nothing gets better
_RESISTS = 1e-13  # what every unknown meets beside the slopes, whose columns have length one
_LOOSE = 1e-5  # what is claimed of an iterate where rounding ended the steps


@dataclass(frozen=True, eq=False)
class Ended:
    """Hold how the iteration ended: a point, (N,), or a ray, multipliers, (rows,), and iterations."""

    x: np.ndarray
    z: np.ndarray
    claim: Claim
    iterations: int


@dataclass(frozen=True, eq=False)
class _Iterate:
    x: np.ndarray
    s: np.ndarray
    z: np.ndarray
    tau: float
    kappa: float


def embedded(slopes: np.ndarray, right: np.ndarray, cost: np.ndarray, cone: Cone, tolerance: float, most: int) -> Ended:
    """Return the end of the iteration.

    Parameters
    ----------
    slopes : (rows, N). right : (rows,). cost : (N,).
    tolerance : of residuals and gap, relative; of multipliers and rays too.
    most : iterations.
    """
    tensors, scaling, one = cone.tensors(slopes), Scaling.unit(cone), cone.one()
    here = _Iterate(np.zeros(len(cost)), one, one, 1.0, 1.0)
    best, found, ended = (np.inf, Claim.NOTHING, here), 0, 0
    for ended in range(most):
        worst, claim = _progress(slopes, right, cost, here)
        if worst < best[0]:
            best, found = (worst, claim, here), ended
        if worst <= tolerance or ended > found + _IDLE:
            break
        try:
            here, scaling, length = _step(slopes, right, cost, tensors, scaling, here)
        except np.linalg.LinAlgError:
            break
        if not length > _SMALLEST:
            break
    worst, claim, here = best
    size = here.tau if claim is Claim.SOLVED else 1.0
    return Ended(here.x / size, here.z / size, claim if worst <= _LOOSE else Claim.NOTHING, ended)


def _progress(slopes: np.ndarray, right: np.ndarray, cost: np.ndarray, at: _Iterate) -> tuple[float, Claim]:
    """Return how far an iterate is from what it is nearest to, and what that is."""
    price, height = float(cost @ at.x), -float(right @ at.z)
    # An infeasible or unbounded set, by its own measure
    nothing = float(np.linalg.norm(slopes.T @ at.z)) / height if height > 0 else np.inf
    ray = float(np.linalg.norm(slopes @ at.x - at.s)) / -price if price < 0 else np.inf
    primal = float(np.linalg.norm(at.s - slopes @ at.x - right * at.tau)) / at.tau / (1 + float(np.linalg.norm(right)))
    dual = float(np.linalg.norm(cost * at.tau - slopes.T @ at.z)) / at.tau / (1 + float(np.linalg.norm(cost)))
    gap = float(at.s @ at.z) / at.tau**2 / (1 + min(abs(price), abs(height)) / at.tau)
    solved = max(primal, dual, gap)
    if at.tau >= at.kappa or solved <= min(nothing, ray):
        return solved, Claim.SOLVED
    return (nothing, Claim.INFEASIBLE) if nothing <= ray else (ray, Claim.UNBOUNDED)


class _Equations:
    """Solve slopes'dz = a, slopes dx + W'W dz = b, for the scaled columns at hand."""

    def __init__(self, columns: np.ndarray) -> None:
        self._columns, count = columns, columns.shape[1]
        size = np.linalg.norm(columns, axis=0)
        self._size = np.where(size > 0, size, 1.0)
        # Where nothing resists, the step is long: a ray.
        self._factor = np.linalg.qr(np.vstack([columns / self._size, _RESISTS * np.eye(count)]), mode="r")

    def solve(self, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return dx and W dz for a and W^-T b."""
        x, dual = np.zeros(len(a)), b.copy()
        for _ in range(3):  # what is left of the first equation goes round again
            lacking = self._columns.T @ dual - a
            more = self._normal(lacking)
            x, dual = x + more, dual - self._columns @ more
        return x, dual

    def _normal(self, a: np.ndarray) -> np.ndarray:
        from scipy.linalg import solve_triangular

        half = solve_triangular(self._factor, a / self._size, trans=1, check_finite=False)
        return solve_triangular(self._factor, half, check_finite=False) / self._size


def _step(
    slopes: np.ndarray,
    right: np.ndarray,
    cost: np.ndarray,
    tensors: list[np.ndarray],
    scaling: Scaling,
    at: _Iterate,
) -> tuple[_Iterate, Scaling, float]:
    """Return the next iterate, its scaling, and the length of the step."""
    columns = scaling.columns(slopes, tensors)
    if not np.all(np.isfinite(columns)):
        raise np.linalg.LinAlgError
    equations, level = _Equations(columns), scaling.here()
    x1, dual1 = equations.solve(cost, -scaling.of_slack(right))
    z1 = scaling.dual(dual1)
    down = float(cost @ x1 + right @ z1) - at.kappa / at.tau
    first = cost * at.tau - slopes.T @ at.z
    second = at.s - slopes @ at.x - right * at.tau
    third = at.kappa + float(cost @ at.x + right @ at.z)
    centre = (float(at.s @ at.z) + at.tau * at.kappa) / (scaling.cone.degree + 1)
    one, bend, bend_tau, share = scaling.cone.one(), np.zeros_like(level), 0.0, 0.0
    for corrects in (False, True):
        kept = 1 - share
        wanted = scaling.divided(share * centre * one - scaling.product(level, level) - bend)
        wanted_tau = share * centre - at.tau * at.kappa - bend_tau
        scaled = scaling.of_slack(second)
        x0, dual0 = equations.solve(kept * first, kept * scaled + wanted)
        z0 = scaling.dual(dual0)
        tau = (-kept * third - wanted_tau / at.tau - float(cost @ x0 + right @ z0)) / down
        x, dual = x0 + tau * x1, dual0 + tau * dual1
        slack, kappa = wanted - dual, (wanted_tau - at.kappa * tau) / at.tau
        length = min(
            scaling.furthest(slack),
            scaling.furthest(dual),
            -at.tau / tau if tau < 0 else np.inf,
            -at.kappa / kappa if kappa < 0 else np.inf,
        )
        length = min(1.0, (_SHORT if corrects else 1.0) * length)
        if not corrects:
            share = (1 - length) ** 3
            bend, bend_tau = scaling.product(slack, dual), tau * kappa
    moved = scaling.moved(level + length * slack, level + length * dual)
    lambdas = moved.here()
    return (
        _Iterate(at.x + length * x, moved.slack(lambdas), moved.dual(lambdas), at.tau + length * tau,
                 at.kappa + length * kappa),
        moved,
        length,
    )  # fmt: skip
