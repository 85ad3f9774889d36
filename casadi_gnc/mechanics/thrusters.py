"""Where thrusters push, seen from the chaser and, after a capture, from the combined body.

========  ==========================================================================
symbol    meaning
========  ==========================================================================
R         rotation chaser frame -> combined frame (`rotation`), orthonormal
r_c       centre of mass of the combined body from the chaser's, chaser frame, [m]
d_i, e_i  position from the centre of mass [m] and direction [-], combined frame
A         effectiveness, 3 x N: column i is d_i x e_i, torque per force, [m]
E         net-force map, 3 x N: column i is e_i
========  ==========================================================================

Source: Huang, Biggs, Duan (2020), eqs (4)-(13) and (57)-(61), doi:10.1016/j.ast.2019.105572.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import casadi as ca
import numpy as np

from casadi_gnc.mathematics.exact import array


@dataclass(frozen=True, eq=False)
class ThrusterGeometry:
    """Hold N thrusters on a body; arithmetic is CasADi's scalar one, so constants are portable.

    Parameters
    ----------
    positions : (3, N), [m], from the centre of mass, body frame.
    directions : (3, N), unit vectors, body frame.
    """

    positions: ca.DM
    directions: ca.DM

    @classmethod
    def from_rows(cls, positions: list[list[float]], directions: list[list[float]]) -> ThrusterGeometry:
        """Build from N rows of three numbers, as a problem file lists them."""
        return cls(array(positions).T, array(directions).T)

    @property
    def count(self) -> int:
        """N."""
        return self.positions.shape[1]

    def seen_from(self, rotation: ca.DM, centre_of_mass: list[float]) -> ThrusterGeometry:
        """Return d = R (d_s - r_c) and e = R e_s (eqs 8-9)."""
        shift = ca.repmat(array(centre_of_mass), 1, self.count)
        return ThrusterGeometry(ca.mtimes(rotation, self.positions - shift), ca.mtimes(rotation, self.directions))

    @property
    def effectiveness(self) -> ca.DM:
        """A, 3 x N, [m]: torque = A F (eqs 10-13)."""
        columns = [ca.cross(self.positions[:, i], self.directions[:, i]) for i in range(self.count)]
        return ca.horzcat(*columns)


def corner_errors(rotation: ca.DM, lower: list[float], upper: list[float]) -> np.ndarray:
    """Return D, (8, 3, 3), [m]: at corner v of the box of centre-of-mass errors, dA F = D_v E F.

    A centre of mass that lies dr further along the chaser's axes moves every thruster by -R dr, so
    dA F = -(R dr) x (net force) and D_v = -[R dr_v]x (eq. 61): robustness penalises net force.
    """
    corners = [-ca.skew(ca.mtimes(rotation, ca.DM(corner))) for corner in product(*zip(lower, upper, strict=True))]
    return np.array([np.array(corner) for corner in corners])
