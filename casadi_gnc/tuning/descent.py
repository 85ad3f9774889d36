"""Sequential quadratic programming for the largest or the mean of several costs, made for flights side by side.

An iteration asks twice: for the slopes of all costs, and for the costs at several steps at once, one for each of some
trust radii, of which the best one is taken. So an iteration has the length of two flights where lanes are wide, and
no line search follows one step after the other. The first iteration looks at points all over the bounds instead. The
model is

    minimise over (d, t)   t + d' B d / 2
    with   f_i + g_i' d <= t (the largest), or their mean;   c_j + a_j' d >= 0;   |d| <= radius;   low <= z + d <= high,

B by damped BFGS updates of the Lagrangian (J. Nocedal, S. Wright, Numerical Optimization, 2006, section 18.3). Where no
step lowers the cost, or slopes are no numbers, CMA-ES searches about the iterate (`casadi_gnc.tuning.evolution`);
without it, and along one gain, points are drawn and the best one is taken, in three rounds, each closer than the one
before. A search that finds none is the statement that there is none nearby.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.campaigns.plans import Sobol
from casadi_gnc.tuning import evolution

#: Trust radii that are tried at once, in units of the present one.
_RADII = (2.0, 1.0, 0.5, 0.2, 0.05, 0.01)
#: A step must lower the cost by such a share to count.
LEAST = 1e-4
#: How far points are drawn about an iterate where no step helps, in units of the radius.
_SHRINK = (1.0, 0.3, 0.1)
_DRAWN = 24
#: Points all over the bounds before the first step: so many, twice for each gain, and at most.
_SPREAD, _MOST_SPREAD = 8, 128


@dataclass(frozen=True, eq=False)
class Problem:
    """Say what is made small, all of it at coordinates z, (P,).

    Parameters
    ----------
    costs : points (n, P) -> (n, cases), infinite where there is none.
    slopes : z -> (cases, P), NaN where there is none.
    conditions : z -> (C,), all at least 0 where they hold.
    allowed : z -> whether further constraints, which have no slope, hold.
    low, high : bounds, (P,).
    worst : whether the largest cost counts, instead of the mean.
    """

    costs: Callable[[np.ndarray], np.ndarray]
    slopes: Callable[[np.ndarray], np.ndarray]
    conditions: Callable[[np.ndarray], np.ndarray]
    allowed: Callable[[np.ndarray], bool]
    low: np.ndarray
    high: np.ndarray
    worst: bool = True

    def merit(self, costs: np.ndarray) -> np.ndarray:
        """Return the largest or the mean of costs, (n, cases) -> (n,)."""
        return costs.max(axis=-1) if self.worst else costs.mean(axis=-1)


@dataclass(frozen=True, eq=False)
class Iterate:
    """Hold where a descent is, all that it needs to go on.

    Parameters
    ----------
    z : coordinates. costs : of the cases. value : their largest, or mean.
    curvature : B. radius : of trust.
    number : of iterations so far. how : "spread", "slope", "evolution", "sampling", or what ended the descent.
    done : whether nothing better was found nearby.
    """

    z: np.ndarray
    costs: np.ndarray
    value: float
    curvature: np.ndarray
    radius: float = 1.0
    number: int = 0
    how: str = ""
    done: bool = False
    slopes: np.ndarray | None = field(default=None, repr=False)

    def data(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {
            "z": self.z.tolist(), "costs": self.costs.tolist(), "value": self.value, "radius": self.radius,
            "curvature": self.curvature.tolist(), "number": self.number, "how": self.how, "done": self.done,
        }  # fmt: skip

    @classmethod
    def of_data(cls, data: dict[str, Any]) -> Iterate:
        """Return what `data` told."""
        arrays = {key: np.array(data[key], dtype=float) for key in ("z", "costs", "curvature")}
        return cls(**{**data, **arrays})


def begin(problem: Problem, z: np.ndarray, *, radius: float = 1.0, number: int = 0) -> Iterate:
    """Return the iterate before the first iteration."""
    costs = problem.costs(z[None, :])[0]
    return Iterate(z, costs, float(problem.merit(costs)), np.eye(len(z)), radius, number, "start")


def descend(problem: Problem, at: Iterate, iterations: int, seed: int = 0) -> Iterator[Iterate]:
    """Yield one iterate after another, each lower than the one before; the last one is `done` or of the last number.

    Parameters
    ----------
    at : where to begin. iterations : the number at which it ends at the latest.
    seed : of the points that are drawn; with the number of the iteration it determines them.
    """
    while at.number < iterations and not at.done:
        if at.number == 0:
            at = _spread(problem, at, seed)
            yield at
            continue
        slopes = problem.slopes(at.z) if at.slopes is None else at.slopes
        best, weights = None, None
        if np.isfinite(slopes).all():
            steps, weights = _steps(problem, at, slopes)
            best = _best(problem, at, at.z + steps)
        if best is None:
            at = _sampled(problem, at, seed)
            yield at
            continue
        z, costs = best
        later = problem.slopes(z)
        curvature = at.curvature
        if weights is not None and np.isfinite(later).all():
            curvature = _updated(curvature, z - at.z, weights @ (later - slopes))
        length = float(np.abs(z - at.z).max())
        value = float(problem.merit(costs))
        settled = at.value - value < LEAST * abs(at.value) and at.how == "slope"
        at = Iterate(
            z, costs, value, curvature, min(3.0, max(1.5 * length, 1e-3)), at.number + 1, "slope", settled, later
        )
        yield at


def _spread(problem: Problem, at: Iterate, seed: int) -> Iterate:
    """Return the best of the iterate and of points all over the bounds: costs of whole flights have many valleys."""
    cube = Sobol(len(at.z)).points(seed, 0, min(_SPREAD * 2 ** len(at.z), _MOST_SPREAD))
    best = _best(problem, at, problem.low + cube * (problem.high - problem.low))
    if best is None:
        return replace(at, number=1, how="spread")
    return replace(at, z=best[0], costs=best[1], value=float(problem.merit(best[1])), number=1, how="spread")


def _steps(problem: Problem, at: Iterate, slopes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return steps, (n, P), of the model for each radius, and the weight of each cost in the Lagrangian."""
    count, size = slopes.shape
    conditions = problem.conditions(at.z)
    leaning = _jacobian(problem, at.z, conditions)
    if not problem.worst:
        slopes, costs, count = slopes.mean(axis=0)[None, :], np.array([at.value]), 1
    else:
        costs = at.costs
    scale = max(abs(at.value), 1e-300)
    rows = np.vstack(
        [np.hstack([slopes / scale, -np.ones((count, 1))]), np.hstack([leaning, np.zeros((len(leaning), 1))])]
    )
    above = np.concatenate([-(costs - at.value) / scale, np.full(len(leaning), np.inf)])
    below = np.concatenate([np.full(count, -np.inf), -np.maximum(conditions, 0.0)])
    H = np.zeros((size + 1, size + 1))
    H[:size, :size], H[size, size] = at.curvature, 1e-9
    g = np.zeros(size + 1)
    g[size] = 1.0
    solver = ca.conic(
        "step", "qrqp", {"h": ca.Sparsity.dense(size + 1, size + 1), "a": ca.Sparsity.dense(*rows.shape)},
        {"print_iter": False, "print_header": False, "print_info": False, "error_on_fail": False},
    )  # fmt: skip
    steps, weights = [], np.full(count, 1.0 / count)
    for share in _RADII:
        reach = share * at.radius
        low = np.append(np.maximum(-reach, problem.low - at.z), -np.inf)
        high = np.append(np.minimum(reach, problem.high - at.z), np.inf)
        found = solver(h=H, g=g, a=rows, lba=below, uba=above, lbx=low, ubx=high)
        if not solver.stats()["success"]:
            continue
        steps.append(np.clip(np.array(found["x"]).ravel()[:size], low[:size], high[:size]))
        if share == 1.0:
            weights = np.clip(np.array(found["lam_a"]).ravel()[:count], 0.0, None)
    # The model may be wrong in shape and right in direction.
    down = -(weights @ slopes)
    if np.abs(down).max() > 0:
        along = down / np.abs(down).max() * at.radius
        steps += [np.clip(along * share, problem.low - at.z, problem.high - at.z) for share in _RADII[1:]]
    if not problem.worst:
        weights = np.full(len(at.costs), weights.sum() / len(at.costs))
    return np.array(steps).reshape(-1, size), weights / scale


