"""Columns of very different size: certified means within 1e-6 of the least cost, by scipy and in exact arithmetic."""

from fractions import Fraction

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from casadi_gnc.allocation import AllocationProblem, AllocationStatus, Allocator, backends
from casadi_gnc.allocation.answer import ACCURACIES, certify, floor_of
from casadi_gnc.allocation.online import OnlineSolver


def family(seed, decades, *, robust=False):
    """Return a problem whose columns spread over decades, and commands from near zero to beyond reach."""
    rng = np.random.default_rng(seed)
    count = (6, 8, 12)[seed % 3]
    A = rng.normal(size=(3, count)) * 10.0 ** rng.uniform(-decades / 2, decades / 2, count)
    more = {}
    if robust:
        more = {
            "coupling": rng.normal(size=(3, count)),
            "errors": [np.diag(rng.choice([-0.01, 0.01], 3)) for _ in range(8)],
        }
    problem = AllocationProblem(
        A, -1.0 if seed % 2 else 0.0, 1.0, accuracy_weight=10.0 ** rng.uniform(2, 8), change_weight=0.0, **more
    )
    scales = 10.0 ** rng.uniform(-3, 0.5, 8)
    return problem, [A @ rng.uniform(problem.lower, problem.upper) * scale for scale in scales]


def least_cost(problem, command):
    """Return the least cost without uncertainty, by scipy on columns of like size."""
    A, h = problem.effectiveness, problem.accuracy_weight
    size = np.sqrt(h * np.sum(A**2, axis=0) + 1)
    rows = np.vstack([np.sqrt(h) * A / size, np.diag(1 / size)])
    right = np.concatenate([np.sqrt(h) * command, np.zeros(problem.count)])
    bounds = (problem.lower * size, problem.upper * size)
    forces = np.clip(lsq_linear(rows, right, bounds, method="bvls", tol=1e-15).x / size, problem.lower, problem.upper)
    return problem.objective(forces, command, np.zeros(problem.count))


@pytest.mark.parametrize("only", [True, False], ids=["interior point", "both"])
@pytest.mark.parametrize("decades", [pytest.param(0, marks=pytest.mark.slow), 3])
def test_columns_apart_are_certified_and_the_best(decades, only):
    for seed in range(12):
        problem, commands = family(seed, decades)
        allocator = Allocator(problem, "online", accuracy="mid", interior_point_only=only)
        for command in commands:
            found = allocator.solve(command, np.zeros(problem.count))
            assert found.status is AllocationStatus.OPTIMAL, (seed, found.relative_gap)
            assert found.objective <= least_cost(problem, command) * (1 + 1.1e-6)  # and the rounding of both


@pytest.mark.parametrize("decades", [pytest.param(0, marks=pytest.mark.slow), 3])
def test_uncertain_columns_apart_are_certified_by_the_interior_point_alone(decades):
    for seed in range(6):
        problem, commands = family(seed, decades, robust=True)
        alone = Allocator(problem, "online", accuracy="mid", interior_point_only=True)
        for command in commands:
            assert alone.solve(command, np.zeros(problem.count)).status is AllocationStatus.OPTIMAL


def test_what_the_on_board_solver_calls_certified_is_within_a_millionth():
    for decades in (0, 2, 3, 4):
        for seed in range(6):
            problem, commands = family(seed, decades)
            solver = OnlineSolver(problem)
            for command in commands:
                solver.reset()
                raw = solver.solve(command, np.clip(np.zeros(problem.count), 0, 1), problem.lower, problem.upper)
                assert raw.status == 2 or raw.gap <= 1.001e-6 * raw.objective
                assert raw.status == 2 or raw.objective <= least_cost(problem, command) * (1 + 1.1e-6)


