"""Truth: both craft and the Earth as points in inertial space, integrated by scipy."""

import math

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from casadi_gnc.mathematics.integrators import runge_kutta
from casadi_gnc.mechanics import dipoles
from casadi_gnc.mechanics.dipoles import TargetDipole
from casadi_gnc.mechanics.disturbances import Harmonics
from casadi_gnc.mechanics.relative_motion import EllipticOrbit, PairModel
from casadi_gnc.vehicles.docking_pair.plant import DockingPair, FaultPiece, FaultProfile, MeasurementNoise

MU, A, E = 3.986e14, 1e7, 0.15
ORBIT = EllipticOrbit(A, E, MU)
MASS_C, MASS_T = 40.0, 100.0
TARGET = TargetDipole((-2.29e5, -8.17e5, -2.33e5))


def pair(**changes) -> DockingPair:
    return DockingPair(
        MASS_C, MASS_T, ORBIT, TARGET, PairModel(20.0, ORBIT.mean_rate), **{"actuator": "force", **changes}
    )


def flown(plant: DockingPair, start, force, duration: float, count: int) -> np.ndarray:
    t, x = ca.SX.sym("t"), plant.state.symbol("x")
    h = duration / count
    stepped = runge_kutta(lambda t, x: plant.rate(t, x, ca.DM(force), ca.SX(0, 1)), t, x, h)
    step = ca.Function("step", [x, t], [stepped])
    return np.array(step.mapaccum(count)(start, ca.DM(np.arange(count) * h).T))[:, -1]


