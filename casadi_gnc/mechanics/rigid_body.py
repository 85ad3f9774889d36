"""Rigid-body rotation, the one text that both the plant and the on-board model evaluate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.mathematics.exact import array, is_zero
from casadi_gnc.mechanics import attitude


def inverse3(matrix: Any) -> Any:
    """Invert a 3 x 3 matrix by cofactors: plain arithmetic, so constants fold deterministically."""
    m: Any = array(matrix)
    rows = [m[i, :].T for i in range(3)]
    columns = [ca.cross(rows[1], rows[2]), ca.cross(rows[2], rows[0]), ca.cross(rows[0], rows[1])]
    return ca.horzcat(*columns) / ca.dot(rows[0], columns[0])


@dataclass(frozen=True, eq=False)
class RigidBody:
    """Model a rigid body about its centre of mass, J w' = -w x J w + constant + gravity + torque.

    Huang, Biggs, Duan (2020), eqs (14)-(15). The truth is one instance, what the flight software
    believes another; a law asks its own instance for the part of w' that it knows.

    Parameters
    ----------
    inertia : J, (3, 3), [kg m^2], body frame, symmetric positive definite.
    constant_torque : u_t, (3,), [N m], body frame (an orbit-control engine beside the mass centre).
    orbit_rate : w_0, [rad/s]; 0 leaves the gravity gradient out.
    """

    inertia: Any
    constant_torque: Any = (0.0, 0.0, 0.0)
    orbit_rate: float = 0.0

    @property
    def inverse_inertia(self) -> Any:
        """J^-1, (3, 3), [1/(kg m^2)]."""
        return inverse3(self.inertia)

    def momentum(self, rate: Any) -> Any:
        """Return J w, (3,), [N m s], body frame."""
        return ca.mtimes(array(self.inertia), rate)

    def gravity_gradient(self, mrp: Any) -> Any:
        """Return u_g = 3 w_0^2 c x J c, (3,), [N m], with c the local vertical (eq. 15)."""
        vertical = attitude.reference_z(mrp)
        return 3 * self.orbit_rate**2 * ca.cross(vertical, self.momentum(vertical))

    def acceleration(self, mrp: Any, rate: Any, torque: Any = None) -> Any:
        """Return w', (3,), [rad/s^2], under an applied `torque` [N m] (none by default)."""
        total = array(self.constant_torque) - ca.cross(rate, self.momentum(rate))
        if not is_zero(self.orbit_rate):
            total = total + self.gravity_gradient(mrp)
        if torque is not None:
            total = total + torque
        return ca.mtimes(self.inverse_inertia, total)
