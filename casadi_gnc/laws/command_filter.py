"""Follow a signal by a first-order lag, whose rate is then known without differentiation.

    x' = (target - x) / time_constant                                                  (32)

This is the dynamic surface of the method's name (Huang, Biggs, Duan 2020). With `max_rate` the
rate is bent so that its 2-norm stays below a_max and its direction is kept,

    x' = y / sqrt(1 + |y|^2 / a_max^2),      y = (target - x) / time_constant,

so that a craft with little torque is never asked to accelerate faster than it can.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca


@dataclass(frozen=True, eq=False)
class CommandFilter:
    """Lag a vector; `time_constant` is tau, [s], `max_rate` bounds the norm of the rate."""

    time_constant: Any
    max_rate: Any = None

    def rate(self, x: Any, target: Any) -> Any:
        """Return x'."""
        rate = (target - x) / self.time_constant
        if self.max_rate is None:
            return rate
        return rate / ca.sqrt(1 + ca.sumsqr(rate) / self.max_rate**2)
