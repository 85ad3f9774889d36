"""What coils are asked for where nothing else reaches every axis: against NumPy's pseudo-inverse and the formula."""

from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest

from casadi_gnc.checking import authority, geometry
from casadi_gnc.errors import GncError
from casadi_gnc.problem_files.loading import load
from casadi_gnc.vehicles.satellite.on_board import LeastByField, TorqueByField

RNG = np.random.default_rng(3)
FIELDS = RNG.normal(size=(20, 3)) * 3e-5


def commands(fixed, coils, field, torque):
    made = TorqueByField(ca.DM(fixed), ca.DM(coils))
    seen, u = SimpleNamespace(magnetic_field=ca.SX.sym("B", 3)), ca.SX.sym("u", 3)
    told = ca.Function("told", [seen.magnetic_field, u], [LeastByField(made)(seen, u)])
    effectiveness = np.hstack([fixed, np.cross(np.array(coils).T, field).T])
    return np.array(told(field, torque)).ravel(), effectiveness


@pytest.mark.parametrize("count", [2, 3, 4])
def test_coils_alone_get_the_least_dipoles(count):
    coils = np.linalg.qr(RNG.normal(size=(3, 3)))[0][:, :count] if count < 4 else RNG.normal(size=(3, count))
    for field in FIELDS:
        torque = RNG.normal(size=3) * 1e-5
        got, effectiveness = commands(np.zeros((3, 0)), coils, field, torque)
        best = np.linalg.pinv(effectiveness, rcond=1e-9) @ torque
        np.testing.assert_allclose(got, best, rtol=1e-9, atol=1e-12 * np.abs(best).max())


def test_three_coils_get_the_textbook_s_dipole_and_nothing_without_a_field():
    field, torque = FIELDS[0], np.array([1e-5, -2e-5, 5e-6])
    got, _ = commands(np.zeros((3, 0)), np.eye(3), field, torque)
    np.testing.assert_allclose(got, np.cross(field, torque) / (field @ field), rtol=1e-12)
    got, _ = commands(np.zeros((3, 0)), np.eye(3), np.zeros(3), torque)
    assert (got == 0.0).all()


def test_wheels_that_leave_an_axis_out_are_helped_by_coils():
    wheels = np.eye(3)[:, :2]
    field, torque = np.array([2e-5, 1e-5, -1e-5]), np.array([1e-3, -2e-3, 1e-5])
    got, effectiveness = commands(wheels, np.eye(3), field, torque)
    np.testing.assert_allclose(effectiveness @ got, torque, atol=1e-9)
    along = np.array([0.0, 0.0, 3e-5])  # now nothing reaches the third axis, and nothing runs away
    got, effectiveness = commands(wheels, np.eye(3), along, torque)
    np.testing.assert_allclose(effectiveness @ got, [1e-3, -2e-3, 0.0], atol=1e-9)
    assert np.abs(got).max() < 3e-3


def test_coils_along_one_axis_alone_are_refused(tmp_path):
    text = load("satellites/detumble_bdot").origin.text
    path = tmp_path / "one.toml"
    path.write_text(
        text.replace("axis = [0.0, 1.0, 0.0]", "axis = [1.0, 0.0, 0.0]").replace("[0.0, 0.0, 1.0]", "[-1, 0, 0]")
    )
    with pytest.raises(GncError, match="coils along one axis make torque about one direction alone; turn one"):
        load(str(path))


def test_checks_of_coils_alone_ask_for_no_further_actuator():
    # Each field leaves its own direction out, and any two together leave none: what is missing is made a moment later.
    made = [np.cross(np.eye(3), field).T for field in FIELDS[:2]]
    assert [np.linalg.matrix_rank(one) for one in (*made, np.hstack(made))] == [2, 2, 3]
    mission = load("satellites/detumble_bdot", strict=False)
    found = [each for checks in (geometry.checks, authority.checks) for each in checks(mission, mission.schemes[0])]
    told = {each.name: f"{each.consequence} {each.remedy}" for each in found if each.verdict == "note"}
    assert {"geometry.effectiveness", "geometry.conditioning", "authority.span"} <= set(told)
    for sentence in told.values():
        assert "first measurement" in sentence
        assert not any(advice in sentence for advice in ("Add ", "Turn ", "Shrink", "drifts off"))
