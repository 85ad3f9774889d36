"""A circular orbit, and what the gravity of the central body does between two masses close to it.

========  ========================================================================================
symbol    meaning
========  ========================================================================================
F_t       orbiting frame: x radial outward, z along the orbit normal
F_s       frame of a craft near the orbiting mass
R(s)      F_t -> F_s, direction cosines of the MRPs s
r         position of the craft from the orbiting mass, (3,), [m], F_s
r_t, n    radius [m] and rate [rad/s] of the orbit, n = sqrt(mu/r_t^3)
e         radial direction R (1, 0, 0), (3,), F_s
========  ========================================================================================

The difference of gravity -mu [(r + r_t e)/|r + r_t e|^3 - e/r_t^2] loses all its digits in single
precision, where one unit in the last place of r_t is half a metre. Without the difference,

    q = 2 e.r/r_t + r.r/r_t^2,    c = expm1(-3/2 log1p(q)),    g_d = -n^2 ((1 + c) r + c r_t e),

which is the same number.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.mathematics import exact
from casadi_gnc.mechanics import attitude

#: Gravitational parameter of the Earth [m^3/s^2] and its equatorial radius [m] (WGS 84, EGM 96).
EARTH_MU = 3.986004418e14
EARTH_RADIUS = 6378137.0


@dataclass(frozen=True)
class CircularOrbit:
    """Describe a circular orbit.

    Parameters
    ----------
    radius : r_t, [m].
    mu : gravitational parameter, [m^3/s^2].
    """

    radius: float
    mu: float = EARTH_MU

    @property
    def rate(self) -> float:
        """Return n, [rad/s]."""
        return exact.sqrt(self.mu / (self.radius * self.radius * self.radius))

    def radial(self, mrp: Any) -> Any:
        """Return e, (3,), F_s."""
        return attitude.dcm(mrp)[:, 0]

    def rotation(self, mrp: Any) -> Any:
        """Return R (0, 0, n), (3,), [rad/s], F_s: the rate of F_t seen from the craft."""
        return self.rate * attitude.dcm(mrp)[:, 2]

    def gravity_difference(self, mrp: Any, position: Any) -> Any:
        """Return g_d, (3,), [m/s^2], F_s: the craft's acceleration by gravity less the orbiting mass's."""
        radial, square = self.radial(mrp), ca.sumsqr(position) / self.radius
        q = (2 * ca.dot(radial, position) + square) / self.radius
        c = ca.expm1(-1.5 * ca.log1p(q))
        return -(self.rate**2) * ((1 + c) * position + c * self.radius * radial)
