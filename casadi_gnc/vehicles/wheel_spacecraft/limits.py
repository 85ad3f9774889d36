"""What the speed limit of wheels means on board: bounds of the next acceleration, and a flag."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.mathematics.bounds import any_of
from casadi_gnc.mechanics import reaction_wheels
from casadi_gnc.status import StepStatus

#: Share of the limit from which a wheel counts as saturated, less one.
_NEAR = 1e-6


@dataclass(frozen=True)
class SpeedLimit:
    """Keep wheels below their largest speed.

    Parameters
    ----------
    speed : [rad/s].
    acceleration : largest, [rad/s^2].
    """

    speed: float
    acceleration: float

    def reach(self, seen: Any, period: float) -> tuple[Any, Any]:
        """Return the accelerations, (N,) each, within which no wheel passes the limit in one period [s]."""
        most = self.acceleration
        return reaction_wheels.acceleration_bounds(seen.wheel_speed, self.speed, period, -most, most)

    def judge(self, seen: Any, limited: Any, actuators: Any) -> dict[StepStatus, Any]:
        """Return whether a wheel is at its limit."""
        return {StepStatus.WHEEL_SATURATED: any_of(ca.fabs(seen.wheel_speed) >= (1 - _NEAR) * self.speed)}