def exact_gap(problem, forces, weights, command):
    """Return the gap of `AllocationProblem.gap` in fractions, without uncertainty and change."""
    A = [[Fraction(value) for value in row] for row in problem.effectiveness.tolist()]
    F, u, h = (
        [Fraction(f) for f in forces.tolist()],
        [Fraction(c) for c in command.tolist()],
        Fraction(problem.accuracy_weight),
    )
    missing = [c - sum(a * f for a, f in zip(row, F, strict=True)) for c, row in zip(u, A, strict=True)]
    gap = Fraction(0)
    for i, f in enumerate(F):
        g = 2 * f - 2 * h * sum(row[i] * m for row, m in zip(A, missing, strict=True))
        d = min(max(-g / 2, Fraction(problem.lower[i]) - f), Fraction(problem.upper[i]) - f)
        gap -= g * d + d * d
    return float(gap), float(h * sum(m * m for m in missing) + sum(f * f for f in F))


def test_forces_that_cost_a_million_times_the_least_are_never_certified_at_the_floor():
    """A torque of 0.01 from a strong actuator costs 1e-5^2, from the weak one 0.01^2, by hand; the floor is 1."""
    problem, torque = AllocationProblem([[1e3, 1.0]], -1.0, 1.0, accuracy_weight=1e4, change_weight=0.0), 0.01
    sample = (np.array([torque]), np.zeros(2))
    best = 1e4 * np.array([1e3, 1.0]) * torque / (1 + 1e4 * (1e6 + 1))  # F = h A' (u - A F)
    for forces, status in (
        (best, AllocationStatus.OPTIMAL),
        ([0.0, torque], AllocationStatus.NOT_CERTIFIED),
        (best * 1.01, AllocationStatus.NOT_CERTIFIED),  # misses 1e-4: costs 1e-4 and not 1e-10
    ):
        box = (problem.lower, problem.upper)
        cost, gap, _, judged = certify(problem, *sample, np.array(forces), None, ACCURACIES["mid"], box)
        assert judged is status, (forces, cost, gap)
    assert floor_of(problem, sample[0], ACCURACIES["mid"]) == pytest.approx(1.0, rel=0.01)


def test_the_certificate_is_that_of_exact_arithmetic():
    """Torque and forces cancel in nine digits and more; the gap is right to a billionth of the cost."""
    for decades in (0, 3):
        for seed in range(12):
            problem, commands = family(seed, decades)
            allocator = Allocator(problem, "online")
            for command in commands[:4]:
                found = allocator.solve(command, np.zeros(problem.count))
                gap, cost = exact_gap(problem, found.forces, found.vertex_weights, command)
                assert found.objective == pytest.approx(cost, rel=1e-12)
                assert abs(found.duality_gap - gap) <= 1e-9 * cost


def test_without_weights_everybody_solves_the_same():
    """M1 = M2 = 0: 1e-9 h |A|^2 is added, and is part of cost and certificate in Python and in C."""
    rng = np.random.default_rng(5)
    A = rng.normal(size=(3, 8))
    problem = AllocationProblem(A, 0.0, 1.0, effort_weight=0.0, change_weight=0.0)
    np.testing.assert_allclose(problem.effort_weights, 1e-9 * 1e6 * np.sum(A**2))
    told = AllocationProblem(A, 0.0, 1.0, effort_weight=problem.effort_weights, change_weight=0.0)
    for command in (A @ rng.uniform(0, 1, 8), A @ rng.uniform(0, 0.2, 8), 10 * rng.normal(size=3)):
        answers = {name: Allocator(problem, name).solve(command) for name in ("online", "clarabel")}
        raw = OnlineSolver(problem).solve(command, np.zeros(8), problem.lower, problem.upper)
        assert raw.status <= 1
        for answer in answers.values():
            assert answer.status.is_certified
            assert answer.objective == pytest.approx(told.objective(answer.forces, command, np.zeros(8)), rel=1e-12)
        assert answers["online"].objective == pytest.approx(answers["clarabel"].objective, rel=1e-5)
        assert raw.objective == pytest.approx(answers["online"].objective, rel=1e-5)
    assert "online" in backends.names()
