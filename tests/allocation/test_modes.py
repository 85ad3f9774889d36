"""Truth: geometry of the direction, a brute-force search over dead bands, the limit of weights."""

from itertools import product

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from casadi_gnc.allocation import AllocationProblem, AllocationStatus, Allocator, Saturation, solve
from casadi_gnc.allocation.direction import along_direction, largest_scale, least_angle
from casadi_gnc.allocation.impulse import WITHIN, never_fires, with_minimum_impulse
from casadi_gnc.allocation.priorities import axis_scale, by_priority
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


@pytest.mark.parametrize(
    ("lower", "upper", "command", "effort"),
    [
        ([0.5, 0.0], [0.5, 1.0], [0.0, 0.2], [0.5, 0.2]),  # stuck: what is asked along the command, and no more
        ([0.5, 0.0], [0.5, 1.0], [0.0, 2.0], [0.5, 1.0]),
        ([0.2, 0.0], [1.0, 1.0], [0.0, 0.4], [0.2, 0.4]),  # a lower bound above zero
        ([0.0, -1.0], [0.0, 1.0], [0.3, 0.4], [0.0, 0.4]),  # dead: the other axis is kept
        ([0.0, -1.0], [0.0, 1.0], [3.0, -4.0], [0.0, -1.0]),
    ],
)
def test_where_the_direction_is_lost_the_least_angle_is_kept(lower, upper, command, effort):
    problem = AllocationProblem(np.eye(2), lower, upper, accuracy_weight=1e9, change_weight=0.0)
    answer, share = along_direction(Allocator(problem), np.array(command))
    assert answer.status is AllocationStatus.DIRECTION_TURNED
    np.testing.assert_allclose(answer.forces, effort, atol=1e-3)  # Clarabel's digits, and the price of the size
    assert share == pytest.approx(np.dot(effort, command) / np.dot(command, command), abs=1e-4)
    np.testing.assert_allclose(answer.unallocated, np.array(command) - answer.forces, atol=1e-12)


def test_the_angle_is_the_least_of_many(rng):
    """Against the best of forces drawn at random and improved: none turns less."""
    for _ in range(12):
        A, lower = rng.normal(size=(3, 5)), rng.uniform(0.1, 0.4, 5)
        problem = AllocationProblem(A, lower, lower + rng.uniform(0, 1, 5))
        command = rng.normal(size=3)
        forces = rng.uniform(problem.lower, problem.upper, size=(20000, 5))
        efforts = forces @ A.T
        along = efforts @ command / np.linalg.norm(command)
        cosines = along / np.linalg.norm(efforts, axis=1)
        allowed = along <= np.linalg.norm(command)
        best = np.max(cosines[allowed], initial=-1.0)
        found = least_angle(problem, command, np.zeros(5))
        if found is None:
            assert best <= 1e-6
            assert along_direction(Allocator(problem), command)[0].status is AllocationStatus.DIRECTION_LOST
            continue
        cosine = command @ found / np.linalg.norm(command) / np.linalg.norm(found)
        assert cosine >= best - 1e-6
        answer, _ = along_direction(Allocator(problem), command)
        assert answer.status in (
            AllocationStatus.OPTIMAL,
            AllocationStatus.AT_ROUNDING,
            AllocationStatus.DIRECTION_TURNED,
        )


def test_nothing_along_the_command_is_said():
    problem = AllocationProblem(np.eye(2), [0.5, 0.0], [1.0, 1.0])
    answer, share = along_direction(Allocator(problem), np.array([-1.0, 0.0]))
    assert answer.status is AllocationStatus.DIRECTION_LOST
    assert share == 0.0
    np.testing.assert_allclose(answer.forces, [0.5, 0.0], atol=1e-5)
    assert along_direction(Allocator(problem), np.zeros(2))[0].status is AllocationStatus.OPTIMAL  # no direction at all


def test_priorities_with_stuck_actuators_serve_the_important_axis():
    """An actuator stuck on both axes: the important axis is made good by the others, the other one is left."""
    A = np.array([[1.0, 1.0, 0.0], [1.0, 0.0, 0.1]])
    problem = AllocationProblem(A, [0.5, -1.0, -1.0], [0.5, 1.0, 1.0], accuracy_weight=1e6)
    scale = axis_scale([0, 1])
    answer = solve(by_priority(problem, [0, 1]), scale * np.array([0.2, -1.0]))
    assert answer.forces[1] == pytest.approx(-0.3, abs=1e-4)
    assert answer.forces[2] == pytest.approx(-1.0)


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


@pytest.mark.parametrize("count", [4, 6, 8])
def test_the_dead_band_costs_no_more_than_the_best_choice(count):
    """Against every pattern of on and off, each a bounded least-squares problem solved by scipy."""
    for seed in range(6 if count < 8 else 2):
        rng = np.random.default_rng(seed)
        A, h = rng.normal(size=(3, count)), 10.0 ** rng.uniform(1, 4)
        command = A @ np.where(rng.random(count) < 0.5, rng.uniform(0, 0.6, count), 0.0)
        problem = AllocationProblem(A, 0.0, 1.0, accuracy_weight=h, change_weight=0.0)
        answer = with_minimum_impulse(problem, command, 0.3, backend="online", accuracy="high")
        assert np.all((answer.forces == 0) | (answer.forces >= 0.3))
        best = h * command @ command
        for on in map(list, product((False, True), repeat=count)):
            some = np.array(on)
            if some.any():
                rows = np.vstack([np.sqrt(h) * A[:, some], np.eye(some.sum())])
                right = np.concatenate([np.sqrt(h) * command, np.zeros(some.sum())])
                found = lsq_linear(rows, right, (0.3, 1.0), method="bvls", tol=1e-13)
                best = min(best, 2 * found.cost)
        assert best * (1 - 1e-6) <= answer.objective <= best * (1 + WITHIN)


def test_dead_band_with_stuck_and_always_on_actuators():
    problem = AllocationProblem(np.eye(4), [0.1, 0.05, 0.0, 0.0], [0.1, 1.0, 0.0, 1.0], accuracy_weight=1e4)
    answer = with_minimum_impulse(problem, np.array([0.0, 0.0, 0.5, 0.2]), 0.3)
    np.testing.assert_allclose(answer.forces, [0.1, 0.3, 0.0, 0.3], atol=1e-6)  # 0.3 is nearer to 0.2 than 0


def test_thrusters_that_can_never_fire_are_named():
    problem = AllocationProblem(np.ones((1, 4)), [0, 0, 0, 0.25], [1.0, 0.2, 0.0, 1.0], max_step=[0.2, 1, 1, 0.2])
    assert never_fires(problem, 0.3).tolist() == [1, 2]


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
