"""CMA-ES where slopes lie: a search among points that asks for no slope, by the package `cma` where it is installed.

The strategy draws generations from a normal distribution whose covariance it adapts to the better half of each
(N. Hansen, The CMA Evolution Strategy: A Tutorial, arXiv:1604.00772). It begins at an iterate of the descent and sees
points in the bounds alone. Points that break a condition are ranked behind all that keep them, by how much they do.
"""

from __future__ import annotations

import importlib.util
import math
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from casadi_gnc.tuning.descent import Iterate, Problem

#: Points of a generation, which fly side by side; generations at most, and at most without a better point.
_GENERATION, _MOST, _PATIENCE = 24, 20, 8
#: First deviation, in units of the radius of trust, within these limits of a coordinate.
_SHARE, _LEAST, _LARGEST = 0.5, 0.05, 0.5
#: What to do about points that are drawn without it.
ADVICE = (
    "slopes led nowhere, and points about the iterate were drawn; CMA-ES searches there after "
    'pip install "casadi-gnc[tuning]"'
)


def serves(size: int) -> bool:
    """Return whether it can search among so many gains: `cma` is there, which has no search along one line."""
    return size > 1 and importlib.util.find_spec("cma") is not None


def evolved(problem: Problem, at: Iterate, seed: int) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the point of the lowest cost that was found below the iterate's and keeps all constraints, and its costs.

    Parameters
    ----------
    problem : what is made small.
    at : where it begins.
    seed : with the number of the iteration it determines what is drawn.
    """
    import cma  # type: ignore[import-not-found]

    generator = np.random.default_rng((seed, at.number))
    options = {
        "bounds": [problem.low, problem.high], "popsize": _GENERATION, "maxiter": _MOST, "verbose": -9,
        "seed": math.nan, "randn": lambda *shape: generator.standard_normal(shape),
    }  # fmt: skip
    width = min(max(_SHARE * at.radius, _LEAST), _LARGEST)
    search = cma.CMAEvolutionStrategy(at.z, width, options)
    least = np.minimum(0.0, problem.conditions(at.z)) - 1e-9
    best: tuple[np.ndarray, np.ndarray] | None = None
    value, since = at.value, 0
    while not search.stop() and since < _PATIENCE:
        since += 1
        points = search.ask()
        told = np.array(points)
        costs = problem.costs(told)
        ranks = problem.merit(costs)
        short = np.array([np.maximum(least - problem.conditions(point), 0.0).sum() for point in told])
        for i in np.argsort(ranks):
            if not ranks[i] < value:
                break
            if short[i] == 0:
                if problem.allowed(told[i]):
                    best, value, since = (told[i], costs[i]), float(ranks[i]), 0
                    break
                short[i] = 1.0
        search.tell(points, _ranked(ranks, short).tolist())
    return best


def _ranked(values: np.ndarray, short: np.ndarray) -> np.ndarray:
    """Return finite values in whose order points without a cost come last, before them those that break constraints."""
    known: Any = values[np.isfinite(values)]
    worst = float(known.max(initial=0.0))
    span = worst - float(known.min(initial=worst)) + abs(worst) + 1.0
    found = np.where(np.isfinite(values), values, worst + 3 * span)
    return found + np.where(short > 0, span * (1 + np.minimum(short, 1.0)), 0.0)
