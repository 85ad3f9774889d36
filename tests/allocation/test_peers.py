"""Other programs' methods do what their papers say: closed forms by hand, SciPy's least squares, EIQP's formula."""

import math

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from casadi_gnc.allocation import AllocationProblem, backends, solve
from casadi_gnc.allocation.backends.eiqp_ import iterations_of
from casadi_gnc.allocation.backends.px4_ import asked


def plain(matrix, lower, upper, **weights):
    weights = {"change_weight": 0.0, "accuracy_weight": 1e6} | weights
    return AllocationProblem(np.array(matrix, dtype=float), lower, upper, **weights)


def test_one_redistribution_and_a_cascade_by_hand():
    """5 by three alike: 5/3 each, the first stops at 0.5; 2.25 each, the second stops at 1.9; a cascade goes on."""
    problem = plain([[1, 1, 1]], 0.0, [0.5, 1.9, 5.0])
    assert solve(problem, [5.0], backend="rpinv").forces == pytest.approx([0.5, 1.9, 2.25], abs=1e-12)
    assert solve(problem, [5.0], backend="cgi").forces == pytest.approx([0.5, 1.9, 2.6], abs=1e-12)
    assert solve(problem, [5.0], backend="pinv").forces == pytest.approx([0.5, 5 / 3, 5 / 3], abs=1e-12)


def test_inverses_weigh_as_the_cost_does():
    """Least of F1^2 + 4 (F2 - 1)^2 with F1 + F2 = 3: F1 = 4 (F2 - 1) gives 1.6 and 1.4."""
    problem = plain([[1, 1]], -9.0, 9.0, effort_weight=[1.0, 4.0], preferred=[0.0, 1.0])
    for name in ("rpinv", "cgi", "sls"):
        assert solve(problem, [3.0], backend=name).forces == pytest.approx([1.6, 1.4], abs=1e-9)


def test_a_cascade_misses_what_can_be_made_and_least_squares_do_not(rng):
    """It never looks back: of efforts that forces in the box make, some are missed."""
    missed = []
    for _ in range(40):
        problem = plain(rng.normal(size=(3, 5)), 0.0, 1.0)
        reachable = problem.effectiveness @ rng.choice([0.0, 0.9, 1.0], 5)  # near the edge of what can be made
        exact, cascade = (solve(problem, reachable, backend=name) for name in ("sls", "cgi"))
        assert np.linalg.norm(exact.unallocated) < 1e-9
        missed.append(np.linalg.norm(cascade.unallocated))
    assert max(missed) > 1e-2
    assert min(missed) < 1e-9


def test_sequential_least_squares_put_accuracy_first(rng):
    """The error is the least of all; among those, the effort is that of a very large accuracy weight."""
    for _ in range(30):
        matrix, upper = rng.normal(size=(3, 6)), rng.uniform(0.2, 1.0, 6)
        problem = plain(matrix, -0.1, upper, effort_weight=rng.uniform(0.5, 2.0, 6))
        command = matrix @ rng.uniform(-0.2, 1.2, 6)
        found = solve(problem, command, backend="sls")
        least = lsq_linear(matrix, command, (problem.lower, problem.upper), tol=1e-14)
        assert np.linalg.norm(found.unallocated) <= math.sqrt(2 * least.cost) + 1e-9
        size = np.sqrt(problem.effort_weight)
        limit = lsq_linear(
            np.vstack([1e4 * matrix, np.diag(size)]),
            np.append(1e4 * command, np.zeros(6)),
            (problem.lower, upper),
            tol=1e-14,
        )
        assert found.forces == pytest.approx(limit.x, abs=1e-4)  # its error times its weight is 1e-4 of the effort


def test_desaturation_balances_both_ends():
    ones = np.ones(3)
    assert asked(np.array([-0.3, 0.5, 0.2]), ones, 0 * ones, ones) == pytest.approx(0.3)
    assert asked(np.array([-0.3, 1.5, 0.2]), ones, 0 * ones, ones) == pytest.approx(0.3 - 0.5)
    assert asked(np.array([-0.3, 0.5, 0.2]), np.array([0.01, 1.0, 1.0]), 0 * ones, ones) == 0.0  # hardly moves it


def test_the_last_axis_is_given_up_first():
    """Half sum and half difference: 0.75 each makes the first axis, the second gets what is left of the box."""
    problem = plain([[1, 1], [1, -1]], -1.0, 1.0)
    found = solve(problem, [1.5, 1.0], backend="px4")
    assert problem.effectiveness @ found.forces == pytest.approx([1.5, 0.5], abs=1e-12)


def test_thrusters_that_push_one_way_are_lifted_together():
    problem = plain([[1, -1]], 0.0, 1.0)
    assert solve(problem, [0.5], backend="px4").forces == pytest.approx([0.5, 0.0], abs=1e-12)
    assert solve(problem, [3.0], backend="px4").forces == pytest.approx([1.0, 0.0], abs=1e-12)


def test_the_count_of_eiqp_is_known_beforehand(rng):
    assert iterations_of(24, 1e-8) == math.ceil(math.log(25e8) / -math.log(1 - 0.414213 / 5))
    counts = set()
    for scale in (1e-3, 1.0, 1e3):
        matrix = scale * rng.normal(size=(3, 5))
        problem = plain(matrix, 0.0, 1.0, effort_weight=rng.uniform(0.1, 10.0, 5), accuracy_weight=1e4 / scale**2)
        command = matrix @ rng.uniform(-0.2, 1.2, 5)
        found, least = (solve(problem, command, backend=name) for name in ("eiqp", "wls"))
        counts.add(found.iterations)
        assert found.forces == pytest.approx(least.forces, abs=1e-4)
        assert found.status.is_certified
    assert counts == {iterations_of(10, 1e-13)}


def test_who_minimises_something_else_says_so_and_is_not_exact():
    for name in backends.names():
        is_exact = backends.Capability.EXACT in backends.module(name).CAPABILITIES
        assert is_exact != bool(backends.objective_of(name)), name
