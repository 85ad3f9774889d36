"""Truth: scipy's integrator of order 8, constants of motion, Vallado's worked example, closed forms of geometry."""

import math

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from casadi_gnc.errors import FlightError
from casadi_gnc.mechanics.orbits import EARTH_J2, EARTH_MU, EARTH_RADIUS, Elements, Orbit, gravity


def dense(value) -> np.ndarray:
    return np.array(ca.DM(value)).ravel()


def flown(elements: Elements, until: float, j2: float = 0.0, count: int = 20) -> tuple[np.ndarray, np.ndarray]:
    r = ca.SX.sym("r", 3)
    pull = ca.Function("pull", [r], [gravity(r, j2=j2)])
    start = np.concatenate([dense(each) for each in elements.state()])
    times = np.linspace(0, until, count)
    solved = solve_ivp(
        lambda t, x: np.r_[x[3:], dense(pull(x[:3]))], (0, until), start, "DOP853", times, rtol=1e-12, atol=1e-5
    )
    return times, solved.y


@pytest.mark.parametrize("eccentricity", [0.0, 1e-9, 0.01, 0.3, 0.7, 0.9])
def test_closed_form_is_the_integral(eccentricity):
    """Over 2.3 revolutions; what differs is the integrator's tolerance, 1e-12 of the way."""
    elements = Elements(9e6 / (1 - eccentricity), eccentricity, 0.9, 1.1, 0.4, 0.7)
    t = ca.SX.sym("t")
    position, velocity = Orbit(elements).at(t)
    closed = ca.Function("closed", [t], [position, velocity, ca.jacobian(position, t), ca.jacobian(velocity, t)])
    times, states = flown(elements, 2.3 * elements.period)
    for time, state in zip(times, states.T, strict=True):
        r, v, moving, falling = (dense(each) for each in closed(time))
        assert np.linalg.norm(r - state[:3]) < 1e-8 * elements.semi_major_axis
        assert np.linalg.norm(moving - v) < 1e-11 * np.linalg.norm(v)
        assert np.allclose(falling, dense(gravity(ca.DM(r))), atol=1e-10)
        energy = v @ v / 2 - EARTH_MU / np.linalg.norm(r)
        assert energy == pytest.approx(-EARTH_MU / (2 * elements.semi_major_axis), rel=1e-12)


def test_the_state_of_known_elements():
    """Vallado, Fundamentals of Astrodynamics and Applications, example 2-6, whose mu is 398600.4418 km^3/s^2."""
    e, parameter = 0.83285, 11067.790e3
    degrees = math.radians
    of = Elements(parameter / (1 - e * e), e, degrees(87.87), degrees(227.89), degrees(53.38), degrees(92.335))
    position, velocity = of.state()
    assert np.allclose(dense(position) / 1e3, [6525.344, 6861.535, 6449.125], atol=0.05)
    assert np.allclose(dense(velocity) / 1e3, [4.902276, 5.533124, -1.975709], atol=1e-5)


def test_oblate_gravity_is_the_slope_of_its_potential():
    r = ca.SX.sym("r", 3)
    distance = ca.norm_2(r)
    legendre = (3 * (r[2] / distance) ** 2 - 1) / 2
    potential = EARTH_MU / distance * (1 - EARTH_J2 * (EARTH_RADIUS / distance) ** 2 * legendre)
    both = ca.Function("both", [r], [ca.gradient(potential, r), gravity(r, j2=EARTH_J2)])
    for place in ([7e6, 0, 0], [3e6, -5e6, 4e6], [0, 1.0, 8e6]):
        slope, pull = (dense(each) for each in both(place))
        assert np.allclose(slope, pull, rtol=1e-13, atol=1e-15)


def test_mean_drift_follows_the_oblate_orbit():
    """Ten revolutions: short-period terms of J2, some km, stay; the drift, ten times as much, is followed.

    A sun-synchronous orbit turns its plane once a year.
    """
    elements = Elements(7078e3, 0.001, math.radians(98.19), 0.3, 0.2, 0.1)
    drifting, fixed = Orbit(elements, EARTH_J2), Orbit(elements)
    assert math.degrees(drifting.drift()[0]) * 86400 == pytest.approx(360 / 365.2422, rel=2e-3)
    times, states = flown(elements, 10 * elements.period, EARTH_J2)
    normals = np.cross(states[:3].T, states[3:].T)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    for orbit, worst in ((drifting, 2e-4), (fixed, 1.2e-2)):
        r, v = (dense(each) for each in orbit.at(times[-1]))
        normal = np.cross(r, v) / np.linalg.norm(np.cross(r, v))
        apart = np.arccos(min(1.0, normal @ normals[-1]))
        assert apart < worst
    assert apart > 20 * 2e-4


@pytest.mark.parametrize(("axis", "eccentricity", "told"), [(-1.0, 0.0, "semi-major"), (7e6, 1.0, "0 to below 1")])
def test_no_orbit(axis, eccentricity, told):
    with pytest.raises(FlightError, match=told):
        Elements(axis, eccentricity)
