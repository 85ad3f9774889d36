"""Force and torque between two magnetic dipoles, and the moment that makes a wanted force.

==========  ============================================================================
symbol      meaning
==========  ============================================================================
eta         position of the chaser's dipole from the target's, (3,), [m]
r, n        |eta| and eta/r
mu_C, mu_T  moments of chaser and target, (3,), [A m^2]
M, m        |mu_T| and mu_T/M
c           n.m, cosine between line of sight and target moment
F           force on the chaser, (3,), [N]; the target feels -F
k           3 mu_0/(4 pi) = 3e-7 N/A^2
==========  ============================================================================

All vectors in one frame. The force is linear in the chaser's moment,

    F = (k M/r^4) N mu_C,      N = n m' + m n' + c I - 5 c n n'                       (6)-(8)

N is symmetric. In the plane of n and m its determinant is -(1 + c^2), never zero; across it, along
n x m, N is multiplication by c. So a force across that plane cannot be made when the target's
moment is across the line of sight (c = 0), whatever the distance, and every other force can.

`moment_for` therefore minimises

    |N q - f|^2 + (d (n x m).q)^2,     mu_C = q r^4/(k M),  f the wanted force,

which makes f exactly in the plane, and of the part across it c^2/(c^2 + d^2 s^2), s = |n x m|;
d = 0 is the exact inverse. With g = c/(c^2 + d^2 s^2) and j = d^2/(c^2 + d^2 s^2) the minimiser is

    q = g f + a (n.f) n + b ((m.f) n + (n.f) m) + h (m.f) m,
    a = -4 c/(1 + c^2) - (1 - d^2) g,  b = 2/(1 + c^2) - j,  h = c/(1 + c^2) - (1 - d^2) g.

Coils are dipoles from some 6 to 8 radii on. Source: Shi, Liu, Biggs, Sun, Yue (2020), eqs (6)-(8),
doi:10.1016/j.ast.2020.105759; the closed form of the inverse is ours.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.mathematics import bounds
from casadi_gnc.mathematics.exact import array

#: k = 3 mu_0/(4 pi), [N/A^2], with mu_0 = 4 pi 1e-7.
STRENGTH = 3e-7
#: Distance [m] below which a separation is taken as this long: keeps n and 1/r^4 finite, in float too.
NEAREST = 1e-6


def length(vector: Any) -> Any:
    """Return the norm of a column, at least `NEAREST`; its gradient is finite at zero."""
    return ca.sqrt(bounds.maximum(ca.sumsqr(vector), NEAREST * NEAREST))


@dataclass(frozen=True, eq=False)
class TargetDipole:
    """Say where the target's moment points.

    Parameters
    ----------
    moment : mu_T, (3,), [A m^2], in the frame of the separation; or its magnitude where steered.
    steered : the target keeps its moment along the line of sight, away from itself to the chaser.
    """

    moment: Any
    steered: bool = False

    def at(self, separation: Any) -> Any:
        """Return mu_T, (3,), [A m^2], for a separation [m]."""
        if self.steered:
            return self.moment * separation / length(separation)
        return array(self.moment) if isinstance(self.moment, (tuple, list)) else self.moment


def force_map(separation: Any, target: Any) -> Any:
    """Return (k M/r^4) N, (3, 3), [N/(A m^2)], symmetric: the chaser's moment -> force on the chaser."""
    r = length(separation)
    n = separation / r
    along = ca.dot(n, target)
    outer = ca.mtimes(n, target.T)
    square = r * r
    return STRENGTH / (square * square) * (outer + outer.T + along * ca.DM.eye(3) - 5 * along * ca.mtimes(n, n.T))


def force(separation: Any, chaser: Any, target: Any) -> Any:
    """Return the force on the chaser, (3,), [N] (eq. 6)."""
    return ca.mtimes(force_map(separation, target), chaser)


def field(separation: Any, moment: Any) -> Any:
    """Return the flux density of a dipole, (3,), [T], at a place [m] seen from it."""
    r = length(separation)
    n = separation / r
    return STRENGTH / 3 / (r * r * r) * (3 * n * ca.dot(n, moment) - moment)


def torques(separation: Any, chaser: Any, target: Any) -> tuple[Any, Any]:
    """Return the torque on the chaser and on the target, (3,), [N m] each: moment x field of the other."""
    on_chaser = ca.cross(chaser, field(separation, target))
    return on_chaser, ca.cross(target, field(-separation, chaser))


def alignment(separation: Any, target: Any) -> Any:
    """Return |c|, [-]: 1 where every force is easy, 0 where one direction cannot be made."""
    return ca.fabs(ca.dot(separation, target)) / (length(separation) * length(target))


def moment_for(wanted: Any, separation: Any, target: Any, damping: Any = 0.0) -> Any:
    """Return the chaser's moment, (3,), [A m^2], that makes a wanted force on the chaser.

    Parameters
    ----------
    wanted : force, (3,), [N].
    separation : eta, (3,), [m].
    target : mu_T, (3,), [A m^2].
    damping : d, [-], from 0 to below 1; across the plane of n and m the moment stays within
        r^4/(k M) |f|/(2 d sqrt(1 - d^2)). With 0 the result is infinite or NaN at c = 0.
    """
    r, strength = length(separation), length(target)
    n, m = separation / r, target / strength
    c = ca.dot(n, m)
    square, damped = c * c, damping * damping
    shared = square + damped * (1 - square)
    g, j = c / shared, damped / shared
    a = -4 * c / (1 + square) - (1 - damped) * g
    b = 2 / (1 + square) - j
    h = c / (1 + square) - (1 - damped) * g
    along, beside = ca.dot(n, wanted), ca.dot(m, wanted)
    q = g * wanted + (a * along + b * beside) * n + (b * along + h * beside) * m
    return q * (r * r * (r * r) / (STRENGTH * strength))
