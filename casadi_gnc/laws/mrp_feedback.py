"""Follow a reference by MRPs: proportional, integral and derivative feedback with all that is known fed forward.

==============  ==================================================  ======================
symbol          meaning                                             name in the code
==============  ==================================================  ======================
sigma, w_e      attitude and rate from the reference                now.mrp, now.rate
w, w_r          rate of body and reference, body axes               now.body_rate, ...
K, P, Ki        gains                                               attitude_gain, rate_gain, integral_gain
z               K int sigma dt + J w_e                              total
==============  ==================================================  ======================

    u = -K sigma - P w_e - P Ki z + (w_r + Ki z) x (J w + h) + J (w_r' - w x w_r)

With Ki = 0 it is globally stable but for the half turn's two sets; the product with w_r instead of w keeps what makes
no work out of the proof. The integral keeps each of its elements within `integral_limit`.

Source: Schaub and Junkins, Analytical Mechanics of Space Systems, section 8.4.1, doi:10.2514/4.105210; the module
`mrpFeedback` of Basilisk is the same law.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.laws._law import Law, gain, option
from casadi_gnc.laws.attitude_tracking import feed_forward, tracking_signals, whole_momentum
from casadi_gnc.laws.efforts import TORQUE
from casadi_gnc.mathematics import bounds
from casadi_gnc.mathematics.exact import is_zero
from casadi_gnc.mechanics.rigid_body import RigidBody
from casadi_gnc.signals import Layout, Signal


@dataclass(frozen=True, eq=False)
class MrpFeedback(Law):
    """Turn the MRPs from the reference to zero; `body` is what the software believes of the craft."""

    body: RigidBody
    attitude_gain: Any = gain("N m", "torque per MRP", symbol="K", above=0.0)
    rate_gain: Any = gain("N m s/rad", "torque per rate", symbol="P", above=0.0)
    integral_gain: Any = gain("1/(N m s^2)", "of the integral; 0: none", symbol="Ki", minimum=0.0, default=0.0)
    integral_limit: Any = gain("N m s", "of each element of the integral", above=0.0, default=1e3)
    compensation: str = option("rate in the gyroscopic torque", "reference", "body", default="reference")

    effort = TORQUE

    @classmethod
    def reads(cls, belief: RigidBody) -> Layout:
        """Return attitude and rates; the wheel speeds too where the body carries wheels."""
        return tracking_signals(belief, "mrp")

    @property
    def inputs(self) -> Layout:  # type: ignore[override]
        """What the law reads on its own body."""
        return self.reads(self.body)

    @property
    def memory(self) -> Layout:  # type: ignore[override]
        """K times the integral of the MRPs, where there is an integral gain."""
        return Layout() if is_zero(self.integral_gain) else Layout((Signal("integral", 3, "N m s"),))

    def command(self, t: Any, y: Any, m: Any) -> Any:
        """Return u, (3,), [N m]."""
        now = self.inputs.split(y)
        torque = -self.attitude_gain * now.mrp - self.rate_gain * now.rate
        turning = now.reference_rate if self.compensation == "reference" else now.body_rate
        if self.memory.size:
            integral = bounds.clip(self.memory.split(m).integral, -self.integral_limit, self.integral_limit)
            total = self.integral_gain * (integral + ca.mtimes(self.body.inertia, now.rate))
            torque = torque - self.rate_gain * total
            turning = turning + total if self.compensation == "reference" else turning
        return torque + ca.cross(turning, whole_momentum(self.body, now)) + feed_forward(self.body, now)

    def rate(self, t: Any, y: Any, m: Any, wanted: Any, achieved: Any) -> Any:
        """Return K sigma; beyond the limit only what leads back."""
        if not self.memory.size:
            return ca.DM.zeros(0, 1)
        integral, push = self.memory.split(m).integral, self.attitude_gain * self.inputs.split(y).mrp
        outward = ca.logic_and(ca.fabs(integral) >= self.integral_limit, integral * push > 0)
        return self.memory.pack(integral=ca.if_else(outward, 0.0, push))
