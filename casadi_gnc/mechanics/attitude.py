"""Attitude by modified Rodrigues parameters (MRPs).

The MRP vector of a turn by the angle theta about the unit axis e is s = e tan(theta/4). All
functions take and return CasADi columns (SX, MX, DM or anything that CasADi converts).

========  =======================================================================
symbol    meaning
========  =======================================================================
s         MRPs of a body frame B with respect to a reference frame N, (3,), [-]
w         rate of B relative to N resolved in B, (3,), [rad/s]
n         s's, equal to 1 at a half turn
C(s)      direction cosine matrix N -> B, v_B = C(s) v_N, orthonormal
G(s)      kinematic matrix, s' = G(s) w; G'G = ((1 + n)/4)^2 I, so never singular
========  =======================================================================

Source: Huang, Biggs, Duan (2020), eq. (1), doi:10.1016/j.ast.2019.105572, with the shadow set
-s/n (the paper prints s/n, which is the turn back); Schaub and Junkins, Analytical Mechanics of
Space Systems, section 3.6.
"""

from __future__ import annotations

from typing import Any

import casadi as ca

from casadi_gnc.mathematics import exact
from casadi_gnc.mathematics.exact import array


def kinematic_matrix(s: Any) -> Any:
    """Return G(s), 3 x 3, of s' = G(s) w (eq. 1)."""
    n = ca.sumsqr(s)
    return ((1 - n) * ca.DM.eye(3) + 2 * ca.skew(s) + 2 * ca.mtimes(s, s.T)) / 4


def mrp_rate(s: Any, w: Any) -> Any:
    """Return s' = G(s) w without forming G."""
    return ((1 - ca.sumsqr(s)) * w + 2 * ca.cross(s, w) + 2 * s * ca.dot(s, w)) / 4


def body_rate(s: Any, s_rate: Any) -> Any:
    """Return w = G(s)^-1 s'; the inverse is 16/(1 + n)^2 G(s)' and exists everywhere."""
    n = ca.sumsqr(s)
    transposed = (1 - n) * s_rate - 2 * ca.cross(s, s_rate) + 2 * s * ca.dot(s, s_rate)
    return 4 * transposed / (1 + n) ** 2


def dcm(s: Any) -> Any:
    """Return C(s) = I - 4(1 - n)/(1 + n)^2 [s]x + 8/(1 + n)^2 [s]x^2, 3 x 3, reference -> body."""
    n = ca.sumsqr(s)
    cross = ca.skew(s)
    return ca.DM.eye(3) + (8 * ca.mtimes(cross, cross) - 4 * (1 - n) * cross) / (1 + n) ** 2


def reference_z(s: Any) -> Any:
    """Return the third column of C(s): the reference frame's z axis seen from the body.

    Huang et al. eq. (16) divides by 1 + n; only (1 + n)^2 makes it a unit vector.
    """
    n = ca.sumsqr(s)
    q = 1 - n
    x = 8 * s[0] * s[2] - 4 * s[1] * q
    y = 8 * s[1] * s[2] + 4 * s[0] * q
    z = 4 * (s[2] ** 2 - s[1] ** 2 - s[0] ** 2) + q**2
    return ca.vertcat(x, y, z) / (1 + n) ** 2


def orbit_frame_rate(s: Any, orbit_rate: Any) -> Any:
    """Return the rate of the orbit frame, (3,), [rad/s], seen from the body.

    Axes of the orbit frame as in Huang and Duan (2019), section II.A: x ahead, y along the orbit's normal, z away
    from the Earth; it turns about its y axis.

    Parameters
    ----------
    s : MRPs of the body with respect to the orbit frame.
    orbit_rate : of a circular orbit, [rad/s].
    """
    return orbit_rate * dcm(s)[:, 1]


def shadow(s: Any) -> Any:
    """Return the other MRPs of the same attitude, -s/n; undefined at s = 0."""
    return -s / ca.sumsqr(s)


def short_way(s: Any) -> Any:
    """Return whichever of s and its shadow describes the turn of at most half a revolution."""
    n = ca.sumsqr(s)
    long = n > 1
    return ca.if_else(long, -s / ca.if_else(long, n, 1.0), s)


def compose(second: Any, first: Any) -> Any:
    """Return the MRPs of C(second) C(first): turn by `first`, then by `second`.

    Undefined where the product is a full turn (the denominator vanishes); use a shadow there.
    """
    n2, n1 = ca.sumsqr(second), ca.sumsqr(first)
    top = (1 - n1) * second + (1 - n2) * first - 2 * ca.cross(second, first)
    return top / (1 + n1 * n2 - 2 * ca.dot(second, first))


def relative(s: Any, reference: Any) -> Any:
    """Return the MRPs of C(s) C(reference)': the attitude of s as seen from `reference`."""
    return compose(s, -reference)


def frame_rotation(yaw: Any, pitch: Any, roll: Any) -> Any:
    """Return Rx(roll) Ry(pitch) Rz(yaw), 3 x 3, from angles [rad] of a 3-2-1 sequence of frames.

    The entries are the same to the last bit on every machine (see `casadi_gnc.mathematics.exact`).
    """
    (cz, sz), (cy, sy), (cx, sx) = (exact.cos_sin(a) for a in (yaw, pitch, roll))
    about_x = array([[1, 0, 0], [0, cx, sx], [0, -sx, cx]])
    about_y = array([[cy, 0, -sy], [0, 1, 0], [sy, 0, cy]])
    about_z = array([[cz, sz, 0], [-sz, cz, 0], [0, 0, 1]])
    return ca.mtimes([about_x, about_y, about_z])
