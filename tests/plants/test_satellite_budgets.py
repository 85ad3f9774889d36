"""Truth: linear programs, constant torques, and the geometry of fields that stand."""

import math

import numpy as np
import pytest
from scipy.optimize import linprog

import casadi_gnc
from casadi_gnc.vehicles.satellite import SatelliteCraft, budgets, turn_checks
from casadi_gnc.vehicles.satellite.reference_tables import TableTable

BODY = {"mass_kg": 90.0, "inertia_kg_m2": np.diag([9.0, 11.0, 7.0]).tolist()}
WHEELS = [
    {"axis": axis, "max_torque_N_m": 0.02, "max_momentum_N_m_s": 0.8, "max_speed_rad_per_s": 600.0}
    for axis in np.eye(3).tolist()
]
ORBIT = {"altitude_m": 550e3, "inclination_deg": 60.0}


def test_wheels_reach_what_a_linear_program_says(rng):
    for count in (3, 4, 6):
        axes = rng.standard_normal((3, count))
        axes /= np.linalg.norm(axes, axis=0)
        most, worst = rng.uniform(0.5, 2.0, count), math.inf
        for _ in range(30):
            direction = rng.standard_normal(3)
            direction /= np.linalg.norm(direction)
            found = linprog(
                np.r_[-1.0, np.zeros(count)],
                A_eq=np.hstack([-direction[:, None], axes]),
                b_eq=np.zeros(3),
                bounds=[(0, None), *((-each, each) for each in most)],
            )
            assert budgets.reach(axes, most, direction) == pytest.approx(-found.fun, rel=1e-9)
            worst = min(worst, -found.fun)
        assert budgets.reach(axes, most) <= worst * (1 + 1e-12)


def test_a_constant_torque_fills_the_wheels_where_the_body_stands():
    """T times the period in inertial axes; on nadir, a torque about x turns with the orbit: at most 2 T/n, and back."""
    torque = [2e-5, 0.0, 0.0]
    still = {"gravity_gradient": False, "constant_torque_N_m": torque}
    craft = SatelliteCraft(**BODY, wheel=WHEELS, orbit=ORBIT, environment=still)
    times, stored = budgets.disturbance_over_orbit(craft)
    assert np.allclose(stored[-1], np.multiply(torque, times[-1]), rtol=1e-12)
    turning = SatelliteCraft(**BODY, wheel=WHEELS, orbit=ORBIT, environment=still, reference=[{"kind": "nadir"}])
    times, stored = budgets.disturbance_over_orbit(turning)
    largest = np.linalg.norm(stored, axis=1).max()
    assert largest == pytest.approx(2 * torque[0] * times[-1] / (2 * math.pi), rel=1e-3)
    assert np.linalg.norm(stored[-1]) < 1e-6 * largest


def test_a_turn_is_weighed_and_its_jump_is_told():
    """About z: J a and J w of the quintic by hand; a turn of which one side passes the other's opposite jumps."""
    last = {"axis": [0.0, 0.0, 1.0], "angle_deg": 90.0}
    references = [{"kind": "inertial"}, {"kind": "inertial", "from_s": 10.0, "turn_s": 50.0, **last}]
    found = {each.name: each for each in turn_checks.checks(SatelliteCraft(**BODY, wheel=WHEELS, reference=references))}
    about_z = 7.0 - 0.8 / 600.0  # without the wheel, which turns against it
    fastest, hardest = 15 / 8 * math.pi / 2 / 50, 10 / math.sqrt(3) * math.pi / 2 / 50**2
    assert found["authority.turn_2_momentum"].value == pytest.approx(about_z * fastest, rel=1e-6)
    assert found["authority.turn_2_torque"].value == pytest.approx(about_z * hardest, rel=3e-3)  # points, differences
    assert found["authority.turn_2_torque"].limit == pytest.approx(0.02)
    assert found["geometry.turn_2_jump"].verdict == "ok"
    passing = {"kind": "slew", "rate_limit_deg_per_s": 1.0, "acceleration_limit_deg_per_s2": 1.0}
    passing |= {
        "first": {"axis": [0.0, 0.0, 1.0], "angle_deg": 170.0},
        "last": {"axis": [0, 0, 1.0], "angle_deg": 220.0},
    }
    jumps = SatelliteCraft(**BODY, wheel=WHEELS, reference=[references[0], {**passing, "from_s": 10.0, "turn_s": 50.0}])
    assert {each.name: each.verdict for each in turn_checks.checks(jumps)}["geometry.turn_2_jump"] == "fail"


def test_slews_and_coils_are_weighed():
    """The shipped turn that is too fast is told; J a and J w of a turn about z are what the check weighs."""
    found = {each.name: each for each in casadi_gnc.check("satellites/safe_mode")}
    assert found["authority.slew_3_torque"].verdict == "warn"
    assert found["authority.slew_3_momentum"].verdict == "ok"
    coils = {each.name: each for each in casadi_gnc.check("satellites/detumble_bdot")}
    assert coils["authority.dipole_over_orbit"].verdict == "ok"
    assert not [each for each in coils.values() if each.verdict == "fail"]
    over_the_equator = casadi_gnc.load(
        "satellites/detumble_bdot", {"orbit.inclination_deg": 0.0, "field.model": "dipole", "field.degree": 1}
    )
    weak = {each.name: each for each in casadi_gnc.check(over_the_equator)}["authority.dipole_over_orbit"]
    assert weak.verdict == "warn"


def test_a_table_that_ends_early_is_told():
    """The slew's file with a table in its place: 300 s are flown."""
    rows = [[math.cos(0.1 * i), 0.0, math.sin(0.1 * i), 0.0] for i in range(3)]
    for end, verdict in ((200.0, "fail"), (300.0, "ok")):
        table = {"kind": "table", "times_s": [0.0, 100.0, end], "quaternions_scalar_first": rows}
        mission = casadi_gnc.load("satellites/slew")
        craft = mission.craft.model_copy(update={"reference": [TableTable(**table)]})
        (found,) = [each for each in budgets.checks(craft, mission) if each.name == "geometry.reference_1_end"]
        assert found.verdict == verdict
