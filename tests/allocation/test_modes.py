"""Truth: geometry of the direction, a brute-force search over dead bands, the limit of weights."""

from itertools import product

import numpy as np
import pytest

from casadi_gnc.allocation import AllocationProblem, AllocationStatus, Allocator, Saturation, solve
from casadi_gnc.allocation.modes import along_direction, axis_scale, by_priority, largest_scale, with_minimum_impulse
from casadi_gnc.errors import AllocationError
from casadi_gnc.problem_files.allocation_file import load_allocation


@pytest.fixture(scope="module")
def thrusters():
    return load_allocation("huang2020/allocation").problem


def test_direction_is_kept_and_as_long_as_can_be(thrusters, rng):
    nominal = AllocationProblem(thrusters.effectiveness, thrusters.lower, thrusters.upper, accuracy_weight=1e9)
    for _ in range(10):
        command = rng.normal(size=3)
        command *= 3e-3 / np.linalg.norm(command)
        answer, share = along_direction(Allocator(nominal), command)
        made = nominal.effectiveness @ answer.forces
        assert 0 < share < 1
        assert np.allclose(made, share * command, atol=2e-7)
        assert largest_scale(nominal, share * 0.999 * command, np.zeros(12)) == pytest.approx(1.0)
        assert largest_scale(nominal, share * 1.01 * command, np.zeros(12)) < 1


def test_small_commands_are_not_scaled(thrusters):
    _, share = along_direction(Allocator(thrusters), np.array([1e-4, 0, 0]))
    assert share == pytest.approx(1.0)


def test_unattainable_start_scales_to_zero():
    stuck = AllocationProblem(np.array([[1.0, 0.0], [0.0, 1.0]]), lower=[0.5, 0.0], upper=[0.5, 1.0])
    assert largest_scale(stuck, np.array([0.0, 1.0]), np.zeros(2)) == 0.0


def test_important_axes_are_served_first(thrusters):
    """A command that cannot be met: with priority the first axis misses less, the others more."""
    command = np.array([-1.2e-3, 2.5e-3, 2.5e-3])  # -x alone is within reach, +y and +z are not
    plain = solve(thrusters, command)
    scale = axis_scale([0, 1, 1], 1e4)
    first = solve(by_priority(thrusters, [0, 1, 1], 1e4), scale * command)
    missing = command - thrusters.effectiveness @ first.forces
    assert abs(missing[0]) < 0.05 * abs(plain.unallocated[0])
    assert np.linalg.norm(missing[1:]) > np.linalg.norm(plain.unallocated[1:])
    with pytest.raises(AllocationError, match="2 priorities for 3 rows"):
        by_priority(thrusters, [0, 1])


def test_dead_band_is_respected_and_its_cost_bounded(rng):
    """Against the best of all choices of off and on, found by brute force for four thrusters."""
    directions = np.array([[1.0, -1, 0.3, 0], [0, 0.2, 1, -1]])
    for _ in range(6):
        command = rng.uniform(-0.5, 0.5, 2)
        problem = AllocationProblem(directions, 0.0, 1.0, accuracy_weight=100.0)
        answer = with_minimum_impulse(problem, command, 0.3)
        assert np.all((answer.forces < 1e-12) | (answer.forces >= 0.3 - 1e-9))
        best = np.inf
        for on in product((False, True), repeat=4):
            lower, upper = np.where(on, 0.3, 0.0), np.where(on, 1.0, 0.0)
            choice = AllocationProblem(directions, lower, upper, accuracy_weight=100.0)
            found = solve(choice, command, np.zeros(4))
            best = min(best, problem.objective(found.forces, command, np.zeros(4)))
        # Never better than the best, and the stated gap covers the loss against it.
        assert answer.objective >= best - 1e-6
        assert answer.objective - best <= answer.duality_gap + 1e-9


def test_dead_band_needs_one_way_actuators():
    with pytest.raises(AllocationError, match="push one way"):
        with_minimum_impulse(AllocationProblem(np.eye(2), -1.0, 1.0), np.ones(2), 0.1)


@pytest.mark.parametrize("command", [1e120, 1e160, np.nan, np.inf])
def test_incredible_commands_stay_bad_in_every_mode(thrusters, command):
    u = np.array([command, 0.0, 0.0])
    rounded = with_minimum_impulse(thrusters, u, 1e-4)
    kept, share = along_direction(Allocator(thrusters), u)
    assert rounded.status is kept.status is AllocationStatus.BAD_COMMAND
    assert share == 0.0
    assert np.all(np.isfinite(rounded.forces))


def test_dead_band_keeps_rate_limits_and_says_what_saturates():
    problem = AllocationProblem(np.eye(2), 0.0, 1.0, max_step=0.3, accuracy_weight=100.0)
    answer = with_minimum_impulse(problem, np.array([0.2, 0.9]), 0.25, np.zeros(2))
    assert np.all(answer.forces <= 0.3)
    assert answer.forces[0] in (0.0, 0.25)
    assert answer.saturation[1] == Saturation.UPPER_RATE
    assert Saturation.STUCK not in answer.saturation


def test_boxes_are_checked(thrusters):
    allocator = Allocator(thrusters)
    wrong = [(np.full(12, 2e-3), np.full(12, 1e-3)), (np.full(12, np.nan), np.ones(12)), (np.zeros(1), np.ones(1))]
    for box in wrong:
        with pytest.raises(AllocationError, match="box has"):
            allocator.solve(np.zeros(3), np.zeros(12), box)


def test_an_infinite_cost_proves_nothing():
    problem = AllocationProblem(np.eye(2), 0.0, 1.0, change_weight=1e150)
    answer = Allocator(problem, "pinv").solve(np.ones(2), np.full(2, 1e90))
    assert answer.status is AllocationStatus.NOT_CERTIFIED
