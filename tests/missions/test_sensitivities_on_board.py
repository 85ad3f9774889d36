"""Derivatives of flights through the on-board allocator, which are those of its optimality conditions.

Truths: differences of the flights, extrapolated (Richardson), and of the conditions' solution in 30 digits.
"""

import numpy as np
import pytest
from differences import flown, richardson
from mpmath import mp

from casadi_gnc.allocation.in_flight import OnlineInFlight
from casadi_gnc.allocation.online import OnlineSolver

ROBUST = ["initial.rate_rad_per_s", "scheme.funnel_robust.law.rate_gain"]
#: Flights through the on-board allocator, and how many samples of them. A tumble has so many changes of sets that after
#: more samples no step lies between them and the root of the gap.
ON_BOARD = {
    "huang2020/slew": ("funnel_robust", ROBUST, 1000),
    "huang2019/tough": ("observers_robust", ["initial.mrp", "initial.rate_rad_per_s"], 1000),
    "huang2020/detumble": ("observer_robust", ["initial.rate_rad_per_s"], 300),
    "satellites/thruster_hold": ("robust", ["initial.euler_321_deg", "initial.rate_deg_per_s"], 1000),
}


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [pytest.param(one, marks=[] if one == "huang2020/slew" else pytest.mark.long) for one in ON_BOARD]
)
def test_through_the_on_board_allocator(name, monkeypatch):
    """Truth: differences of the flight itself, of the step whose own error is estimated least.

    The derivatives are those of the optimum, and the flight's forces lie within the certified gap of it: with the gap
    of 1e-8 differences of a slew are off by up to 4e-6, so the solver is asked for a smaller one here.
    """

    def finer(allocator, compiler=None):
        return OnlineSolver(allocator.problem, compiler=compiler, tolerance=1e-13)

    monkeypatch.setattr(OnlineInFlight, "solver", finer)
    scheme, keys, samples = ON_BOARD[name]
    varied, engine, p, _, record, weights = flown(name, scheme, keys, samples)
    seed = varied.nominal.noise.seed
    found = engine.values(p, seed)
    assert np.array_equal(found.asked, record)
    back = engine.adjoint(p, seed, weights, found)
    np.testing.assert_allclose(engine.tangents(p, seed, weights, np.eye(len(p))), back, rtol=1e-8)
    for i, direction in enumerate(np.eye(len(p))):
        slopes = [
            richardson(lambda at: (weights * engine.values(at, seed).asked).sum(), p, direction, step)
            for step in max(abs(p[i]), 1e-3) * np.array([3e-2, 3e-3, 3e-4, 1e-4, 3e-5, 1e-5])
        ]
        slope, _ = min(slopes, key=lambda one: one[1])
        assert back[i] == pytest.approx(slope, rel=1e-6), varied.parameters.keys[i]


def exact_forces(problem, command, box, raw):
    """Return the forces that solve the optimality conditions on the sets of an answer, from rest, to 30 digits."""
    mp.dps = 30
    weights = [v for v, weight in enumerate(raw.weights) if weight > 1e-9]
    held = [force in (low, high) for force, low, high in zip(raw.forces, *box, strict=True)]
    free = [i for i, fixed in enumerate(held) if not fixed]
    B = [mp.matrix(problem.effectiveness + problem.errors[v] @ problem.coupling) for v in weights]
    h, q = mp.mpf(problem.accuracy_weight), problem.effort_weight + problem.change_weight
    F, w = mp.matrix(raw.forces), mp.matrix([raw.weights[v] for v in weights])
    for _ in range(4):
        r = [b * F - mp.matrix(command) for b in B]
        G = [h * b.T * each for b, each in zip(B, r, strict=True)]
        n, k = len(free), len(weights)
        K, residual = mp.zeros(n + k + 1), mp.zeros(n + k + 1, 1)
        for a, i in enumerate(free):
            residual[a] = q[i] * F[i] - problem.effort_weight[i] * problem.preferred[i]
            residual[a] += sum(w[c] * G[c][i] for c in range(k))
            for b, j in enumerate(free):
                K[a, b] = sum(w[c] * h * sum(B[c][e, i] * B[c][e, j] for e in range(3)) for c in range(k))
                K[a, b] += q[i] if i == j else 0
            for c in range(k):
                K[a, n + c] = K[n + c, a] = G[c][i]
        cost = [h * (each.T * each)[0] / 2 for each in r]
        for c in range(k):
            residual[n + c] = cost[c] - cost[0]
            K[n + c, n + k], K[n + k, n + c] = -1, 1
        residual[n + k] = sum(w) - 1
        step = mp.lu_solve(K, -residual)
        for a, i in enumerate(free):
            F[i] += step[a]
        for c in range(k):
            w[c] += step[n + c]
    return F, tuple(held), tuple(weights)


