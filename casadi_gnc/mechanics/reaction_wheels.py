"""Reaction wheels on a body: where their axes point, what they store, what they make.

========  ==========================================================================
symbol    meaning
========  ==========================================================================
R         rotation service frame -> combined frame
Cbar      wheel axes in the service frame, 3 x N, unit columns
C         wheel axes in the combined frame, 3 x N (`axes`)
J_w       inertia of a wheel about its axis, [kg m^2], or one for each
Omega     wheel speeds, (N,), [rad/s];  x = Omega' wheel accelerations, [rad/s^2]
h         stored momentum C J_w Omega, (3,), [N m s]
========  ==========================================================================

    J w' = -w x (J w + h) + tau + ...,        tau = -C J_w x                      (11), (13)

An axis is a free vector: it turns with the body and has no place, so C = R Cbar (`free_axes`). Eq. (4)
subtracts the mass centre from it as if it were a point, c_i = R (cbar_i - r_c) (`axes_as_points`, to
fly the paper's numbers): with true wheels the pseudo-inverse of that matrix has positive feedback
in one direction.

Source: Huang and Duan (2019), section II, doi:10.1109/ACCESS.2019.2949285.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.errors import FlightError
from casadi_gnc.mathematics import bounds
from casadi_gnc.mathematics.exact import array
from casadi_gnc.mechanics.rigid_body import RigidBody
from casadi_gnc.signals import Layout, Signal


def free_axes(rotation: Any, mounted: Any) -> ca.DM:
    """Return C = R Cbar, (3, N)."""
    return ca.mtimes(array(rotation), array(mounted))


def axes_as_points(rotation: Any, mounted: Any, centre_of_mass: Any) -> ca.DM:
    """Return R (Cbar - r_c 1'), (3, N), the paper's configuration matrix (eqs 4 and 7).

    Parameters
    ----------
    centre_of_mass : r_c, (3,), [m], service frame.
    """
    axes = array(mounted)
    return ca.mtimes(array(rotation), axes - ca.repmat(array(centre_of_mass), 1, axes.shape[1]))


def corner_shifts(rotation: Any, lower: list[float], upper: list[float]) -> np.ndarray:
    """Return D, (8, 3, 1): at corner v of the box of errors of r_c, the torque -C J_w x moves by D_v (J_w 1' x).

    Only the sum of the accelerations is uncertain, so robust allocation keeps it small (eq. 8, whose
    sign should be minus).
    """
    corners = product(*zip(lower, upper, strict=True))
    return np.array([np.array(ca.mtimes(ca.DM(rotation), ca.DM(corner))) for corner in corners])


def acceleration_bounds(speed: Any, max_speed: Any, period: float, lower: Any, upper: Any) -> tuple[Any, Any]:
    """Return the bounds of the wheel accelerations within which no wheel passes its speed limit in one period.

    A wheel beyond its limit may only slow down; the amplitude box `lower`, `upper` [rad/s^2] wins
    where both clash.
    """
    least, most = (-max_speed - speed) / period, (max_speed - speed) / period
    return bounds.clip(least, lower, upper), bounds.clip(most, lower, upper)


@dataclass(frozen=True, eq=False)
class WheelArray:
    """Hold N wheels of a body; a wheel's command is its acceleration, and its torque on the body is -C J_w x.

    Parameters
    ----------
    axes : C, (3, N), body frame.
    inertia : J_w, [kg m^2].
    max_acceleration : of each, [rad/s^2]; its motor's torque over J_w.
    max_speed : of each, [rad/s]; the momentum it stores over J_w.
    """

    axes: Any
    inertia: Any
    max_acceleration: float = math.inf
    max_speed: float = math.inf

    def __post_init__(self) -> None:
        for name in ("inertia", "max_acceleration", "max_speed"):
            value = getattr(self, name)
            if not isinstance(value, (ca.SX, ca.MX)) and not ca.mmin(ca.DM(value)) > 0:
                raise FlightError(f"{name} of the wheels is {value}, expected a positive number")

    @property
    def count(self) -> int:
        """N."""
        return self.axes.shape[1]

    @property
    def effectiveness(self) -> Any:
        """-C J_w, (3, N), [kg m^2]: torque on the body per wheel acceleration."""
        return -self.axes * self.inertia

    def momentum(self, speed: Any) -> Any:
        """Return h = C J_w Omega, (3,), [N m s], body frame."""
        return ca.mtimes(self.axes, self.inertia * speed)

    def torque(self, acceleration: Any) -> Any:
        """Return -C J_w x, (3,), [N m], on the body."""
        return ca.mtimes(self.effectiveness, acceleration)


@dataclass(frozen=True, eq=False)
class Gyrostat(RigidBody):
    """Model a rigid body that carries wheels.

    `inertia` includes the wheels locked to the body, so that J w + h is the whole momentum.

    Parameters
    ----------
    wheels : on the body.
    """

    wheels: WheelArray = field(kw_only=True)

    def stored(self, rate: Any, speed: Any) -> Any:
        """Return h, (3,), [N m s], so that J w + h is the whole momentum."""
        return self.wheels.momentum(speed)

    def coupling(self, rate: Any, speed: Any) -> Any:
        """Return -w x h, (3,), [N m]: what the stored momentum does to a turning body."""
        return -ca.cross(rate, self.stored(rate, speed))


@dataclass(frozen=True, eq=False)
class TorqueGyrostat(Gyrostat):
    """Model a rigid body whose wheels are told the torques of their motors.

    A motor turns its wheel against the body, J_s (Omega' + g.w') = u, so the body turns as if the wheels' inertia
    about their axes were none of its own: `inertia` is J - sum J_s g g', and a wheel stores J_s (Omega + g.w).
    """

    def stored(self, rate: Any, speed: Any) -> Any:
        """Return h = sum g J_s (Omega + g.w), (3,), [N m s]."""
        return self.wheels.momentum(speed + ca.mtimes(self.wheels.axes.T, rate))


def attitude_signals(body: RigidBody) -> Layout:
    """Return what a law reads that models `body`: attitude, rate, and wheel speeds where it carries wheels."""
    wheels = (Signal("wheel_speed", body.wheels.count, "rad/s"),) if isinstance(body, Gyrostat) else ()
    return Layout((Signal("mrp", 3, "-"), Signal("rate", 3, "rad/s"), *wheels))


def modelled_acceleration(body: RigidBody, now: Any, torque: Any = 0.0) -> Any:
    """Return w', (3,), [rad/s^2], under a torque [N m] on the body, at signals `now` of `attitude_signals`."""
    if isinstance(body, Gyrostat):
        torque = torque + body.coupling(now.rate, now.wheel_speed)
    return body.acceleration(now.mrp, now.rate, torque)
