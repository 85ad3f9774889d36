"""The linear plant of a mission: its slopes by differences of the plant itself, its inputs by Newton's law."""

import numpy as np
import pytest

import casadi_gnc as gnc
from casadi_gnc.errors import FlightError
from casadi_gnc.missions.linear_plant import rows_of, target_state


@pytest.mark.slow
def test_the_plant_of_the_docking_pair_is_linearised_at_its_target():
    mission = gnc.load("shi2020/docking")
    found = mission.linearised("iobc")
    assert found.states == tuple(f"{name} {i}" for name in ("position", "velocity") for i in (1, 2, 3))
    assert found.efforts == ("force 1", "force 2", "force 3")
    np.testing.assert_array_equal(found.target, [0.7, 0.6, 0.8, 0, 0, 0])
    rows, x, rate = rows_of(mission), target_state(mission), mission.plant()
    still, h = np.zeros(rate.size1_in(2)), 1e-3
    columns = []
    for row in rows:
        step = h * np.eye(len(x))[row]
        ahead, behind = (np.array(rate(0.0, x + sign * step, still)).ravel()[rows] for sign in (1, -1))
        columns.append((ahead - behind) / (2 * h))
    np.testing.assert_allclose(found.A, np.array(columns).T, atol=1e-10)  # a cubic term of 1e-6 m^2 and 1e-13 / h
    reduced = 1 / 40.0 + 1 / 100.0  # of a chaser of 40 kg and a target of 100 kg
    np.testing.assert_allclose(found.B, np.vstack([np.zeros((3, 3)), reduced * np.eye(3)]), atol=1e-12)


@pytest.mark.slow
def test_a_mission_without_a_target_has_no_linear_plant():
    with pytest.raises(FlightError, match="detumble_bdot says no target at which its plant could be linearised"):
        gnc.load("satellites/detumble_bdot").linearised()
