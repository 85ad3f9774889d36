"""Follow a reference by quaternions about the shortest axis, with a limit of the rate on the way.

==============  ==============================================  =======================================
symbol          meaning                                         name in the code
==============  ==============================================  =======================================
v               vector part of the error's quaternion, c >= 0   now.quaternion[1:]
w_e             rate from the reference                         now.rate
k, d            stiffness 2 wn^2, damping 2 zeta wn             stiffness, damping
wn, zeta        frequency and damping of small errors           frequency, damping_ratio
L               d rate_limit, longest of k v + ki int v         most
==============  ==============================================  =======================================

    u = J (-sat_L(k v + ki int v) - d w_e) + w x (J w + h) + J (w_r' - w x w_r)

Gains that are multiples of J turn the body about the error's own axis, and sat_L, which shortens the vector and
keeps its direction, lets it coast about that axis at the rate L/d. Sampled or not, the integral stands still while the
limit is reached.

Source: Wie, Weiss, Arapostathis (1989), doi:10.2514/3.20418; Wie and Lu (1995), doi:10.2514/3.21555, whose
saturation is taken on the length here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.laws._law import Law, gain
from casadi_gnc.laws.attitude_tracking import feed_forward, tracking_signals, whole_momentum
from casadi_gnc.laws.efforts import TORQUE
from casadi_gnc.mathematics.exact import is_zero
from casadi_gnc.mechanics.rigid_body import RigidBody
from casadi_gnc.signals import Layout, Signal


@dataclass(frozen=True, eq=False)
class QuaternionFeedback(Law):
    """Turn the quaternion from the reference to one; `body` is what the software believes of the craft."""

    body: RigidBody
    frequency: Any = gain("rad/s", "of small errors", symbol="wn", above=0.0)
    damping_ratio: Any = gain("-", "of small errors", symbol="zeta", above=0.0, default=0.7)
    integral_rate: Any = gain("1/s", "inverse time of the integral; 0: none", minimum=0.0, default=0.0)
    rate_limit: Any = gain("rad/s", "about the error's axis on the way", above=0.0, default=0.1)

    effort = TORQUE

    @classmethod
    def reads(cls, belief: RigidBody) -> Layout:
        """Return attitude and rates; the wheel speeds too where the body carries wheels."""
        return tracking_signals(belief, "quaternion")

    @property
    def inputs(self) -> Layout:  # type: ignore[override]
        """What the law reads on its own body."""
        return self.reads(self.body)

    @property
    def memory(self) -> Layout:  # type: ignore[override]
        """The integral of the vector part, where there is one."""
        return Layout() if is_zero(self.integral_rate) else Layout((Signal("integral", 3, "s"),))

    @property
    def damping(self) -> Any:
        """d, [1/s]."""
        return 2 * self.damping_ratio * self.frequency

    def pull(self, now: Any, m: Any) -> tuple[Any, Any]:
        """Return sat_L(k v + ki int v), (3,), [rad/s^2], and whether the limit is reached."""
        stiffness = 2 * self.frequency * self.frequency
        asked = stiffness * now.quaternion[1:]
        if self.memory.size:
            asked = asked + stiffness * self.integral_rate * self.memory.split(m).integral
        most, square = self.damping * self.rate_limit, ca.sumsqr(asked)
        beyond = square > most * most
        return asked * ca.if_else(beyond, most / ca.sqrt(ca.if_else(beyond, square, 1.0)), 1.0), beyond

    def command(self, t: Any, y: Any, m: Any) -> Any:
        """Return u, (3,), [N m]."""
        now = self.inputs.split(y)
        wanted = -self.pull(now, m)[0] - self.damping * now.rate
        turning = ca.cross(now.body_rate, whole_momentum(self.body, now))
        return ca.mtimes(self.body.inertia, wanted) + turning + feed_forward(self.body, now)

    def rate(self, t: Any, y: Any, m: Any, wanted: Any, achieved: Any) -> Any:
        """Return the vector part, or nothing at the limit."""
        if not self.memory.size:
            return ca.DM.zeros(0, 1)
        now = self.inputs.split(y)
        return self.memory.pack(integral=ca.if_else(self.pull(now, m)[1], 0.0, now.quaternion[1:]))
