"""Rate damping u = -k2 omega: the baseline of Huang, Biggs, Duan (2020), section 5.1.

The paper's text and figures call it PD; it is the proportional law on the rate.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from casadi_gnc.laws._law import Law, gain
from casadi_gnc.laws.efforts import TORQUE
from casadi_gnc.mechanics.rigid_body import RigidBody
from casadi_gnc.signals import Layout, Signal


@dataclass(frozen=True, eq=False)
class RateDamping(Law):
    """Damp the rate: a torque against it.

    `body` is not needed and accepted so that all laws are built alike.
    """

    body: RigidBody
    rate_gain: Any = gain("N m s/rad", "torque per rate", symbol="k2", above=0.0)

    effort = TORQUE
    inputs = Layout((Signal("rate", 3, "rad/s"),))

    def command(self, t: Any, y: Any, m: Any) -> Any:
        """Return u = -k2 omega."""
        return -self.rate_gain * self.inputs.split(y).rate
