"""Attitude PD law u = -k_sigma sigma - k_omega omega: the baseline of the slew in Huang, Biggs,
Duan (2020), section 5.2, whose gains are not printed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from casadi_gnc.laws._law import Law, gain
from casadi_gnc.laws.efforts import TORQUE
from casadi_gnc.mechanics.rigid_body import RigidBody
from casadi_gnc.signals import Layout, Signal


@dataclass(frozen=True, eq=False)
class AttitudePD(Law):
    """Turn the MRPs to zero by proportional and derivative control.

    `body` is not needed and accepted so that all laws are built alike.
    """

    body: RigidBody
    attitude_gain: Any = gain("N m", "torque per MRP", symbol="k_sigma", above=0.0)
    rate_gain: Any = gain("N m s/rad", "torque per rate", symbol="k_omega", above=0.0)

    effort = TORQUE
    inputs = Layout((Signal("mrp", 3, "-"), Signal("rate", 3, "rad/s")))

    def command(self, t: Any, y: Any, m: Any) -> Any:
        """Return u = -k_sigma sigma - k_omega omega."""
        now = self.inputs.split(y)
        return -self.attitude_gain * now.mrp - self.rate_gain * now.rate
