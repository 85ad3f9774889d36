"""Six-degree-of-freedom motion of a chaser relative to a point that a tumbling target carries.

The one text that both the plant and the on-board model evaluate.

============  ===============================================================  ==============================
symbol        meaning, resolved in the chaser's frame unless said otherwise    name in the code
============  ===============================================================  ==============================
r_e, v_e      position and inertial velocity from point P, (3,), [m], [m/s]    position_error, velocity_error
sigma_e, R    MRPs and matrix of the turn target frame -> chaser frame         attitude_error, attitude.dcm
omega_e       rate relative to the target, (3,), [rad/s]                       rate_error
r, omega      chaser's position from the Earth's centre [m], rate [rad/s]      position, rate
p_t           P from the target's centre of mass, target frame, (3,), [m]      hold_point
a             rate of the target, omega - omega_e                              target_rate
q             chaser from the target's centre, r_e + R p_t                     separation
mu, mu_t      mu_g/|r|^3 and mu_g/|r_t|^3, [1/s^2]                             pull
M             diag(m I, J)                                                     impulse
============  ===============================================================  ==============================

    r_e' = v_e - omega x r_e,   sigma_e' = G(sigma_e) omega_e
    v_e' = -[omega x v_e + a x (a x R p_t) + (mu - mu_t) r + mu_t q] + f/m + R (p_t x omega_t')
    omega_e' = J^-1 (-omega x J omega + tau) - omega x omega_e - R omega_t'

Source: Sun and Zheng (2018), eqs (7)-(11), doi:10.1109/TCST.2017.2669145, which print S(omega_e) for
S(omega) and S^2(omega_e) for S^2(omega - omega_e). The terms in omega_t' are the plant's business:
the chaser does not know the target's inertia.

Nothing here subtracts two absolute positions. With |r_t|^2 = |r|^2 (1 + k), the difference

    mu - mu_t = mu_t ((1 + k)^(3/2) - 1) = mu_t k (3 + 3 k + k^2)/(1 + (1 + k)^(3/2))

keeps all its digits however close the craft are (Battin 1999, An Introduction to the Mathematics and
Methods of Astrodynamics, section 8.4), in single precision too.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import casadi as ca

from casadi_gnc.mathematics.exact import array
from casadi_gnc.mechanics import attitude
from casadi_gnc.mechanics.rigid_body import RigidBody


@dataclass(frozen=True, eq=False)
class ProximityMotion:
    """Model the chaser's motion relative to point P.

    The truth is one instance, what the flight software believes another. Methods take the state
    `now` as a namespace with position_error, attitude_error, velocity_error, rate_error, position
    and rate.

    Parameters
    ----------
    body : the chaser's rotation, with J, (3, 3), [kg m^2], symmetric positive definite.
    mass : m, [kg].
    hold_point : p_t, (3,), [m], target frame.
    gravitational_parameter : mu_g, [m^3/s^2].
    target_orbit_radius : r_o, [m], of eq. (2), where mu_t is taken as constant; by default mu_t is
        that of the place where the target is.
    """

    body: RigidBody
    mass: Any
    hold_point: Any
    gravitational_parameter: float
    target_orbit_radius: Any = None

    @property
    def inertia(self) -> Any:
        """J, (3, 3), [kg m^2], of the chaser."""
        return self.body.inertia

    def target_rate(self, now: SimpleNamespace) -> Any:
        """Return a = R omega_t, (3,), [rad/s], the target's rate in the chaser's frame."""
        return now.rate - now.rate_error

    def arm(self, now: SimpleNamespace) -> Any:
        """Return R p_t, (3,), [m]: point P from the target's centre, in the chaser's frame."""
        return ca.mtimes(attitude.dcm(now.attitude_error), array(self.hold_point))

    def separation(self, now: SimpleNamespace) -> Any:
        """Return q = r_e + R p_t, (3,), [m]: the chaser from the target's centre."""
        return now.position_error + self.arm(now)

    def pull(self, position: Any) -> Any:
        """Return mu = mu_g/|r|^3, [1/s^2], the square of the rate of a circular orbit there."""
        squared = ca.sumsqr(position)
        return self.gravitational_parameter / (squared * ca.sqrt(squared))

    def gravity(self, now: SimpleNamespace) -> Any:
        """Return (mu - mu_t) r + mu_t q, (3,), [m/s^2]: pull on the target less that on the chaser."""
        apart, squared = self.separation(now), ca.sumsqr(now.position)
        if self.target_orbit_radius is None:
            k = ca.dot(apart, apart - 2 * now.position) / squared
        else:
            radius = ca.sqrt(squared)
            k = (self.target_orbit_radius - radius) * (self.target_orbit_radius + radius) / squared
        ratio = (1 + k) * ca.sqrt(1 + k)  # |r_t|^3/|r|^3
        grown = k * (3 + k * (3 + k)) / (1 + ratio)  # (mu - mu_t)/mu_t
        return self.pull(now.position) / ratio * (grown * now.position + apart)

    def error_rate(self, now: SimpleNamespace) -> Any:
        """Return r_e' and sigma_e', (6,), [m/s] and [1/s]: C_1 e_1 + C_2 e_2 of eq. (11)."""
        drift = now.velocity_error - ca.cross(now.rate, now.position_error)
        return ca.vertcat(drift, attitude.mrp_rate(now.attitude_error, now.rate_error))

    def acceleration(self, now: SimpleNamespace, effort: Any = None) -> Any:
        """Return v_e' and omega_e' without the terms in omega_t', (6,), [m/s^2] and [rad/s^2].

        `effort` is force [N] and torque [N m], (6,), none by default.
        """
        turning, given = self.target_rate(now), ca.DM.zeros(6) if effort is None else effort
        swing = ca.cross(turning, ca.cross(turning, self.arm(now)))
        linear = given[:3] / self.mass - ca.cross(now.rate, now.velocity_error) - swing - self.gravity(now)
        angular = self.body.acceleration(None, now.rate, given[3:]) - ca.cross(now.rate, now.rate_error)
        return ca.vertcat(linear, angular)

    def impulse(self, rates: Any) -> Any:
        """Return M e, (6,): mass times the first three, inertia times the others."""
        return ca.vertcat(self.mass * rates[:3], self.body.momentum(rates[3:]))
