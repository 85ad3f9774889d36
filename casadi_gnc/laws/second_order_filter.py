"""Follow a signal by a damped oscillator, whose second state is the followed signal's rate.

    q1' = q2,     q2' = -2 zeta w q2 - w^2 (q1 - target)                               (14), (15)

In backstepping q2 stands for the rate of a virtual control that nobody wants to differentiate by
hand (Tao, Zhang 2019, doi:10.16356/j.1005-1120.2019.04.008, after Farrell et al. 2009). Started at
q1 = 0 instead of on its target, it reports a rate that is not there: the first quarter of a period
of the paper's manoeuvre then asks for some 140 N m instead of 4 N m.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, eq=False)
class SecondOrderFilter:
    """Filter a vector; `frequency` is w, [rad/s], `damping` is zeta, [-]."""

    frequency: Any
    damping: Any

    def rates(self, value: Any, rate: Any, target: Any) -> tuple[Any, Any]:
        """Return q1' and q2' at q1 = value, q2 = rate."""
        pull = self.frequency**2 * (value - target)
        return rate, -2 * self.damping * self.frequency * rate - pull
