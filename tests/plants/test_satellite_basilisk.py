"""The same satellite in Basilisk and here: same start, same commands, the same Runge-Kutta step."""

import casadi as ca
import numpy as np
import pytest
from basilisk_satellite import fly as fly_there
from basilisk_satellite import torques_of_mrp_feedback

from casadi_gnc.allocation import PseudoInverse
from casadi_gnc.laws import advance
from casadi_gnc.laws.mrp_feedback import MrpFeedback
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
#: Two arrays, alike but for their springs, one along the hinge's frame, one turned by half a right angle about y.
ACROSS = 0.7071067811865476
CASES["wheels and thrusters with hinged panels"] = {
    "wheel": WHEELS,
    "thruster": THRUSTERS,
    "centre_of_mass_m": [0.1, -0.05, 0.2],
    "hinged_panel": [
        {
            "mass_kg": 30.0,
            "inertia_kg_m2": [[12.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 14.0]],
            "hinge_m": [0.0, 0.7, 0.2],
            "axis": [1.0, 0.0, 0.0],
            "centre_m": [0.0, 2.2, 0.2],
            "stiffness_N_m_per_rad": 30.0,
            "damping_N_m_s_per_rad": 0.4,
            "angle_deg": 4.0,
            "rate_deg_per_s": -0.5,
        },
        {
            "mass_kg": 25.0,
            "inertia_kg_m2": [[8.0, 0.0, 3.0], [0.0, 14.0, 0.0], [3.0, 0.0, 8.0]],
            "hinge_m": [0.1, -0.7, 0.1],
            "axis": [ACROSS, 0.0, ACROSS],
            "centre_m": [0.1, -1.9, 0.1],
            "stiffness_N_m_per_rad": 20.0,
            "angle_deg": -3.0,
        },
    ],
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
    if "hinged_panel" in keys:
        assert np.abs(here["panel_angle"] - there["panel_angle"]).max() < 1e-10
        assert np.ptp(here["panel_angle"], axis=0).min() > 0.02


def test_laws_command_the_same_torques():
    """mrpFeedback and rwMotorTorque, ours with the same gains: torque and motors' torques to 1e-12."""
    told = {
        "sigma_BR": [0.1, -0.2, 0.15],
        "omega_BR_B": [0.010, -0.020, 0.015],
        "omega_RN_B": [-0.02, -0.01, 0.005],
        "domega_RN_B": [2e-4, 3e-4, 1e-4],
    }
    craft = SatelliteCraft(**BODY, wheel=WHEELS)
    body, speeds, actuators = craft.belief(), [wheel["speed_rad_per_s"] for wheel in WHEELS], craft.actuators()
    steps, h = 5, 0.5
    law = MrpFeedback(
        body=body,
        hold=h,
        attitude_gain=0.1,
        rate_gain=1.5,
        integral_gain=0.01,
        integral_limit=20.0,
        compensation="reference",
    )
    rate = np.add(told["omega_BR_B"], told["omega_RN_B"])
    y = ca.DM([*told["sigma_BR"], *told["omega_BR_B"], *rate, *told["omega_RN_B"], *told["domega_RN_B"], *speeds])
    m = law.start(0.0, y)
    for _ in range(steps - 2):  # Basilisk takes no step of its integral before one that ends after t = 0 has begun
        m = ca.DM(advance(law, 0.0, y, m, ca.DM.zeros(3), ca.DM.zeros(3)))
    here = np.array(ca.DM(law.command(0.0, y, m))).ravel()
    motors = PseudoInverse().expression(
        ca.SX(here), ca.SX.zeros(4), ca.SX(actuators.lower), ca.SX(actuators.upper), actuators.matrix(None)
    )
    gains = {
        "K": 0.1,
        "P": 1.5,
        "Ki": 0.01,
        "integralLimit": 20.0,
        "controlLawType": 0,
    }
    spin, axes = [wheel["inertia_kg_m2"] for wheel in WHEELS], np.array(PYRAMID).T
    inertia = np.array(body.inertia)
    there, shared = torques_of_mrp_feedback(told, gains, inertia, axes, spin, speeds, steps, h)
    assert np.abs(here).max() < 1
    assert np.abs(here - there).max() < 1e-12
    assert np.abs(np.array(ca.DM(motors)).ravel() - shared).max() < 1e-12