def frame(radius: np.ndarray, velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the orbit frame's axes as rows, and its rate, from the inertial state of the centre of mass."""
    z = -radius / np.linalg.norm(radius)
    normal = np.cross(radius, velocity)
    y = -normal / np.linalg.norm(normal)
    return np.vstack([np.cross(y, z), y, z]), normal / (radius @ radius)


def inertial(start, force, duration: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Return relative state, chaser and target about their centre of mass, orbit frame, and the anomaly."""
    theta = start[6]
    p = A * (1 - E**2)
    radius = p / (1 + E * np.cos(theta)) * np.array([np.cos(theta), np.sin(theta), 0])
    speed = np.sqrt(MU / p) * np.array([-np.sin(theta), E + np.cos(theta), 0])
    axes, spin = frame(radius, speed)
    offset = axes.T @ start[:3]
    drift = axes.T @ start[3:6] + np.cross(spin, offset)
    share = MASS_T / (MASS_C + MASS_T)
    state = np.concatenate(
        [radius + share * offset, radius - (1 - share) * offset, speed + share * drift, speed - (1 - share) * drift]
    )

    def centre(s):
        return share * s[3:6] + (1 - share) * s[:3], share * s[9:12] + (1 - share) * s[6:9]

    def rate(_, s):
        push = frame(*centre(s))[0].T @ force
        pulls = [-MU * s[i : i + 3] / np.linalg.norm(s[i : i + 3]) ** 3 for i in (0, 3)]
        return np.concatenate([s[6:], pulls[0] + push / MASS_C, pulls[1] - push / MASS_T])

    s = solve_ivp(rate, (0, duration), state, method="DOP853", rtol=1e-13, atol=1e-7).y[:, -1]
    radius, speed = centre(s)
    axes, spin = frame(radius, speed)
    offset, drift = s[:3] - s[3:6], s[6:9] - s[9:12]
    relative = np.concatenate([axes @ offset, axes @ (drift - np.cross(spin, offset))])
    eccentric = np.cross(speed, np.cross(radius, speed)) / MU - radius / np.linalg.norm(radius)
    anomaly = np.arctan2(np.cross(eccentric, radius)[2], eccentric @ radius)
    return relative, axes @ (s[:3] - radius), axes @ (s[3:6] - radius), float(anomaly)


@pytest.mark.parametrize("force", [np.zeros(3), np.array([2e-4, -1e-4, 3e-4])])
def test_pair_is_two_points_about_the_earth(force):
    """600 s from anomaly 0.7: what linearised gravity leaves out, 3 g r^2/R t^2/2, is at most 4e-6 m at 10 m.

    Integration and the difference of large numbers leave some 1e-8 m.
    """
    start = np.array([4.0, 6.0, 8.0, 0.01, -0.005, 0.002, 0.7])
    truth, _, _, anomaly = inertial(start, force, 600.0)
    found = flown(pair(), start, force, 600.0, 600)
    assert np.abs(found[:3] - truth[:3]).max() < 4e-6
    assert np.abs(found[3:6] - truth[3:6]).max() < 2e-8
    assert found[6] == pytest.approx(anomaly, abs=1e-10)


def test_error_of_the_linearised_gravity_is_of_second_order():
    """Ten times the distance, a hundred times the error."""
    start = np.array([400.0, 600.0, 800.0, 0.0, 0.0, 0.0, 0.7])
    errors = []
    for scale in (1.0, 10.0):
        scaled = np.append(scale * start[:6], start[6])
        truth = inertial(scaled, np.zeros(3), 600.0)[0]
        errors.append(np.abs(flown(pair(), scaled, np.zeros(3), 600.0, 600)[:3] - truth[:3]).max())
    assert errors[1] / errors[0] == pytest.approx(100, rel=0.02)


def test_where_chaser_and_target_are():
    start = np.array([4.0, 6.0, 8.0, 0.01, -0.005, 0.002, 0.7])
    force = np.array([2e-4, -1e-4, 3e-4])
    _, chaser, target, _ = inertial(start, force, 600.0)
    shown = pair().show(600.0, ca.DM(flown(pair(), start, force, 600.0, 600)), ca.DM(force))
    # The centre of mass itself leaves its Kepler orbit by the same second-order terms.
    assert np.allclose(np.array(shown["chaser_position"]).ravel(), chaser, atol=1e-5)
    assert np.allclose(np.array(shown["target_position"]).ravel(), target, atol=1e-5)


def test_moment_and_force_are_one_actuator_seen_twice(rng):
    x = ca.DM([2.0, 3.0, 4.0, 0.1, 0.0, 0.0, 0.3])
    force = ca.DM(rng.normal(size=3))
    by_force = pair()
    moment = by_force.show(0.0, x, force)["moment"]
    by_moment = pair(actuator="moment")
    assert np.allclose(np.array(by_moment.show(0.0, x, moment)["force"]), np.array(force), rtol=1e-12)
    rates = [np.array(p.rate(0.0, x, told, ca.DM(0, 1))) for p, told in ((by_force, force), (by_moment, moment))]
    assert np.allclose(rates[0], rates[1], rtol=1e-12, atol=1e-15)
    expected = dipoles.torques(x[:3], moment, TARGET.at(x[:3]))
    for name, torque in zip(("chaser_torque", "target_torque"), expected, strict=True):
        assert np.array_equal(np.array(by_force.show(0.0, x, force)[name]), np.array(torque))


def test_lumped_disturbance_is_what_the_model_lacks():
    """Put into the model beside the force, it gives the true acceleration."""
    plant = pair(
        on_chaser=Harmonics((0.1, 0.15, 0.2), (0.3,), ((0.2, 0.0, -0.1),), (0.4,)),
        on_target=Harmonics((0.1, 0.2, 0.3), (0.3,), ((0.1, 0.0, 0.0),)),
        fault=FaultProfile((0.08, 0.09, 0.04), (FaultPiece(0.0, 5.0, 1.0),)),
    )
    x, force = ca.DM([2.0, 3.0, 4.0, 0.1, -0.2, 0.3, 0.4]), ca.DM([5.0, -3.0, 1.0])
    extra = plant.show(1.7, x, force)["lumped_disturbance"]
    believed = plant.model.acceleration(x[:3], x[3:6], force + extra)
    assert np.allclose(np.array(believed), np.array(plant.rate(1.7, x, force, ca.DM(0, 1))[3:6]), rtol=1e-13)


def test_outer_forces_act_on_each_craft_by_its_own_mass():
    """A force on the chaser alone accelerates the separation by force/m_C, one on the target by -force/m_T."""
    x = ca.DM([2.0, 3.0, 4.0, 0.1, -0.2, 0.3, 0.4])
    push = (0.3, -0.2, 0.1)
    free = np.array(pair().rate(0.0, x, ca.DM.zeros(3), ca.DM(0, 1)))[3:6].ravel()
    for name, expected in (("on_chaser", np.array(push) / MASS_C), ("on_target", -np.array(push) / MASS_T)):
        pushed = pair(**{name: Harmonics(constant=push)})
        found = np.array(pushed.rate(0.0, x, ca.DM.zeros(3), ca.DM(0, 1)))[3:6].ravel() - free
        assert np.allclose(found, expected, atol=1e-15)


def test_fault_profile_is_table_1():
    """Half-open pieces (start, stop], cosine by its phase, nothing after 15 s."""
    rate = 0.1 * math.pi
    pieces = (
        FaultPiece(2, 5, amplitude=1, rate=rate),
        FaultPiece(5, 10, constant=1),
        FaultPiece(10, 13, amplitude=1, rate=rate, phase=math.pi / 2),
    )
    fault = FaultProfile((0.08, 0.09, 0.04), pieces)
    shares = {0.0: 0, 2.0: 0, 2.1: math.sin(rate * 2.1), 5.0: 1, 5.1: 1, 10.0: 1, 10.1: math.cos(rate * 10.1)}
    shares |= {13.0: math.cos(rate * 13), 13.1: 0, 15.0: 0, 40.0: 0}
    for t, share in shares.items():
        assert np.allclose(np.array(fault.at(t)).ravel(), np.array([0.08, 0.09, 0.04]) * share, atol=1e-15), t


def test_measurement_has_its_errors():
    plant = pair(
        position_error=Harmonics(frequencies=(0.01 * math.pi,), amplitudes=((4e-4, 5e-4, 6e-4),)),
        velocity_error=Harmonics(frequencies=(0.01 * math.pi,), amplitudes=((2e-5, 2e-5, 2e-5),)),
        white=MeasurementNoise(1e-3, 2e-3),
    )
    x, drawn = ca.DM([2.0, 3.0, 4.0, 0.1, 0.2, 0.3, 0.4]), ca.DM([1.0, -1.0, 0.5, 2.0, 0.0, -1.0])
    found = np.array(plant.measure(50.0, x, drawn)).ravel()
    expected = np.array([2, 3, 4, 0.1, 0.2, 0.3]) + np.array([4e-4, 5e-4, 6e-4, 2e-5, 2e-5, 2e-5])
    expected += np.array([1e-3] * 3 + [2e-3] * 3) * np.array(drawn).ravel()
    assert np.allclose(found, expected, atol=1e-15)
    assert pair().noise.size == 0
