"""Truth: both craft as free bodies in the inertial frame, in 30 digits (tests/oracles/inertial_pair.py)."""

import casadi as ca
import inertial_pair as oracle
import mpmath
import numpy as np
import pytest

from casadi_gnc.laws.proximity_tracking import ProximityTracking
from casadi_gnc.mathematics.integrators import runge_kutta
from casadi_gnc.mechanics import attitude
from casadi_gnc.mechanics.disturbances import OrbitalDisturbance
from casadi_gnc.mechanics.proximity_motion import ProximityMotion
from casadi_gnc.mechanics.rigid_body import RigidBody
from casadi_gnc.status import StepStatus
from casadi_gnc.vehicles.proximity_pair.plant import ProximityPair, RelativeSensor

MASS, POINT, MU = 58.2, [0.0, 5.0, 0.0], 3.986e14
INERTIA = np.array([[598.3, -22.5, -51.5], [-22.5, 424.4, -27.0], [-51.5, -27.0, 263.6]])
TARGET_INERTIA = np.array([[3336.0, -135.4, -154.2], [-135.4, 3185.0, -148.5], [-154.2, -148.5, 2424.0]])
RELATIVE = np.array([50 / np.sqrt(2), 0, -50 / np.sqrt(2), 0.5, -0.6, 0.7, 0.5, -0.5, 0.5, 0.02, -0.02, 0.02])
#: Chaser's position and velocity: the paper's, which is a hyperbola, its millionth, and a low circular orbit.
ORBITS = {
    "1e8": (np.full(3, 7.078e8), np.array([2e3, 3e3, -2e3])),
    "1e6": (np.full(3, 7.078e6), np.array([2e3, 3e3, -2e3])),
    "low": (np.full(3, 7.078e6 / np.sqrt(3)), 7504.4 * np.array([1.0, 0.0, -1.0]) / np.sqrt(2)),
}
PUSH = (0.3, -0.2, 0.5, 0.06, 0.07, -0.04)


def pair(**changes) -> ProximityPair:
    motion = ProximityMotion(RigidBody(ca.DM(INERTIA)), MASS, POINT, MU)
    return ProximityPair(motion, ca.DM(TARGET_INERTIA), **changes)


def start(orbit: str, relative=RELATIVE, rate=(0.0, 0.0, 0.0)) -> np.ndarray:
    position, velocity = ORBITS[orbit]
    return np.concatenate([relative, position, velocity, rate])


def truth() -> oracle.Pair:
    return oracle.Pair.of(MASS, INERTIA, TARGET_INERTIA, POINT)


def stepper(plant: ProximityPair, h: float, steps: int) -> ca.Function:
    """Return `steps` Runge-Kutta steps of the plant, settled after each, under a held effort."""
    x, u = plant.state.symbol("x"), ca.SX.sym("u", 6)
    none = ca.DM.zeros(plant.noise.size)
    stepped = plant.settle(runge_kutta(lambda t, at: plant.rate(t, at, u, none), 0.0, x, h))
    return ca.Function("step", [x, u], [ca.cse(stepped)]).mapaccum(steps)


def furthest(plant: ProximityPair, x: np.ndarray, real: np.ndarray, bodies: oracle.Pair) -> dict[str, float]:
    """Return how far the relative state is from the inertial truth, the largest element of each part."""
    now, there = plant.state.split(ca.DM(x)), bodies.relative(real)
    parts = {name: getattr(now, name) for name in ("position_error", "velocity_error", "rate_error")}
    parts |= {"turn": attitude.dcm(now.attitude_error), "separation": plant.motion.separation(now)}
    return {
        name: float(abs(oracle.exactly(np.array(value)).reshape(there[name].shape) - there[name]).max())
        for name, value in parts.items()
    }


#: [m] that 60 s of rounding may do: thousands of steps, each of 1e-16 of 50 m, some 1e-12 in the end. The truth
#: truncates some 1e-12 m as well, at steps of half a second and 0.2 rad/s.
ROUNDING = 1e-11


@pytest.mark.parametrize("orbit", ORBITS)
def test_free_motion_is_that_of_two_bodies(orbit):
    """Runge-Kutta at 20 ms truncates some 1e-15 of a turn at 0.05 rad/s."""
    plant, bodies = pair(), truth()
    x = np.array(stepper(plant, 0.02, 3000)(start(orbit), ca.DM.zeros(6, 3000)))[:, -1]
    real = bodies.begin(RELATIVE, *ORBITS[orbit], np.zeros(3))
    for _ in range(60):
        real = bodies.step(real, 1, *oracle.exactly(np.zeros((2, 3))))
    off = furthest(plant, x, real, bodies)
    assert max(off.values()) < ROUNDING, off


