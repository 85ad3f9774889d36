"""Estimate what pushes a measured quantity besides what is known.

For p' = known + d with p measured, `known` computable and d slow, the estimate d^ = z + L p with
z' = -beta (d^ + known) obeys d^' = beta (d - d^) when L = beta: one pole at -beta, no derivative
of p needed (Huang, Biggs, Duan 2020, eqs 39 and 44; Chen et al. 2004).

Sampled every h seconds, p ramps while z is advanced. Taking p as held makes the estimate wrong by
a factor that grows with beta h (2.9 at beta h = 2.7) and the loop never settles. The feed-through

    L = (1 - e^(-beta h)) / h

repairs it: with d and `known` constant over the hold, p moves by h (known + d), z by
-(1 - e^(-beta h)) (d^ + known), hence d^ - d shrinks by exactly e^(-beta h) a sample, for any
beta h. As h -> 0 the feed-through returns to beta.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from casadi_gnc.mathematics import exact


@dataclass(frozen=True, eq=False)
class DisturbanceObserver:
    """Observe a disturbance, element by element.

    Parameters
    ----------
    gain : beta, [1/s].
    hold : sample period h [s]; 0 means continuous.
    """

    gain: Any
    hold: float = 0.0

    @property
    def through(self) -> Any:
        """L, [1/s]: what the measurement adds to the estimate at once."""
        if self.hold == 0:
            return self.gain
        return self.gain * exact.phi1(-self.gain * self.hold)

    def start(self, p: Any) -> Any:
        """Return the z that makes the first estimate zero.

        z = 0 instead claims a disturbance L p that is not there.
        """
        return -self.through * p

    def estimate(self, z: Any, p: Any) -> Any:
        """Return d^, unit of p per second."""
        return z + self.through * p

    def rate(self, z: Any, p: Any, known: Any) -> Any:
        """Return z'."""
        return -self.gain * (self.estimate(z, p) + known)
