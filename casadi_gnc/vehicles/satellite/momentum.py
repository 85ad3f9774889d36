"""How torque is shared out where wheels do the work, coils take momentum away, and idle speeds are chosen.

==========  ==============================================================================================
symbol      meaning
==========  ==============================================================================================
tau         wanted torque on the body, (3,), [N m]
G, J_s, Om  axes of the wheels, (3, N), their inertias and speeds, (N,)
h           G J_s Om, (3,), [N m s]: what the wheels store
B           magnetic field in the body, (3,), [T]
m           dipole of the coils, (3,), [A m^2]
k, k_n      rates at which momentum is taken away, and at which wheels come to their own speeds, [1/s]
==========  ==============================================================================================

    m = -k B x h/|B|^2, each coil within its limit,          m x B = -k (h less its part along B)
    u = -G+ (tau - m x B) - k_n (I - G+ G) J_s (Om - Om_0)

The wheels make what is wanted less what the coils make, so that unloading turns nothing; motions of the wheels
that turn nothing bring them to the speeds Om_0, away from zero, where friction changes its sign. G+ = G'(G G')^-1.
Source: Camillo and Markley (1980), doi:10.2514/3.19725, for the law of the dipole.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.mathematics import bounds
from casadi_gnc.mathematics.linear import solve_symmetric
from casadi_gnc.mechanics.rigid_body import inverse3

from .on_board import WEAKEST


def right_inverse(matrix: Any) -> Any:
    """Return G'(G G')^-1 of a matrix of three rows."""
    return ca.mtimes(matrix.T, inverse3(ca.mtimes(matrix, matrix.T)))


@dataclass(frozen=True, eq=False)
class MomentumSharing:
    """Share a torque out among wheels and coils; a function of measured signals and torque.

    Parameters
    ----------
    axes, spin : of the wheels, (3, N) and (N,).
    coils, dipoles : axes of the coils, (3, K), and their largest dipoles; both empty where there are none.
    unload, null : k and k_n, [1/s].
    rest : Om_0, (N,), [rad/s].
    between, after : number of actuators between wheels and coils, and after these, which are not used.
    """

    axes: Any
    spin: Any
    coils: Any
    dipoles: Any
    unload: Any
    null: Any
    rest: Any
    between: int = 0
    after: int = 0

    def __call__(self, seen: Any, torque: Any) -> Any:
        """Return the commands of all actuators, (N + between + K + after,)."""
        inverse, stored = right_inverse(self.axes), self.spin * seen.wheel_speed
        dipoles, left = ca.SX(0, 1), torque
        if self.coils.shape[1]:
            dipoles = self._dipoles(seen.magnetic_field, ca.mtimes(self.axes, stored))
            left = torque - ca.cross(ca.mtimes(self.coils, dipoles), seen.magnetic_field)
        idle = self.spin * (seen.wheel_speed - self.rest)
        idle = idle - ca.mtimes(inverse, ca.mtimes(self.axes, idle))
        wheels = -ca.mtimes(inverse, left) - self.null * idle
        return ca.vertcat(wheels, ca.DM.zeros(self.between), dipoles, ca.DM.zeros(self.after))

    def _dipoles(self, field: Any, stored: Any) -> Any:
        """Return the dipoles of the coils, (K,), within their limits."""
        square = bounds.maximum(ca.sumsqr(field), WEAKEST)
        wanted = -self.unload / square * ca.cross(field, stored)
        if self.coils.shape[1] > 3:  # the least dipoles whose sum it is
            own = ca.mtimes(right_inverse(self.coils), wanted)
        else:  # what the coils come nearest to it with
            gram = ca.mtimes(self.coils.T, self.coils)
            own = solve_symmetric(gram, ca.mtimes(self.coils.T, wanted))
        return bounds.clip(own, -self.dipoles, self.dipoles)