@pytest.mark.parametrize("orbit", [pytest.param("1e8", marks=pytest.mark.slow), "1e6"])
def test_closed_loop_is_that_of_two_bodies(orbit):
    """The controller flies the relative equations; the efforts it gave move the two bodies to the same place."""
    plant, bodies = pair(disturbance=OrbitalDisturbance(constant=PUSH)), truth()
    believed = ProximityMotion(RigidBody(ca.DM(0.8 * INERTIA)), 0.8 * MASS, POINT, MU)
    gains = {"position_slope": 0.02, "attitude_slope": 0.15, "force_damping": 20.0, "torque_damping": 200.0}
    law = ProximityTracking(
        body=believed, observer_gain=0.0, compensator_gain=0.0, compensator_decay=0.2, switch_above=1.05, **gains
    )
    x, m = ca.DM(start(orbit)), None
    real, step = bodies.begin(RELATIVE, *ORBITS[orbit], np.zeros(3)), stepper(plant, 0.01, 100)
    for _ in range(60):
        y = plant.measure(0.0, x, ca.DM.zeros(0))
        m = law.jump(0.0, y, law.start(0.0, y) if m is None else m)
        effort = np.clip(np.array(law.command(0.0, y, m)).ravel(), *np.outer([-1, 1], [20, 20, 20, 10, 10, 10]))
        x = step(x, ca.DM(np.tile(effort[:, None], 100)))[:, -1]
        pushed = oracle.exactly(effort) + oracle.exactly(PUSH)
        for _ in range(2):
            real = bodies.step(real, mpmath.mpf(1) / 2, pushed[:3], pushed[3:])
    assert float(ca.norm_2(x[:3])) < 5.0, "the loop closed in"
    off = furthest(plant, np.array(x).ravel(), real, bodies)
    assert max(off.values()) < ROUNDING, off


def as_printed(x: np.ndarray) -> np.ndarray:
    """Return r_e', v_e' and omega_e' of eq. (10) as printed, with S(omega_e), in free motion."""
    re, se, ve, we, r, _, w = x.reshape(7, 3)
    turn, p = np.array(attitude.dcm(ca.DM(se))), np.array(POINT)
    wt = turn.T @ (w - we)
    spin_up = -np.linalg.solve(TARGET_INERTIA, np.cross(wt, TARGET_INERTIA @ wt))
    mu, mu_t = MU / np.linalg.norm(r) ** 3, MU / np.linalg.norm(r - re - turn @ p) ** 3
    g = np.cross(we, ve) + np.cross(we, np.cross(we, turn @ p)) + mu * r + mu_t * turn @ p - mu_t * (r - re)
    turned = np.linalg.solve(INERTIA, -np.cross(we, INERTIA @ we)) - np.cross(we, we) - turn @ spin_up
    return np.concatenate([ve - np.cross(we, re), turn @ np.cross(p, spin_up) - g, turned])


def test_rates_are_the_slopes_of_two_bodies_and_the_printed_ones_are_not(rng):
    """Central differences over 2 us in 30 digits truncate some 1e-13 of the motion's third derivative."""
    plant, bodies, h = pair(), truth(), mpmath.mpf("1e-6")
    zero, worst = oracle.exactly(np.zeros((2, 3))), np.zeros(3)
    for _ in range(5):
        relative, rate = RELATIVE * rng.uniform(0.5, 1.5, 12), rng.uniform(-0.1, 0.1, 3)
        x = start("1e6", relative, rate)
        real = bodies.begin(relative, *ORBITS["1e6"], rate)
        ahead, behind = (bodies.relative(bodies.step(real, side * h, *zero)) for side in (1, -1))
        names = ("position_error", "velocity_error", "rate_error")
        slope = np.array([((ahead[name] - behind[name]) / (2 * h)).astype(float) for name in names]).ravel()
        found = plant.state.split(plant.rate(0.0, ca.DM(x), ca.DM.zeros(6), ca.DM.zeros(0)))
        assert np.allclose(np.array(ca.vertcat(*(getattr(found, name) for name in names))).ravel(), slope, atol=1e-12)
        worst = np.maximum(worst, np.abs(as_printed(x) - slope).reshape(3, 3).max(axis=1))
    assert np.all(worst > [1.0, 2e-2, 1e-3]), worst


@pytest.mark.parametrize("distance", [1e-3, 1.0, 50.0, 1e4])
def test_gravity_keeps_its_digits_at_any_distance(rng, distance):
    """The difference of two pulls in 30 digits; its rounding in double is 4 units of the last place, 1e-15."""
    motion = pair().motion
    now = pair().state.split(ca.DM(start("low")))
    now.position_error = ca.DM(rng.normal(size=3) * distance) - motion.arm(now)
    apart, r = (oracle.exactly(np.array(v)).ravel() for v in (motion.separation(now), now.position))
    target = r - apart
    expected = MU * (r / mpmath.sqrt(r @ r) ** 3 - target / mpmath.sqrt(target @ target) ** 3)
    off = oracle.exactly(np.array(motion.gravity(now))).ravel() - expected
    assert mpmath.sqrt(off @ off) < 1e-15 * mpmath.sqrt(expected @ expected)


