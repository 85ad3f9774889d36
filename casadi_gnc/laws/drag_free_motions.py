"""The two motions of a satellite about its free-falling test mass, as adaptive backstepping takes them.

===============  ============================================  ==========================
symbol           meaning, resolved in the satellite's frame    name in the code
===============  ============================================  ==========================
sigma, omega     relative attitude MRPs and rate, (3,)         AttitudeMotion.error, .rate
r, v             relative position [m], velocity [m/s], (3,)   PositionMotion.error, .rate
u_t              rate of the orbiting frame, (3,), [rad/s]     orbital
omega_s          omega + u_t                                   spin
theta            (J11, J22, J33, J12, J13, J23), or m          estimate
g_d              difference of gravity, (3,), [m/s^2]          gravity
a, q2            target of the rate variable, its rate         target, target_rate
===============  ============================================  ==========================

    H theta = -u_t x J u_t - J q2 - a x J omega_s - u_t x J a - J (u_t x a)           (39), (40)
    H m = m (g_d - q2 - omega_s x a)                                                  (74), (75)

Source: Tao, Zhang (2019), section 2, doi:10.16356/j.1005-1120.2019.04.008.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.mechanics import attitude
from casadi_gnc.mechanics.circular_orbit import CircularOrbit
from casadi_gnc.mechanics.rigid_body import inverse3


@dataclass(frozen=True, eq=False)
class Satellite:
    """What the flight software believes of the satellite, and where estimates start.

    Parameters
    ----------
    mass : [kg].
    inertia : (3, 3), [kg m^2], symmetric positive definite.
    orbit : orbit of the test mass.
    """

    mass: Any
    inertia: Any
    orbit: CircularOrbit


def inertia_of(theta: Any) -> Any:
    """Return J, (3, 3), of (J11, J22, J33, J12, J13, J23)."""
    a, b, c, d, e, f = (theta[i] for i in range(6))
    return ca.vertcat(ca.horzcat(a, d, e), ca.horzcat(d, b, f), ca.horzcat(e, f, c))


def inertia_elements(inertia: Any) -> ca.DM:
    """Return (J11, J22, J33, J12, J13, J23) of J, (3, 3)."""
    j = ca.DM(inertia)
    return ca.vertcat(j[0, 0], j[1, 1], j[2, 2], j[0, 1], j[0, 2], j[1, 2])


@dataclass(frozen=True, eq=False)
class AttitudeMotion:
    """Relative attitude at one measurement (eqs 1 and 4)."""

    orbit: CircularOrbit
    error: Any
    rate: Any

    def rate_for(self, error_rate: Any) -> Any:
        """Return G^-1 error_rate."""
        return attitude.body_rate(self.error, error_rate)

    def transposed(self, vector: Any) -> Any:
        """Return G' vector."""
        return ca.mtimes(attitude.kinematic_matrix(self.error).T, vector)

    def inertia(self, estimate: Any) -> Any:
        """Return J."""
        return inertia_of(estimate)

    def divided(self, estimate: Any, effort: Any) -> Any:
        """Return J^-1 effort."""
        return ca.mtimes(inverse3(inertia_of(estimate)), effort)

    def feed_forward(self, estimate: Any, target: Any, target_rate: Any) -> Any:
        """Return H theta (eqs 39 and 40)."""
        inertia, orbital = inertia_of(estimate), self.orbit.rotation(self.error)
        turning = target_rate + ca.cross(orbital, target)
        carried = ca.cross(target, ca.mtimes(inertia, self.rate + orbital))
        return -ca.mtimes(inertia, turning) - carried - ca.cross(orbital, ca.mtimes(inertia, orbital + target))


@dataclass(frozen=True, eq=False)
class PositionMotion:
    """Relative position at one measurement (eqs 8 and 9); `spin` is omega_s."""

    error: Any
    rate: Any
    spin: Any
    gravity: Any

    def rate_for(self, error_rate: Any) -> Any:
        """Return error_rate + omega_s x r."""
        return error_rate + ca.cross(self.spin, self.error)

    def transposed(self, vector: Any) -> Any:
        """Return the vector."""
        return vector

    def inertia(self, estimate: Any) -> Any:
        """Return m."""
        return estimate

    def divided(self, estimate: Any, effort: Any) -> Any:
        """Return effort/m."""
        return effort / estimate

    def feed_forward(self, estimate: Any, target: Any, target_rate: Any) -> Any:
        """Return m theta_p (eqs 74 and 75)."""
        return estimate * (self.gravity - target_rate - ca.cross(self.spin, target))