def _jacobian(problem: Problem, z: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return the slopes of the conditions, (C, P), by differences: they are formulas, and smooth."""
    found, step = np.zeros((len(at), len(z))), 1e-6
    for i in range(len(z)):
        moved = z.copy()
        moved[i] += step if z[i] + step <= problem.high[i] else -step
        found[:, i] = (problem.conditions(moved) - at) / (moved[i] - z[i])
    return found


def _best(problem: Problem, at: Iterate, points: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the point of the lowest cost below the iterate's that keeps all constraints, with its costs."""
    points = points[np.abs(points - at.z).max(axis=1) > 1e-12] if len(points) else points
    if not len(points):
        return None
    costs = problem.costs(points)
    values = problem.merit(costs)
    for i in np.argsort(values):
        if not values[i] < at.value:
            return None
        if (problem.conditions(points[i]) >= np.minimum(0.0, problem.conditions(at.z)) - 1e-9).all() and (
            problem.allowed(points[i])
        ):
            return points[i], costs[i]
    return None


def _sampled(problem: Problem, at: Iterate, seed: int) -> Iterate:
    """Return the best of points about the iterate, evolved or drawn, or the iterate, `done`, where none is better."""

    def later(best: tuple[np.ndarray, np.ndarray] | None, how: str) -> Iterate | None:
        if best is None or not problem.merit(best[1]) < at.value - LEAST * abs(at.value):
            return None
        value = float(problem.merit(best[1]))
        return Iterate(best[0], best[1], value, np.eye(len(at.z)), at.radius, at.number + 1, how)

    nothing = replace(at, number=at.number + 1, how="nothing better nearby", done=True)
    if evolution.serves(len(at.z)):
        return later(evolution.evolved(problem, at, seed), "evolution") or nothing
    generator = np.random.default_rng((seed, at.number))
    for share in _SHRINK:
        drawn = at.z + share * max(at.radius, 0.1) * generator.standard_normal((_DRAWN, len(at.z)))
        found = later(_best(problem, at, np.clip(drawn, problem.low, problem.high)), "sampling")
        if found is not None:
            return found
    return nothing


def _updated(B: np.ndarray, s: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the curvature after a damped BFGS update (Nocedal and Wright, procedure 18.2)."""
    Bs, sy = B @ s, float(s @ y)
    sBs = float(s @ Bs)
    if sBs <= 0:
        return B
    theta = 1.0 if sy >= 0.2 * sBs else 0.8 * sBs / (sBs - sy)
    r = theta * y + (1.0 - theta) * Bs
    return B - np.outer(Bs, Bs) / sBs + np.outer(r, r) / float(s @ r)