def test_constant_gravity_of_the_target_is_equation_2(rng):
    """mu_t = mu_g/r_o^3: the pulls near 8 m/s^2 subtracted in 30 digits."""
    radius = 7.0779e6
    motion = ProximityMotion(RigidBody(ca.DM(INERTIA)), MASS, POINT, MU, radius)
    now = pair().state.split(ca.DM(start("low")))
    apart, r = (oracle.exactly(np.array(v)).ravel() for v in (motion.separation(now), now.position))
    expected = MU * (r / mpmath.sqrt(r @ r) ** 3 - (r - apart) / mpmath.mpf(radius) ** 3)
    off = oracle.exactly(np.array(motion.gravity(now))).ravel() - expected
    # |r| carries a relative error of 1e-16 of its own, and its difference to r_o the whole of it.
    assert max(abs(off)) < 1e-15


def test_target_is_derived_from_the_relative_state():
    """The paper's target, derived by hand: its rate, and the radius of its orbit."""
    target = pair().target(ca.DM(start("1e8")))
    assert np.allclose(np.array(target.rate).ravel(), [-0.012562, 0.019637, -0.025624], atol=5e-7)
    assert float(ca.norm_2(target.position)) == pytest.approx(1.225946e9, rel=1e-6)
    bodies = truth()
    real = bodies.begin(RELATIVE, *ORBITS["1e8"], np.zeros(3))
    b = real[24:33].reshape(3, 3)
    assert np.allclose(np.array(target.velocity).ravel(), (b @ real[21:24]).astype(float), rtol=1e-12)


def test_disturbance_follows_the_orbit_and_the_noise():
    sine, cosine, deviation = [(a, 2 * a, 3 * a, a, a, a) for a in (0.2, 0.4, 0.5)]
    disturbance = OrbitalDisturbance(PUSH, sine, cosine, deviation)
    t, rate = 700.0, np.sqrt(MU / 7.078e6**3)
    expected = np.array(PUSH) + np.array(sine) * np.sin(rate * t) + np.array(cosine) * np.cos(rate * t)
    quiet, loud = pair(), pair(disturbance=disturbance)
    drawn = np.array([1.0, -2.0, 0.5, 0.3, -0.1, 2.0])
    x = ca.DM(start("low"))
    found = loud.rate(t, x, ca.DM.zeros(6), ca.DM(drawn))
    assert (loud.noise.size, quiet.noise.size) == (6, 0)
    same = quiet.rate(t, x, ca.DM(expected + np.array(deviation) * drawn), ca.DM.zeros(0))
    assert np.allclose(np.array(found), np.array(same), rtol=1e-12, atol=1e-15)


def test_sensor_noise_is_scaled_and_leaves_the_chaser_alone():
    plant = pair(sensor=RelativeSensor(position_error=1e-3, rate_error=1e-4))
    x = ca.DM(start("low"))
    assert plant.noise.names == ("position_error", "rate_error")
    off = np.array(plant.measure(0.0, x, ca.DM([1, -2, 3, -1, 1, 2])) - pair().measure(0.0, x, ca.DM.zeros(0))).ravel()
    expected = np.concatenate([[1e-3, -2e-3, 3e-3], np.zeros(6), [-1e-4, 1e-4, 2e-4], np.zeros(6)])
    assert np.allclose(off, expected, atol=1e-9)  # 1e-9 m is the last digit of 7000 km
    assert np.all(off[-6:] == 0)


def test_short_way_is_the_same_state():
    plant = pair()
    relative = RELATIVE.copy()
    relative[3:6] *= 1.5
    x = ca.DM(start("low", relative))
    short = plant.settle(x)
    assert float(ca.norm_2(plant.state.split(short).attitude_error)) == pytest.approx(1 / 1.5 / np.sqrt(1.1), rel=1e-12)
    slopes = [plant.rate(0.0, state, ca.DM.zeros(6), ca.DM.zeros(0)) for state in (x, short)]
    assert np.allclose(*(np.delete(np.array(slope).ravel(), [3, 4, 5]) for slope in slopes), atol=1e-14)
    for kept in (short, ca.DM(start("low"))):
        assert np.all(np.array(plant.settle(kept) == kept))


def test_keep_out_is_about_the_targets_centre():
    """At the hold point the centres are |p_t| apart, whatever the attitude."""
    relative = RELATIVE.copy()
    relative[:3] = 0
    x = ca.DM(start("low", relative))
    for radius, inside in ((4.999, 0), (5.001, 1)):
        plant = pair(keep_out_radius=radius)
        assert float(plant.show(0.0, x, ca.DM.zeros(6))["target_distance"]) == pytest.approx(5.0, rel=1e-14)
        assert float(plant.status(0.0, x, ca.DM.zeros(6))[StepStatus.KEEP_OUT_ENTERED]) == inside
