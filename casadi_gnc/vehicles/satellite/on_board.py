"""What the flight software of a satellite knows of its actuators: what they make, and how far they reach."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.mathematics import bounds
from casadi_gnc.mechanics.rigid_body import inverse3
from casadi_gnc.mechanics.satellite_parts import endless
from casadi_gnc.status import StepStatus

#: Square of a field [T^2] below which no dipole is asked for more.
WEAKEST = 1e-14
#: s where wheels or thrusters make most of the torque, [-].
_HELPED = 1e-4
#: Share of the limit from which a wheel counts as saturated, less one.
_NEAR = 1e-6


@dataclass(frozen=True, eq=False)
class TorqueByField:
    """Give the effectiveness of a satellite whose coils push against the measured field.

    Parameters
    ----------
    fixed : torque per command of wheels and thrusters, (3, N).
    coils : axes of the coils, (3, K), which come last.
    """

    fixed: Any
    coils: Any

    def __call__(self, seen: Any) -> Any:
        """Return the torque per command, (3, N + K): of a coil axis x B."""
        made = ca.mtimes(-ca.skew(seen.magnetic_field), self.coils)
        return ca.horzcat(ca.SX(self.fixed), made)


@dataclass(frozen=True, eq=False)
class LeastByField:
    """Share a torque out where nothing but coils reaches every axis, which at any moment they do not.

    With A, (3, N + K), the torque per command, and B the field, the commands are A' (A A' + s B B')^-1 u. Of coils
    alone A A' reaches all but the direction of B, and s B B', s = 1, fills that one and nothing else: it is the
    pseudo-inverse, the least dipoles, and of u along B nothing is asked. Of wheels or thrusters that leave an axis out
    a small s decides only while the field is within some half a degree of an axis that coils alone can reach.

    Parameters
    ----------
    made : torque per command, a function of measured signals.
    """

    made: TorqueByField

    def __call__(self, seen: Any, torque: Any) -> Any:
        """Return the commands of all actuators, (N + K,)."""
        field, made = seen.magnetic_field, self.made(seen)
        strength = ca.sumsqr(field)
        square = bounds.maximum(strength, WEAKEST)
        share = _HELPED if self.made.fixed.shape[1] else 1.0
        reached = (ca.mtimes(made, made.T) + share * ca.mtimes(field, field.T)) / square
        nothing = (1 - strength / square) * ca.DM.eye(3)  # zero wherever there is a field
        return ca.mtimes(made.T, ca.mtimes(inverse3(reached + nothing), torque)) / square


@dataclass(frozen=True, eq=False)
class WheelLimits:
    """Keep wheels below their largest speed; what comes after the wheels is free.

    Parameters
    ----------
    speeds, spin : largest speed [rad/s] and inertia [kg m^2] of each wheel, (N,).
    lower, upper : bounds of all actuators.
    """

    speeds: tuple[Any, ...]
    spin: tuple[Any, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]

    def reach(self, seen: Any, period: float) -> tuple[Any, Any]:
        """Return bounds of all commands within which no motor drives its wheel past the limit in one period [s]."""
        least, most = list(self.lower), list(self.upper)
        for i, (fastest, spin) in enumerate(zip(self.speeds, self.spin, strict=True)):
            if not endless(fastest):
                speed = seen.wheel_speed[i]
                least[i] = bounds.clip((-fastest - speed) * spin / period, self.lower[i], self.upper[i])
                most[i] = bounds.clip((fastest - speed) * spin / period, self.lower[i], self.upper[i])
        return ca.vertcat(*least), ca.vertcat(*most)

    def judge(self, seen: Any, limited: Any, actuators: Any) -> dict[StepStatus, Any]:
        """Return whether a wheel is at its limit."""
        full = [
            ca.fabs(seen.wheel_speed[i]) >= (1 - _NEAR) * fastest
            for i, fastest in enumerate(self.speeds)
            if not endless(fastest)
        ]
        return {StepStatus.WHEEL_SATURATED: bounds.any_of(ca.vertcat(*full))}
