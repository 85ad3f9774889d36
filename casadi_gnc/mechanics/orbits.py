"""Motion about the Earth: by differential equation, and in closed form.

==========  ==========================================================================
symbol      meaning
==========  ==========================================================================
r, v        position [m] and velocity [m/s] in an inertial frame, (3,) each
mu          gravitational parameter, [m^3/s^2]
R, J2       equatorial radius [m] and oblateness of the central body, -
a, e        semi-major axis [m], eccentricity
dE          eccentric anomaly passed since the epoch, [rad]
==========  ==========================================================================

    r'' = -mu r/norm(r)^3 + J2 term                            `gravity`

Closed form, two bodies (Battin, An Introduction to the Mathematics and Methods of Astrodynamics (1999), section
4.3, doi:10.2514/4.861543): with sigma = r0'v0/sqrt(mu), Kepler's equation between two places of one orbit is

    n t = dE + sigma/sqrt(a) (1 - cos dE) - (1 - norm(r0)/a) sin dE,

and r, v follow from r0, v0 by Lagrange's coefficients. Secular drift by J2 turns that orbit's plane and apsides at
their mean rates (Vallado, Fundamentals of Astrodynamics and Applications, section 9.6).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.errors import FlightError
from casadi_gnc.mathematics import exact
from casadi_gnc.mechanics.circular_orbit import EARTH_MU, EARTH_RADIUS

#: Oblateness of the Earth (EGM 96), -C20 times the square root of five.
EARTH_J2 = 1.0826266836e-3
#: Newton steps of Kepler's equation; from the start below, 6 leave less than 1e-13 rad up to an eccentricity of 0.9.
_STEPS = 6


def gravity(position: Any, *, mu: float = EARTH_MU, j2: float = 0.0, radius: float = EARTH_RADIUS) -> Any:
    """Return the acceleration by gravity, (3,), [m/s^2]; with `j2`, z is the axis of the central body."""
    square = ca.sumsqr(position)
    distance = ca.sqrt(square)
    centre = -mu / (square * distance) * position
    if exact.is_zero(j2):
        return centre
    high = 5 * position[2] * position[2] / square
    shape = ca.vertcat(1 - high, 1 - high, 3 - high) * position
    return centre - 1.5 * j2 * mu * radius**2 / (square * square * distance) * shape


@dataclass(frozen=True)
class Elements:
    """Describe an orbit by its shape, its plane and a place on it.

    Parameters
    ----------
    semi_major_axis : a, [m].
    eccentricity : e, 0 to below 1.
    inclination, node, perigee : [rad], of the plane, of its ascending node, of the perigee from the node.
    anomaly : true anomaly at t = 0, [rad].
    mu : [m^3/s^2].
    """

    semi_major_axis: float
    eccentricity: float = 0.0
    inclination: float = 0.0
    node: float = 0.0
    perigee: float = 0.0
    anomaly: float = 0.0
    mu: float = EARTH_MU

    def __post_init__(self) -> None:
        if not all(map(exact.is_number, (self.semi_major_axis, self.eccentricity))):
            return
        if not (self.semi_major_axis > 0 and math.isfinite(self.semi_major_axis)):
            raise FlightError(f"the semi-major axis is {self.semi_major_axis}, expected a positive number of metres")
        if not 0 <= self.eccentricity < 1:
            raise FlightError(f"the eccentricity is {self.eccentricity}, expected 0 to below 1: a closed orbit")

    @property
    def rate(self) -> float:
        """Mean motion n, [rad/s]."""
        a = self.semi_major_axis
        return exact.sqrt(self.mu / (a * a * a))

    @property
    def period(self) -> float:
        """Time of a revolution, [s]."""
        return 2 * math.pi / self.rate

    def state(self) -> tuple[ca.DM, ca.DM]:
        """Return r and v at t = 0, (3,) each, the same words on every machine."""
        e = self.eccentricity
        along, across = exact.cos_sin(self.anomaly)
        parameter = self.semi_major_axis * (1 - e * e)
        distance, speed = parameter / (1 + e * along), exact.sqrt(self.mu / parameter)
        turn = self._plane()
        place = exact.array([distance * along, distance * across, 0])
        return ca.mtimes(turn, place), ca.mtimes(turn, exact.array([-speed * across, speed * (e + along), 0]))

    def _plane(self) -> ca.DM:
        """Return the matrix, (3, 3), from perigee, its normal in the plane, and the plane's, to the inertial frame."""
        (cn, sn), (ci, si), (cw, sw) = (exact.cos_sin(each) for each in (self.node, self.inclination, self.perigee))
        return exact.array(
            [
                [cn * cw - sn * sw * ci, -cn * sw - sn * cw * ci, sn * si],
                [sn * cw + cn * sw * ci, -sn * sw + cn * cw * ci, -cn * si],
                [sw * si, cw * si, ci],
            ]
        )


