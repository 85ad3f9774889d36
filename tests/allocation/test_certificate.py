"""The certificate of an answer, and the vertex weights sought where a solver gives none."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from casadi_gnc.allocation import ACCURACIES, AllocationStatus, Saturation, best_weights, certify, solve

_spec = importlib.util.spec_from_file_location(
    "allocation_cases", Path(__file__).parents[1] / "oracles" / "allocation_cases.py"
)
oracle = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(oracle)
CASES = oracle.cases()
ROBUST = [label for label, case in CASES.items() if case.problem.is_robust]


def sample(case):
    return (case.command, case.previous, *case.problem.box(case.previous))


@pytest.mark.parametrize("label", ROBUST)
def test_weights_found_afterwards_are_as_good_as_the_multipliers(label):
    """Twice the gap, or the floor of "high" (1e-14): the search is a least-squares problem in doubles."""
    case = CASES[label]
    found = solve(case.problem, case.command, case.previous, backend="ipopt")
    weights = best_weights(case.problem, found.forces, *sample(case))
    assert weights.min() >= 0
    assert weights.sum() == pytest.approx(1.0, abs=1e-12)
    gap = case.problem.gap(found.forces, weights, *sample(case))
    largest = max(case.problem.full_effort, float(np.linalg.norm(case.command)))
    floor = ACCURACIES["high"][1] * case.problem.accuracy_weight * largest**2
    assert gap <= 2 * max(found.duality_gap, 0.0) + 1e-9 * found.objective + floor


@pytest.mark.parametrize("label", ROBUST)
def test_gap_is_a_bound_for_any_weights_and_forces(label, rng):
    case = CASES[label]
    best = solve(case.problem, case.command, case.previous, backend="ipopt")
    lower, upper = case.problem.box(case.previous)
    for _ in range(20):
        forces = rng.uniform(lower, upper)
        gap = case.problem.gap(forces, rng.exponential(size=len(case.problem.errors)), *sample(case))
        cost = case.problem.objective(forces, case.command, case.previous)
        assert cost - gap <= best.objective * (1 + 1e-12) + 1e-13 * cost


def test_strong_convexity_bounds_the_forces(rng):
    """sum q_i (F - F*)_i^2 / 2 <= gap, with q = 2 (M1 + M2)."""
    case = CASES["5 mm, random 0"]
    best = solve(case.problem, case.command, case.previous, backend="ipopt").forces
    lower, upper = case.problem.box(case.previous)
    for _ in range(50):
        forces = rng.uniform(lower, upper)
        _, gap, _, _ = certify(
            case.problem, case.command, case.previous, forces, None, ACCURACIES["mid"], case.problem.box(case.previous)
        )
        assert ((case.problem.effort_weight + case.problem.change_weight) * (forces - best) ** 2).sum() <= gap


def test_status_follows_the_gap():
    case = CASES["5 mm, random 0"]
    best = solve(case.problem, case.command, case.previous, backend="ipopt")

    def status(forces, accuracy):
        box = case.problem.box(case.previous)
        return certify(case.problem, case.command, case.previous, forces, None, accuracy, box)[3]

    worse = np.clip(best.forces + 1e-6, *case.problem.box(case.previous))
    assert status(best.forces, ACCURACIES["high"]) is AllocationStatus.OPTIMAL
    assert status(worse, ACCURACIES["high"]) is AllocationStatus.NOT_CERTIFIED
    assert status(worse, (0.0, 1.0)) is AllocationStatus.NOT_CERTIFIED  # far above the least cost, whatever the floor
    near = np.clip(best.forces + 1e-9, *case.problem.box(case.previous))
    assert status(near, (0.0, 1.0)) is AllocationStatus.AT_ROUNDING


def test_saturation_says_which_bound():
    problem = oracle.huang2020(0.0, max_step=1e-3, lower=np.append(np.zeros(11), oracle.MAX_FORCE))
    found = solve(problem, 10 * oracle.COMMAND, np.full(12, 1.5e-3))
    lower, upper = problem.box(np.full(12, 1.5e-3))
    assert found.saturation[11] == Saturation.STUCK
    for force, code, low, high in zip(found.forces, found.saturation, lower, upper, strict=True):
        if code == Saturation.LOWER_RATE:
            assert force == pytest.approx(low)
            assert low > 0
        elif code == Saturation.UPPER_RATE:
            assert force == pytest.approx(high)
            assert high < oracle.MAX_FORCE
        elif code == Saturation.FREE:
            assert low < force < high
    assert {Saturation.LOWER_RATE, Saturation.UPPER_RATE} <= set(found.saturation)
    found = solve(oracle.huang2020(0.0), 10 * oracle.COMMAND)
    assert {Saturation.LOWER_AMPLITUDE, Saturation.UPPER_AMPLITUDE} <= set(found.saturation)
