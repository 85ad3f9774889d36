"""Where a satellite should point, and how that moves: attitude, rate and acceleration that belong together.

==========  ==============================================================================
symbol      meaning
==========  ==============================================================================
r, v        position [m] and velocity [m/s] of the craft, inertial, (3,) each
C(t, r, v)  direction cosines of the wanted frame from inertial, (3, 3)
w, w'       its rate and the derivative of that, in its own axes, (3,) each
==========  ==============================================================================

A kind of reference gives C alone, as an expression of time and, for what the orbit decides, of r and v. Rate and
acceleration follow by differentiating it along r' = v, v' = gravity(r), two bodies:

    [w]x = C C'^T    (C' the derivative),    w' = dw/dt.

So the three agree to rounding for any kind, of a guest's too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.mathematics.exact import array, is_number
from casadi_gnc.mechanics import earth, orbits, quaternions
from casadi_gnc.mechanics.earth import Epoch
from casadi_gnc.navigation._navigation import Reference, Wanted
from casadi_gnc.signals import Layout, Signal

_ORBIT = Layout((Signal("position", 3, "m"), Signal("velocity", 3, "m/s")))


class Tracking(Reference):
    """Base of references that are an attitude by time and place; a subclass gives `frame`."""

    reads = _ORBIT

    def frame(self, t: Any, position: Any, velocity: Any) -> Any:
        """Return C, (3, 3), wanted frame from inertial; its rows are the frame's axes."""
        raise TypeError(f"{type(self).__name__} defines no frame")

    def at(self, t: Any, known: Any) -> Wanted:
        """Return what is wanted at time t [s]."""
        now, r, v = ca.SX.sym("t"), ca.SX.sym("r", 3), ca.SX.sym("v", 3)
        where, falling = ca.vertcat(now, r, v), ca.vertcat(1, v, orbits.gravity(r))
        frame: Any = ca.SX(self.frame(now, r, v))
        moving = ca.reshape(ca.jtimes(ca.vec(frame), where, falling), 3, 3)
        # C' = -[w]x C, and of [w]x = -C' C^T each element stands once.
        turning = -ca.mtimes(moving, frame.T)
        rate = ca.vertcat(turning[2, 1], turning[0, 2], turning[1, 0])
        told = ca.vertcat(quaternions.from_dcm(frame), rate, ca.jtimes(rate, where, falling))
        place = ca.vertcat(known.position, known.velocity) if self.reads.size else ca.DM.zeros(6)
        found = ca.substitute(told, where, ca.vertcat(ca.SX(t), ca.SX(place)))
        return Wanted(found[:4], found[4:7], found[7:])


@dataclass(frozen=True, eq=False)
class Inertial(Reference):
    """Stay with a fixed attitude.

    Parameters
    ----------
    quaternion : (4,), scalar first, of the wanted frame from inertial.
    """

    quaternion: Sequence[float] = (1.0, 0.0, 0.0, 0.0)

    @property
    def is_inertial(self) -> bool:
        """Whether it is no turn."""
        return all(is_number(value) and float(value) == 0 for value in list(self.quaternion)[1:])

    def at(self, t: Any, known: Any) -> Wanted:
        """Return the attitude, at rest."""
        return Wanted(array(list(self.quaternion)))


@dataclass(frozen=True, eq=False)
class Nadir(Tracking):
    """Look down: z to the Earth's centre, y against the orbit's normal, x along the way.

    Parameters
    ----------
    offset : quaternion, (4,), of the wanted frame from that one.
    """

    offset: Sequence[float] = (1.0, 0.0, 0.0, 0.0)

    def frame(self, t: Any, position: Any, velocity: Any) -> Any:
        """Return the frame."""
        down = -position / ca.norm_2(position)
        normal = ca.cross(velocity, position)
        return _turned(self.offset, _two(down, normal / ca.norm_2(normal)))


@dataclass(frozen=True, eq=False)
class SunPointing(Tracking):
    """Turn an axis to the sun, and another as near as may be to the pole of the inertial frame.

    Parameters
    ----------
    epoch : when t = 0 is.
    axis : which body axis looks at the sun, unit vector, (3,).
    """

    epoch: Epoch
    axis: Sequence[float] = (0.0, 0.0, 1.0)
    reads = Layout()

    def frame(self, t: Any, position: Any, velocity: Any) -> Any:
        """Return the frame."""
        sun = self.epoch.sun(t)[0]
        sun = sun / ca.norm_2(sun)
        across = ca.cross(ca.DM([0, 0, 1]), sun)
        return ca.mtimes(_between(self.axis), _two(sun, across / ca.norm_2(across)))


@dataclass(frozen=True, eq=False)
class GroundTarget(Tracking):
    """Look at a place on the Earth with z, with y across the plane of the orbit as near as may be.

    Parameters
    ----------
    epoch : when t = 0 is.
    latitude, longitude : geodetic, [rad].
    height : above the ellipsoid, [m].
    """

    epoch: Epoch
    latitude: float
    longitude: float
    height: float = 0.0

    def frame(self, t: Any, position: Any, velocity: Any) -> Any:
        """Return the frame; undefined where the place lies along the orbit's normal."""
        place = ca.mtimes(self.epoch.to_earth(t).T, earth.place(self.latitude, self.longitude, self.height))
        sight = place - position
        sight = sight / ca.norm_2(sight)
        along = ca.cross(ca.cross(velocity, position), sight)
        return _two(sight, ca.cross(sight, along / ca.norm_2(along)))


def _two(z: Any, y: Any) -> Any:
    """Return the frame, rows x, y, z, of two perpendicular unit vectors."""
    return ca.vertcat(ca.cross(y, z).T, y.T, z.T)


def _turned(offset: Sequence[float], frame: Any) -> Any:
    return ca.mtimes(quaternions.dcm(array(list(offset))), frame)


def _between(axis: Sequence[Any]) -> Any:
    """Return a rotation, (3, 3), that brings a frame whose z looks somewhere to one whose `axis` does."""
    x, y, z = axis
    known, opposite = is_number(z), ca.diag(ca.DM([1.0, -1.0, -1.0]))
    if known and z < -1 + 1e-9:
        return opposite
    # The turn from (0, 0, 1) to the axis in one plane; its inverse is how coordinates change.
    cross = ca.skew(array([-y, x, 0.0]))
    square = ca.mtimes(cross, cross)
    if known:
        return ca.DM.eye(3) + cross + square / (1 + z)
    behind = z < -1 + 1e-9
    return ca.if_else(behind, opposite, ca.DM.eye(3) + cross + square / ca.if_else(behind, 1.0, 1 + z))
