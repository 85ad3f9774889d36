"""A law of laws: one of four in every sample, chosen by what is seen.

======  ==========  ===========================================  =======================================
number  mode        law                                          left for
======  ==========  ===========================================  =======================================
0       detumble    rate damping, w against the inertial frame   acquire, below `calm_rate`
1       acquire     quaternion feedback within `rate_limit`      point, nearer than `near_angle`
2       point       MRP feedback with integral                   acquire, further than `lost_angle`
3       safe        rate damping                                 detumble, after `safe_time`
======  ==========  ===========================================  =======================================

From acquire and point a rate above `alarm_rate` leads to safe. The choice is made once a sample, before the command;
memory of the law that is left is started afresh, so that no integral comes back from another time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.errors import LawError
from casadi_gnc.laws._law import Law, gain
from casadi_gnc.laws.attitude_tracking import tracking_signals
from casadi_gnc.laws.efforts import TORQUE
from casadi_gnc.laws.mrp_feedback import MrpFeedback
from casadi_gnc.laws.quaternion_feedback import QuaternionFeedback
from casadi_gnc.mathematics import exact
from casadi_gnc.mathematics.exact import is_number
from casadi_gnc.mechanics.rigid_body import RigidBody
from casadi_gnc.signals import Layout, Signal

DETUMBLE, ACQUIRE, POINT, SAFE = range(4)


@dataclass(frozen=True, eq=False)
class Modes(Law):
    """Detumble, acquire, point, and be safe; `body` is what the software believes of the craft."""

    body: RigidBody
    damping_gain: Any = gain("N m s/rad", "torque per rate in detumble and safe", above=0.0)
    frequency: Any = gain("rad/s", "of small errors in acquire", symbol="wn", above=0.0)
    damping_ratio: Any = gain("-", "of small errors in acquire", symbol="zeta", above=0.0, default=0.7)
    rate_limit: Any = gain("rad/s", "on the way in acquire", above=0.0)
    attitude_gain: Any = gain("N m", "torque per MRP in point", symbol="K", above=0.0)
    rate_gain: Any = gain("N m s/rad", "torque per rate in point", symbol="P", above=0.0)
    integral_gain: Any = gain("1/(N m s^2)", "in point", symbol="Ki", minimum=0.0, default=0.0)
    calm_rate: Any = gain("rad/s", "below which detumble ends", above=0.0)
    near_angle: Any = gain("rad", "from the reference, below which acquire ends", above=0.0)
    lost_angle: Any = gain("rad", "from the reference, above which point ends", above=0.0)
    alarm_rate: Any = gain("rad/s", "above which acquire and point end in safe", above=0.0)
    safe_time: Any = gain("s", "spent in safe", minimum=0.0, default=60.0)

    effort = TORQUE
    outputs = Layout((Signal("mode", 1, ""),))

    def __post_init__(self) -> None:
        super().__post_init__()
        for low, high in (("calm_rate", "alarm_rate"), ("near_angle", "lost_angle"), ("rate_limit", "alarm_rate")):
            below, above = getattr(self, low), getattr(self, high)
            if is_number(below) and is_number(above) and not float(below) < float(above):
                raise LawError(f"{low} is {below:g} and {high} {above:g}, expected less: modes would take turns")

    @classmethod
    def reads(cls, belief: RigidBody) -> Layout:
        """Return what the three laws read."""
        both = (tracking_signals(belief, "mrp"), tracking_signals(belief, "quaternion"))
        return Layout(tuple({signal.name: signal for each in both for signal in each.signals}.values()))

    @property
    def inputs(self) -> Layout:  # type: ignore[override]
        """What the law reads on its own body."""
        return self.reads(self.body)

    @property
    def acquiring(self) -> QuaternionFeedback:
        """The law of acquire."""
        return QuaternionFeedback(
            self.body,
            hold=self.hold,
            frequency=self.frequency,
            damping_ratio=self.damping_ratio,
            rate_limit=self.rate_limit,
        )

    @property
    def pointing(self) -> MrpFeedback:
        """The law of point."""
        return MrpFeedback(
            self.body,
            hold=self.hold,
            attitude_gain=self.attitude_gain,
            rate_gain=self.rate_gain,
            integral_gain=self.integral_gain,
        )

    @property
    def memory(self) -> Layout:  # type: ignore[override]
        """The mode, for how long, and the memory of point."""
        return Layout((Signal("mode"), Signal("since", 1, "s"))) + self.pointing.memory

    def _read(self, law: Law, y: Any) -> Any:
        now = self.inputs.split(y)
        return ca.vertcat(*(getattr(now, name) for name in law.inputs.names))

    def _parts(self, m: Any) -> tuple[Any, Any, Any]:
        """Return mode, time in it, and the memory of point."""
        return m[0], m[1], m[2:]

    def start(self, t: Any, y: Any) -> Any:
        """Return the memory in detumble."""
        return ca.vertcat(DETUMBLE, 0, self.pointing.start(t, self._read(self.pointing, y)))

    def jump(self, t: Any, y: Any, m: Any) -> Any:
        """Return the memory after the choice of the mode."""
        now, (mode, since, own) = self.inputs.split(y), self._parts(m)
        fast, far = ca.sumsqr(now.body_rate), ca.sumsqr(now.mrp)
        alarm = ca.sumsqr(now.rate) > self.alarm_rate**2
        following = [
            ca.if_else(fast < self.calm_rate**2, ACQUIRE, DETUMBLE),
            ca.if_else(alarm, SAFE, ca.if_else(far < _mrp_square(self.near_angle), POINT, ACQUIRE)),
            ca.if_else(alarm, SAFE, ca.if_else(far > _mrp_square(self.lost_angle), ACQUIRE, POINT)),
            ca.if_else(since >= self.safe_time, DETUMBLE, SAFE),
        ]
        chosen = _of(mode, following)
        stays = ca.fabs(chosen - mode) < 0.5
        fresh = ca.SX(self.pointing.start(t, self._read(self.pointing, y)))
        return ca.vertcat(chosen, ca.if_else(stays, since, 0.0), ca.if_else(stays, own, fresh))

    def command(self, t: Any, y: Any, m: Any) -> Any:
        """Return the chosen law's command, (3,), [N m]."""
        mode, _, own = self._parts(m)
        damped = -self.damping_gain * self.inputs.split(y).body_rate
        acquired = self.acquiring.command(t, self._read(self.acquiring, y), ca.DM.zeros(0, 1))
        pointed = self.pointing.command(t, self._read(self.pointing, y), own)
        return _of(mode, [damped, acquired, pointed, damped])

    def rate(self, t: Any, y: Any, m: Any, wanted: Any, achieved: Any) -> Any:
        """Return time passing, and the memory of point moving while it points."""
        mode, _, own = self._parts(m)
        moving = self.pointing.rate(t, self._read(self.pointing, y), own, wanted, achieved)
        return ca.vertcat(0, 1, ca.if_else(ca.fabs(mode - POINT) < 0.5, moving, ca.DM.zeros(own.shape[0])))

    def show(self, t: Any, y: Any, m: Any) -> dict[str, Any]:
        """Return the mode's number."""
        return {"mode": m[0]}


def _of(mode: Any, values: Sequence[Any]) -> Any:
    """Return the value of a mode; a number that is none is taken for the first."""
    found = values[0]
    for i in range(1, len(values)):
        found = ca.if_else(ca.fabs(mode - i) < 0.5, values[i], found)
    return found


def _mrp_square(angle: Any) -> Any:
    """Return tan(angle/4)^2."""
    cosine, sine = exact.cos_sin(angle / 4)
    return (sine / cosine) ** 2