@dataclass(frozen=True)
class Orbit:
    """Give position and velocity at any time, in closed form.

    Parameters
    ----------
    elements : at t = 0.
    j2 : oblateness whose mean drift of node, perigee and anomaly is followed; 0: two bodies, exactly.
    radius : equatorial radius of the central body, [m].
    """

    elements: Elements
    j2: float = 0.0
    radius: float = EARTH_RADIUS

    def drift(self) -> tuple[float, float, float]:
        """Return the mean rates by J2 of node, perigee and mean anomaly, [rad/s]."""
        of = self.elements
        e2, (cosine, sine) = of.eccentricity**2, exact.cos_sin(of.inclination)
        slow = 0.75 * of.rate * self.j2 * (self.radius / (of.semi_major_axis * (1 - e2))) ** 2
        node, perigee = -2 * slow * cosine, slow * (4 - 5 * sine * sine)
        return node, perigee, slow * exact.sqrt(1 - e2) * (2 - 3 * sine * sine)

    def at(self, t: Any) -> tuple[Any, Any]:
        """Return r and v, (3,) each, at a time [s]."""
        start, speed = self.elements.state()
        if self.j2 == 0:
            return two_bodies(start, speed, t, self.elements)
        node, perigee, anomaly = self.drift()
        position, velocity = two_bodies(start, speed, (1 + anomaly / self.elements.rate) * t, self.elements)
        # The perigee drifts about the orbit's normal, the node about the Earth's axis.
        plane = self.elements._plane()
        axes = ca.mtimes(_about_z(node * t), plane), ca.mtimes(_about_z(perigee * t), plane.T)
        turn = ca.mtimes(*axes)
        return ca.mtimes(turn, position), ca.mtimes(turn, velocity)


def _about_z(angle: Any) -> Any:
    c, s = ca.cos(angle), ca.sin(angle)
    return ca.vertcat(ca.horzcat(c, -s, 0), ca.horzcat(s, c, 0), ca.horzcat(0, 0, 1))


def two_bodies(position: Any, velocity: Any, t: Any, elements: Elements) -> tuple[Any, Any]:
    """Return r and v at a time t [s] after they were `position` and `velocity`, on an orbit of these elements."""
    a, mu, n = elements.semi_major_axis, elements.mu, elements.rate
    sigma = float(ca.dot(position, velocity)) / exact.sqrt(mu * a)
    first = exact.sqrt(float(ca.sumsqr(position)))
    shape = 1 - first / a
    # Whole revolutions are taken off, which float needs and Newton's start too.
    turns = ca.floor(n * t / (2 * math.pi) + 0.5)
    mean = n * t - 2 * math.pi * turns
    passed = mean + shape * ca.sin(mean) - sigma * (1 - ca.cos(mean))
    for _ in range(_STEPS):
        sine, versine = ca.sin(passed), 1 - ca.cos(passed)
        residual = passed + sigma * versine - shape * sine - mean
        passed = passed - residual / (1 + sigma * sine - shape * (1 - versine))
    sine, versine = ca.sin(passed), 1 - ca.cos(passed)
    distance = a * (1 + sigma * sine - shape * (1 - versine))
    f = 1 - a / first * versine
    g = (mean - passed + sine) / n
    f_rate = -exact.sqrt(mu * a) / (distance * first) * sine
    g_rate = 1 - a / distance * versine
    # g counts time, of which only what is left of whole revolutions moves anything.
    return f * position + g * velocity, f_rate * position + g_rate * velocity
