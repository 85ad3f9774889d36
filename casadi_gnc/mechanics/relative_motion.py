"""Motion of two close masses about each other on an orbit, in the orbit frame.

==========  ==========================================================================
symbol      meaning
==========  ==========================================================================
eta         position [m] and velocity [m/s] of one mass seen from the other, orbit frame
theta       true anomaly of the orbit, [rad]; omega = theta', [rad/s]
a, e, mu    semi-major axis [m], eccentricity [-], gravitational parameter [m^3/s^2]
g           mu/R^3 at the orbit's radius R, [1/s^2]; omega^2/(1 + e cos theta)
m0          mass that the pair is taken to have, [kg]
==========  ==========================================================================

Orbit frame: origin on the orbit, z to the centre, x along the flight across z, y opposite to the
orbit normal. With gravity linearised about the orbit the acceleration of the relative position is

    x'' =  (omega^2 - g) x + omega' z + 2 omega z'
    y'' = -g y                                                                          (5)
    z'' =  (omega^2 + 2 g) z - omega' x - 2 omega x'

plus force over reduced mass. A circular orbit has omega' = 0 and g = omega^2. What is left out is
of the size 3 g r^2/R: 6e-12 m/s^2 for 5 m at 8500 km.

Source: Shi, Liu, Biggs, Sun, Yue (2020), eqs (3), (5), doi:10.1016/j.ast.2020.105759.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import casadi as ca

from casadi_gnc.mathematics import exact


@dataclass(frozen=True)
class EllipticOrbit:
    """Describe a Kepler orbit.

    Parameters
    ----------
    semi_major_axis : a, [m].
    eccentricity : e, [0, 1).
    mu : gravitational parameter, [m^3/s^2].
    """

    semi_major_axis: float
    eccentricity: float
    mu: float

    @property
    def mean_rate(self) -> float:
        """Return sqrt(mu/a^3), [rad/s]."""
        a = self.semi_major_axis
        return exact.sqrt(self.mu / (a * a * a))

    def rate(self, anomaly: Any) -> Any:
        """Return omega = theta', [rad/s] (eq. 3)."""
        e = self.eccentricity
        near = 1 + e * ca.cos(anomaly)
        return near * near * (self.mean_rate / ((1 - e * e) * exact.sqrt(1 - e * e)))

    def acceleration(self, anomaly: Any, position: Any, velocity: Any) -> Any:
        """Return the relative acceleration without forces, (3,), [m/s^2], orbit frame (eq. 5)."""
        e, rate = self.eccentricity, self.rate(anomaly)
        near = 1 + e * ca.cos(anomaly)
        turning = -2 * e * ca.sin(anomaly) * rate * rate / near
        return coasting(position, velocity, rate, turning, rate * rate / near)


def coasting(position: Any, velocity: Any, rate: Any, rate_change: Any, gravity: Any) -> Any:
    """Return the right side of (5) without forces, (3,), [m/s^2], from omega, omega' and g."""
    x, y, z = (position[i] for i in range(3))
    square = rate * rate
    return ca.vertcat(
        (square - gravity) * x + rate_change * z + 2 * rate * velocity[2],
        -gravity * y,
        (square + 2 * gravity) * z - rate_change * x - 2 * rate * velocity[0],
    )


@dataclass(frozen=True, eq=False)
class PairModel:
    """Model a pair on a circular orbit: what flight software believes of it (A and B of eq. 9).

    Parameters
    ----------
    mass : m0 in the place of the reduced mass m_C m_T/(m_C + m_T), [kg].
    orbit_rate : omega_0, [rad/s].
    port : where the first mass shall come to rest, (3,), [m], orbit frame.
    flown : the true reduced mass where it is known, [kg], for checks before a flight only.
    """

    mass: Any
    orbit_rate: Any
    port: tuple[float, float, float] = (0.0, 0.0, 0.0)
    flown: float | None = None

    @property
    def truth(self) -> PairModel:
        """The same pair with the mass that is flown."""
        return self if self.flown is None else replace(self, mass=self.flown)

    def acceleration(self, position: Any, velocity: Any, force: Any = None) -> Any:
        """Return the relative acceleration, (3,), [m/s^2], under a force [N] on the first mass."""
        free = coasting(position, velocity, self.orbit_rate, 0.0, self.orbit_rate * self.orbit_rate)
        return free if force is None else free + force / self.mass

    def rate(self, eta: Any, force: Any = None) -> Any:
        """Return eta', (6,): velocity [m/s] over acceleration [m/s^2]."""
        return ca.vertcat(eta[3:6], self.acceleration(eta[:3], eta[3:6], force))

    def ahead(self, position: Any) -> Any:
        """Return the way from a position to the port, (3,), [m]."""
        return exact.array(self.port) - position

    def holding(self) -> Any:
        """Return the force, (3,), [N], that keeps the first mass at rest at the port."""
        return -self.mass * self.acceleration(exact.array(self.port), ca.DM.zeros(3))
