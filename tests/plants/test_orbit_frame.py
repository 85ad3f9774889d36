"""Erratum `orbit_frame_rate`: an attitude that counts from the orbit frame, and a frame that turns."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import casadi_gnc

RATE = 1.1e-3
TURNING = {"environment.corrected": ["orbit_frame_rate"]}
#: Both craft that have the erratum, without anything that pushes them but gravity.
BOTH = {
    "huang2020/slew": {"spacecraft.orbit_engine": None},
    "huang2019/fault_free": {"environment.orbit_rate_rad_per_s": RATE},
}


def flown(problem, inertia, mrp, rate, times, **changes):
    """Return the attitude at some times [s], by an integrator of scipy's, actuators at rest."""
    quiet = {
        "environment.constant_torque_N_m": [0.0] * 3,
        "environment.harmonic": [],
        "truth.inertia_kg_m2": inertia,
    }
    told = {**BOTH[problem], **quiet, "initial.mrp": mrp, "initial.rate_rad_per_s": rate, **changes}
    mission = casadi_gnc.load(problem, told, strict=False)
    plant, rest = mission.plant(), np.zeros(mission.truth.inputs.size)
    found = solve_ivp(
        lambda t, x: np.array(plant(t, x, rest)).ravel(),
        (0.0, times[-1]),
        mission.start,
        method="DOP853",
        t_eval=times,
        rtol=1e-11,
        atol=1e-14,
    )
    return found.y[:3].T


@pytest.mark.parametrize("problem", BOTH)
def test_what_stands_still_is_left_behind_by_the_frame(problem):
    """A sphere that does not turn: seen from the orbit frame it turns back about the orbit's normal by w0 t."""
    times = np.linspace(0.0, 2000.0, 5)
    ball = np.diag([2.0, 2.0, 2.0]).tolist()
    seen = flown(problem, ball, [0.0] * 3, [0.0] * 3, times, **TURNING)
    assert np.allclose(seen, np.outer(-np.tan(RATE * times / 4), [0, 1, 0]), atol=1e-9)
    assert np.array_equal(flown(problem, ball, [0.0] * 3, [0.0] * 3, times), np.zeros((5, 3)))


@pytest.mark.parametrize("problem", BOTH)
def test_gravity_makes_a_craft_swing_about_the_vertical(problem):
    """Pitch at w0 sqrt(3 (Jx - Jz)/Jy), from a small angle at which the craft turns with the orbit."""
    x, y, z, start = 3.0, 3.2, 1.2, 1e-3
    times = np.linspace(0.0, 2 * np.pi / RATE, 41)
    inertia = np.diag([x, y, z]).tolist()
    seen = flown(problem, inertia, [0.0, np.tan(start / 4), 0.0], [0.0, RATE, 0.0], times, **TURNING)
    pitch = start * np.cos(RATE * np.sqrt(3 * (x - z) / y) * times)
    assert np.allclose(4 * np.arctan(seen[:, 1]), pitch, atol=5e-6 * start)
    assert np.allclose(seen[:, ::2], 0.0, atol=1e-12)


def test_check_tells_the_angle():
    def told(problem, changes=None):
        mission = casadi_gnc.load(problem, changes or {}, strict=False)
        found = [
            each for each in mission.craft.checks(mission, mission.scheme()) if each.name == "geometry.orbit_frame"
        ]
        return [(each.verdict, round(np.degrees(each.value), 1)) for each in found]

    assert told("huang2020/slew") == [("note", 63.0)]
    assert told("huang2019/nominal") == [("ok", 0.5)]
    assert told("huang2020/slew", TURNING) == []
