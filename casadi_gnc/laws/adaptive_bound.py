"""Learn how strong a disturbance can be, and push against it.

With the velocity error x2 and the estimate eta of the disturbance's largest magnitude, by axis,

    effort = -tanh(x2/eps) eta,     eta' = Gamma (tanh(x2/eps) x2 - lambda eta)        (42), (43)

eta/eps acts as damping while |x2| < eps. Without the leakage lambda noise lets eta grow for ever.

Source: Tao, Zhang (2019), doi:10.16356/j.1005-1120.2019.04.008. The paper uses one name for lambda,
a constant of Table 1, and for the gain of the auxiliary system, a state.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca


@dataclass(frozen=True, eq=False)
class AdaptiveBound:
    """Estimate a bound.

    Parameters
    ----------
    adaptation : Gamma.
    leakage : lambda, [-].
    layer : eps, unit of the velocity error.
    """

    adaptation: Any
    leakage: Any
    layer: Any

    def effort(self, x2: Any, eta: Any) -> Any:
        """Return tanh(x2/eps) eta, (n,), unit of the effort: to be subtracted."""
        return ca.tanh(x2 / self.layer) * eta

    def rate(self, x2: Any, eta: Any, leakage: Any = None) -> Any:
        """Return eta'; `leakage` takes the place of lambda if given."""
        leak = self.leakage if leakage is None else leakage
        return self.adaptation * (ca.tanh(x2 / self.layer) * x2 - leak * eta)
