"""Attitude by unit quaternions, scalar first.

The quaternion of a turn by the angle theta about the unit axis e is q = (cos(theta/2), e sin(theta/2)); q and -q
are one attitude. All functions take and return CasADi columns, as those of `casadi_gnc.mechanics.attitude` do,
whose frames and signs they share.

========  =======================================================================
symbol    meaning
========  =======================================================================
q         quaternion of a body frame B with respect to a reference frame N, (4,)
c, v      its scalar, and its vector part, (3,)
w         rate of B relative to N resolved in B, (3,), [rad/s]
C(q)      direction cosine matrix N -> B, v_B = C(q) v_N
s         modified Rodrigues parameters of the same attitude, v/(1 + c)
========  =======================================================================

Source: Markley and Crassidis, Fundamentals of Spacecraft Attitude Determination and Control (2014), chapter 2,
doi:10.1007/978-1-4939-0802-8 (there the scalar is last); Shepperd (1978), doi:10.2514/3.55767b.
"""

from __future__ import annotations

from typing import Any

import casadi as ca

from casadi_gnc.mathematics import exact


def dcm(q: Any) -> Any:
    """Return C(q) = (c^2 - v'v) I + 2 v v' - 2 c [v]x, 3 x 3, reference -> body, for a unit quaternion."""
    c, v = q[0], q[1:]
    return (c * c - ca.sumsqr(v)) * ca.DM.eye(3) + 2 * ca.mtimes(v, v.T) - 2 * c * ca.skew(v)


def turned(q: Any, vector: Any) -> Any:
    """Return C(q) vector, (3,): a vector of the reference frame as the body sees it."""
    c, v = q[0], q[1:]
    across = ca.cross(v, vector)
    return vector - 2 * c * across + 2 * ca.cross(v, across)


def compose(second: Any, first: Any) -> Any:
    """Return the quaternion of C(second) C(first): turn by `first`, then by `second`."""
    c2, v2, c1, v1 = second[0], second[1:], first[0], first[1:]
    return ca.vertcat(c2 * c1 - ca.dot(v2, v1), c2 * v1 + c1 * v2 - ca.cross(v2, v1))


def conjugate(q: Any) -> Any:
    """Return the quaternion of the turn back."""
    return ca.vertcat(q[0], -q[1:])


def relative(q: Any, reference: Any) -> Any:
    """Return the quaternion of C(q) C(reference)': the attitude of q as seen from `reference`."""
    return compose(q, conjugate(reference))


def rate(q: Any, w: Any) -> Any:
    """Return q' = (-v'w, c w + v x w)/2."""
    c, v = q[0], q[1:]
    return ca.vertcat(-ca.dot(v, w), c * w + ca.cross(v, w)) / 2


def normalised(q: Any) -> Any:
    """Return q over its length; undefined at zero."""
    return q / ca.sqrt(ca.sumsqr(q))


def short_way(q: Any) -> Any:
    """Return whichever of q and -q has a scalar that is not negative: the turn of at most half a revolution."""
    return ca.if_else(q[0] < 0, -q, q)


def from_rotation_vector(turn: Any) -> Any:
    """Return the quaternion of a turn given as axis times angle, (3,), [rad].

    With the square of the half angle below 1e-4 a series stands in for the sine over the angle; what it leaves out
    is below 1e-22.
    """
    square = ca.sumsqr(turn) / 4
    small = square < 1e-4
    half = ca.sqrt(ca.if_else(small, 1.0, square))
    sine = 1 - square / 6 * (1 - square / 20 * (1 - square / 42 * (1 - square / 72)))
    cosine = 1 - square / 2 * (1 - square / 12 * (1 - square / 30 * (1 - square / 56)))
    return ca.vertcat(ca.if_else(small, cosine, ca.cos(half)), turn / 2 * ca.if_else(small, sine, ca.sin(half) / half))


def to_rotation_vector(q: Any) -> Any:
    """Return axis times angle, (3,), [rad], of the short way."""
    near = short_way(q)
    square = ca.sumsqr(near[1:])
    small = square < 1e-12
    sine = ca.sqrt(ca.if_else(small, 1.0, square))
    # 2 asin(x)/x = 2 + x^2/3 + ..., and the scalar of a unit quaternion is 1 to that order.
    return near[1:] * ca.if_else(small, 2 + square / 3, 2 * ca.atan2(sine, near[0]) / sine)


def from_axis_angle(axis: Any, angle: Any) -> Any:
    """Return the quaternion of a turn about a unit axis, (3,), by an angle [rad]; exact constants for numbers."""
    cosine, sine = exact.cos_sin(angle / 2)
    return ca.vertcat(cosine, exact.array(axis) * sine)


def from_321(yaw: Any, pitch: Any, roll: Any) -> Any:
    """Return the quaternion of Rx(roll) Ry(pitch) Rz(yaw), angles [rad] of a 3-2-1 sequence of frames."""
    about_x, about_y = from_axis_angle([1, 0, 0], roll), from_axis_angle([0, 1, 0], pitch)
    return compose(about_x, compose(about_y, from_axis_angle([0, 0, 1], yaw)))


def to_321(q: Any) -> Any:
    """Return yaw, pitch, roll, (3,), [rad], of a 3-2-1 sequence; pitch within a quarter turn.

    At a pitch of a quarter turn yaw and roll are not told apart, and the result is undefined.
    """
    matrix = dcm(q)
    level = ca.sqrt(matrix[0, 0] ** 2 + matrix[0, 1] ** 2)
    return ca.vertcat(
        ca.atan2(matrix[0, 1], matrix[0, 0]), ca.atan2(-matrix[0, 2], level), ca.atan2(matrix[1, 2], matrix[2, 2])
    )


def from_mrp(s: Any) -> Any:
    """Return the quaternion (1 - s's, 2 s)/(1 + s's) of modified Rodrigues parameters."""
    n = ca.sumsqr(s)
    return ca.vertcat(1 - n, 2 * s) / (1 + n)


def to_mrp(q: Any) -> Any:
    """Return the modified Rodrigues parameters v/(1 + c), of at most unit length, of the short way."""
    near = short_way(q)
    return near[1:] / (1 + near[0])


def from_dcm(matrix: Any) -> Any:
    """Return the quaternion, with a scalar that is not negative, of a direction cosine matrix, (3, 3).

    Each of the four elements can be the one that is found by a root and divides the rest; the largest is taken
    (Shepperd), so that no digits are lost. Differentiable wherever the choice stays.
    """
    trace = matrix[0, 0] + matrix[1, 1] + matrix[2, 2]
    a, b, c = matrix[1, 2] - matrix[2, 1], matrix[2, 0] - matrix[0, 2], matrix[0, 1] - matrix[1, 0]
    d, e, f = matrix[0, 1] + matrix[1, 0], matrix[2, 0] + matrix[0, 2], matrix[1, 2] + matrix[2, 1]
    # Column i is 4 q_i q.
    columns = [
        ca.vertcat(1 + trace, a, b, c),
        ca.vertcat(a, 1 + 2 * matrix[0, 0] - trace, d, e),
        ca.vertcat(b, d, 1 + 2 * matrix[1, 1] - trace, f),
        ca.vertcat(c, e, f, 1 + 2 * matrix[2, 2] - trace),
    ]
    best, size = columns[0], columns[0][0]
    for i in range(1, 4):
        larger = columns[i][i] > size
        best, size = ca.if_else(larger, columns[i], best), ca.if_else(larger, columns[i][i], size)
    return short_way(best / (2 * ca.sqrt(size)))