def ties(problem, command, forces, held, vertices):
    """Return how far the conditions that the worst vertices tie are from one that follows from the others, 0 to 1."""
    free = [i for i, fixed in enumerate(held) if not fixed]
    each = [problem.effectiveness + problem.errors[v] @ problem.coupling for v in vertices]
    gradients = [(B.T @ (B @ forces - command))[free] for B in each]
    apart = np.array([one - gradients[0] for one in gradients[1:]])
    if not len(apart):
        return 1.0
    return np.linalg.svd(apart / np.linalg.norm(apart, axis=1, keepdims=True), compute_uv=False)[-1]


@pytest.mark.slow
def test_the_allocator_is_differentiated_as_its_optimality_conditions_are():
    """Truth: differences of the solution of the conditions in 30 digits, at many sets of bounds and worst vertices."""
    varied, engine, _, _, record, _ = flown("huang2020/slew", "funnel_robust", ROBUST, samples=1)
    scheme, count = varied.scheme, record.shape[1]
    problem = scheme.actuation.allocator.problem
    reach = scheme.actuation.rate * varied.mission.timing.sample_period
    box = [np.clip(np.full(problem.count, side), scheme.actuation.lower, scheme.actuation.upper)
           for side in (-reach, reach)]  # fmt: skip
    rng, sets, none = np.random.default_rng(5), set(), np.zeros(problem.count)
    compared = 0
    for _ in range(40):
        p = varied.parameters.nominal.copy()
        p[:3] = rng.standard_normal(3) * 10 ** rng.uniform(-4, -1)
        direction = np.append(rng.standard_normal(3), 0.0)
        limited = engine.values(p, 1).asked[0, -problem.count - 3 : -problem.count]
        slopes = np.zeros(count)
        for i in range(count - problem.count - 3, count):
            weights = np.zeros(record.shape)
            weights[0, i] = 1.0
            (slopes[i],) = engine.tangents(p, 1, weights, direction[None, :])
        efforts, slopes = np.split(slopes, [count - problem.count])
        raw = OnlineSolver(problem).solve(limited, none, *box)
        step = mp.mpf(10) ** -9
        try:
            (ahead, *known), (behind, *_) = (
                exact_forces(problem, mp.matrix(limited) + sign * step * mp.matrix(efforts[-3:]), box, raw)
                for sign in (1, -1)
            )
        except ZeroDivisionError:  # more worst vertices than the weights can be told of
            continue
        if ties(problem, np.array(limited), np.array([float(force) for force in ahead]), *known) < 1e-6:
            continue  # one tie follows from the others, and which of their weights changes is anybody's choice
        sets.add(tuple(known))
        compared += 1
        truth = np.array([float((a - b) / (2 * step)) for a, b in zip(ahead, behind, strict=True)])
        np.testing.assert_allclose(slopes, truth, rtol=1e-6, atol=1e-7 * np.abs(truth).max())
    assert len(sets) >= 5
    assert compared >= 30
