"""Turn no faster than can be stopped before the target.

From the attitude error |s| (MRPs, so an angle of 4|s|) a deceleration a stops a rate of
sqrt(2 a 4|s|). The commanded rate is bent below that, its direction kept so that the path stays
straight:

    w = v / sqrt(1 + v'v / w_max^2),      w_max^2 = share 8 a sqrt(s's + floor^2).

`share` below 1 keeps torque for everything else; `floor` keeps the limit off zero at the target.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca


@dataclass(frozen=True, eq=False)
class BrakingLimiter:
    """Limit a rate command.

    Parameters
    ----------
    deceleration : a, [rad/s^2], that the actuators can make about any axis.
    share : of it to plan with, (0, 1].
    floor : MRP at which the limit stops shrinking, [-].
    """

    deceleration: Any
    share: Any
    floor: Any

    def limit(self, s: Any, rate: Any) -> Any:
        """Return the bent rate command, (3,), [rad/s]."""
        largest = self.share * 8 * self.deceleration * ca.sqrt(ca.sumsqr(s) + self.floor**2)
        return rate / ca.sqrt(1 + ca.sumsqr(rate) / largest)
