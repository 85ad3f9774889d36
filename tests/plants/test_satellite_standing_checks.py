"""Truths: the law by hand, u = -k sigma at rest, whose angle is 4 |sigma|; and flights."""

import numpy as np
import pytest

import casadi_gnc
from casadi_gnc.checking import check

GAIN, SPIN, COULOMB, VISCOUS = 4.0, 12.0 / 628.0, 1e-3, 5e-6
WHEELS = range(1, 5)
AXES = 0.577350 * np.array([[1, -1, -1, 1], [1, 1, -1, -1], [1, 1, 1, 1]])


def told(changes):
    """Return a mission, and what is said of its pointing."""
    mission = casadi_gnc.load("satellites/slew", {"initial.angle_deg": 1e-6, **changes})
    return mission, [one for one in check(mission) if one.name == "settling.pointing"]


def held(torque, stored):
    """Return the angle by hand, [deg], under a torque [N m] when wheels store a momentum [N m s], all far from rest."""
    speeds = np.linalg.pinv(SPIN * AXES) @ stored
    friction = AXES @ (COULOMB * np.tanh(speeds) + VISCOUS * speeds)
    return np.degrees(4 * np.linalg.norm(torque + friction) / GAIN)


def test_rest_without_a_torque_is_no_matter():
    assert told({"initial.angle_deg": 30.0})[1] == []


def test_a_constant_torque_and_the_friction_of_the_wheels_that_take_it_up():
    torque = np.array([0.003, -0.004, 0.012])
    _, (found,) = told({"environment.constant_torque_N_m": torque.tolist()})
    assert found.value == pytest.approx(held(torque, 300.0 * torque), rel=1e-6)
    assert found.verdict == "fail"


def test_wheels_that_hold_the_momentum_of_the_start():
    rate = np.array([0.0, 0.0, 0.4])
    _, (found,) = told({"initial.rate_deg_per_s": rate.tolist()})
    inertia = np.array([[85.0, 2.0, -1.5], [2.0, 110.0, 1.0], [-1.5, 1.0, 64.0]])
    assert found.value == pytest.approx(held(0.0, inertia @ np.radians(rate)), rel=1e-6)
    speeds = {f"wheel.{i}.speed_rad_per_s": 50.0 for i in WHEELS}
    _, (spinning,) = told(speeds)
    assert spinning.value == pytest.approx(held(0.0, SPIN * AXES @ np.full(4, 50.0)), rel=1e-6)


def test_a_torque_that_swings_is_a_warning():
    harmonic = [{"frequency_rad_per_s": 0.01, "amplitude_N_m": [0.02, 0.0, 0.0], "phase_rad": 1.5}]
    assert [one.verdict for one in told({"environment.harmonic": harmonic})[1]] == ["warn"]


#: Wheels that turn by turns, so that all of it turns nothing: friction slows them until they hold the momentum alone.
ALTERNATING = {f"wheel.{i}.speed_rad_per_s": 9.0 * (-1) ** i for i in WHEELS}


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes",
    [
        {"environment.constant_torque_N_m": [0.003, -0.004, 0.012]},
        {"initial.rate_deg_per_s": [0.5, -0.3, 0.4]},
        {"initial.rate_deg_per_s": [0.1, -0.06, 0.08], **ALTERNATING},
    ],
)
def test_flights_end_there(changes):
    mission, (found,) = told(changes)
    # The attitude follows what friction becomes 4 c/k = 18 s later.
    assert casadi_gnc.fly(mission)["pointing_error_deg"][-1].item() == pytest.approx(found.value, rel=0.02)
