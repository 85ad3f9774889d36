"""Truth: momentum balance, the null space, and the bounds themselves."""

import numpy as np
import pytest

from casadi_gnc.allocation import solve
from casadi_gnc.allocation.wheels import at_speed, combine, wheel_problem
from casadi_gnc.errors import AllocationError, FlightError
from casadi_gnc.mechanics.reaction_wheels import WheelArray

PYRAMID = np.array([[1, 0, 0, 1 / np.sqrt(3)], [0, 1, 0, 1 / np.sqrt(3)], [0, 0, 1, 1 / np.sqrt(3)]])


@pytest.fixture
def wheels():
    return WheelArray(PYRAMID, inertia=0.01, max_acceleration=0.02 / 0.01, max_speed=300.0)


def test_torque_is_made_within_torque_limits(wheels, rng):
    problem = wheel_problem(wheels, accuracy_weight=1e12)
    assert np.allclose(problem.upper, 2.0)
    for _ in range(10):
        wanted = rng.uniform(-0.01, 0.01, 3)
        answer = solve(problem, wanted)
        assert np.allclose(-PYRAMID @ (0.01 * answer.forces), wanted, atol=1e-8)
        assert np.all(np.abs(answer.forces) * 0.01 <= 0.02 + 1e-15)


def test_no_wheel_passes_its_speed_limit(wheels):
    speed, period = np.array([299.95, -299.9, 0.0, 310.0]), 0.1
    problem = at_speed(wheels, wheel_problem(wheels), speed, period)
    answer = solve(problem, [0.02, -0.02, 0.02])
    after = speed + period * answer.forces
    assert np.all(np.abs(after[:3]) <= 300.0 + 1e-9)
    assert after[3] < 310.0  # beyond its limit a wheel may only slow down
    assert answer.forces[3] == pytest.approx(-2.0)


def test_desaturation_makes_no_torque_and_slows_the_null_space(wheels):
    """Speeds along the null space go down at the asked rate while the torque is what was commanded."""
    null = np.linalg.svd(PYRAMID)[2][-1]
    speed, rate = 200 * null, 0.005
    problem = at_speed(
        wheels, wheel_problem(wheels, accuracy_weight=1e12, change_weight=0.0), speed, 0.1, desaturation=rate
    )
    wanted = np.array([2e-3, 1e-3, -1e-3])
    answer = solve(problem, wanted)
    assert np.allclose(-PYRAMID @ (0.01 * answer.forces), wanted, atol=1e-8)
    assert null @ answer.forces == pytest.approx(-rate * 200, rel=1e-4)


def test_thrusters_and_wheels_share_a_command(wheels, rng):
    from casadi_gnc.problem_files.allocation_file import load_allocation

    thrusters = load_allocation("huang2020/allocation").problem
    both = combine(thrusters, wheel_problem(wheels, accuracy_weight=thrusters.accuracy_weight))
    assert both.count == 16
    assert both.errors.shape == (8, 3, 3)
    wanted = np.array([4e-3, -3e-3, 2e-3])  # beyond the thrusters, within the wheels
    answer = solve(both, wanted)
    alone = solve(thrusters, wanted)
    assert answer.status.is_certified
    # What is left is the price of wheel acceleration at this accuracy weight.
    assert np.linalg.norm(answer.unallocated) < 0.05 * np.linalg.norm(alone.unallocated)
    forces = rng.uniform(0, 1e-3, 16)
    apart = thrusters.vertices @ forces[:12] + wheel_problem(wheels).effectiveness @ forces[12:]
    assert np.allclose(both.vertices @ forces, apart, atol=1e-16)


def test_bad_wheels_are_told(wheels):
    with pytest.raises(AllocationError, match="expected 3 rows and columns of length 1"):
        wheel_problem(WheelArray(2 * PYRAMID, 0.01, 2.0, 300.0))
    with pytest.raises(AllocationError, match="no largest acceleration"):
        wheel_problem(WheelArray(PYRAMID, 0.01))
    with pytest.raises(FlightError, match="max_speed of the wheels is -1"):
        WheelArray(PYRAMID, 0.01, 2.0, -1)
    with pytest.raises(AllocationError, match=r"expected \(4,\)"):
        at_speed(wheels, wheel_problem(wheels), np.zeros(3), 0.1)
    with pytest.raises(AllocationError, match="same rows of effort"):
        combine(wheel_problem(wheels), wheel_problem(wheels, accuracy_weight=3.0))
