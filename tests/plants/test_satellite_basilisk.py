"""The same satellite in Basilisk and here: same start, same commands, the same Runge-Kutta step."""

import casadi as ca
import numpy as np
import pytest
from basilisk_satellite import fly as fly_there

from casadi_gnc.mathematics.integrators import runge_kutta
from casadi_gnc.vehicles.satellite import SatelliteCraft

pytestmark = [pytest.mark.packages("Basilisk"), pytest.mark.slow]

#: Ten minutes at 10 Hz.
STEP, DURATION = 0.1, 600.0
BODY = {"mass_kg": 320.0, "inertia_kg_m2": [[85.0, 2.0, -1.5], [2.0, 110.0, 1.0], [-1.5, 1.0, 64.0]]}
PYRAMID = [[0.6, 0.0, 0.8], [0.0, 0.6, 0.8], [-0.6, 0.0, 0.8], [0.0, -0.6, 0.8]]
WHEELS = [
    {
        "axis": axis,
        "inertia_kg_m2": 0.03,
        "max_torque_N_m": 0.2,
        "viscous_N_m_s_per_rad": 2e-5,
        "coulomb_N_m": 1e-3,
        "coulomb_speed_rad_per_s": 0.1,
        "speed_rad_per_s": speed,
    }
    for axis, speed in zip(PYRAMID, (200.0, -150.0, 180.0, -220.0), strict=True)
]
START = {"mrp": [0.1, -0.2, 0.3], "rate_rad_per_s": [2e-3, -1e-3, 3e-3]}
THRUSTERS = [
    {"position_m": [1.0, 0.4, -0.3], "direction": [0.0, 0.6, 0.8], "max_force_N": 1.0},
    {"position_m": [-0.8, 0.2, 0.5], "direction": [1.0, 0.0, 0.0], "max_force_N": 1.0},
]
CASES = {
    "wheels in a circular orbit": {
        "wheel": WHEELS,
        "orbit": {"altitude_m": 500e3, "inclination_deg": 51.6},
    },
    "wheels in an elliptic orbit": {
        "wheel": WHEELS,
        "orbit": {"semi_major_axis_m": 12e6, "eccentricity": 0.4, "inclination_deg": 30.0, "anomaly_deg": 20.0},
        "centre_of_mass_m": [0.05, -0.02, 0.1],
    },
    "thrusters beside the centre of mass": {"thruster": THRUSTERS, "centre_of_mass_m": [0.1, -0.05, 0.2]},
    "wheels, thrusters and liquids": {
        "wheel": WHEELS,
        "thruster": THRUSTERS,
        "centre_of_mass_m": [0.1, -0.05, 0.2],
        "slosh": [
            {
                "mass_kg": 20.0,
                "position_m": [0.2, 0.3, -0.4],
                "axis": [1.0, 0.0, 0.0],
                "frequency_Hz": 0.1,
                "damping": 0.02,
                "offset_m": 0.05,
            },
            {
                "mass_kg": 15.0,
                "position_m": [-0.2, 0.1, 0.5],
                "axis": [0.0, 0.6, 0.8],
                "frequency_Hz": 0.07,
                "damping": 0.0,
                "offset_m": -0.03,
            },
        ],
    },
}
TOLD = {"wheel_torque": [4e-3, -2e-3, 3e-3, -5e-3], "force": [0.01, 0.005]}


def fly_here(craft: SatelliteCraft, h: float, duration: float) -> dict[str, np.ndarray]:
    plant = craft.plant()
    x, t = plant.state.symbol("x"), ca.SX.sym("t")
    told = ca.vertcat(*(ca.DM(TOLD[name]) for name in plant.inputs.names))
    after = plant.settle(runge_kutta(lambda at, x: plant.rate(at, x, told, ca.DM(0, 1)), t, x, h))
    step = ca.Function("step", [x, t], [after])
    start = ca.vertcat(*(ca.DM(craft.start()[name]) for name in plant.state.names))
    count = round(duration / h)
    states = np.array(step.mapaccum(count)(start, h * np.arange(count)[None, :])).T
    return plant.state.columns(np.vstack([np.array(start).T, states]))


@pytest.mark.parametrize("name", CASES)
def test_flights_agree(name):
    """To 1e-10 all along: MRPs and rates, speeds of 200 rad/s relative; the same equations to rounding."""
    keys = {**BODY, **CASES[name]}
    craft = SatelliteCraft(**keys, initial=START)
    here = fly_here(craft, STEP, DURATION)
    there = fly_there(keys, craft.start(), h=STEP, duration=DURATION, told=TOLD)
    assert np.abs(here["mrp"] - there["mrp"]).max() < 1e-10
    assert np.abs(here["rate"] - there["rate"]).max() < 1e-10
    assert np.abs(here["rate"][-1] - here["rate"][0]).max() > 1e-3  # it moved
    if "wheel" in keys:
        assert np.abs(here["wheel_speed"] - there["wheel_speed"]).max() < 1e-10 * 200
        assert np.abs(here["wheel_speed"][-1] - here["wheel_speed"][0]).min() > 1
    if "slosh" in keys:
        assert np.abs(here["slosh"][-1] - there["slosh"]).max() < 1e-10
