"""Prescribed performance: a funnel that narrows in time, and the coordinate in which it is endless.

    rho(t) = (start - floor) e^(-decay t) + floor
    -below rho(t) < s(t) < above rho(t)                                                (24)

With lambda = s/rho, the transformed error

    e = 1/2 ln((below + lambda)/(above - lambda)) - 1/2 ln(below/above)                (26), (29)

is zero at s = 0 and infinite on the funnel's wall, and e' = r (s' - lambda rho') with

    r = 1/(2 rho) (1/(lambda + below) + 1/(above - lambda)).                           (28)

Source: Huang, Biggs, Duan (2020), section 3.1, doi:10.1016/j.ast.2019.105572, after Bechlioulis
and Rovithakis (2008). The paper's transform is undefined outside the funnel; here lambda is held
`GUARD` inside the wall, so that everything stays finite, and `left` tells.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.mathematics import bounds, exact

#: Share of the funnel's half width beside the wall in which lambda is held.
GUARD = 1e-3


@dataclass(frozen=True, eq=False)
class PerformanceFunnel:
    """Bound each element of a tracked signal.

    Parameters
    ----------
    start, floor : half width at t = 0 and for t -> infinity, (n,), unit of the signal.
    decay : narrowing, (n,), [1/s].
    below, above : share of the half width allowed below and above zero, (n,), [-].
    """

    start: Any
    floor: Any
    decay: Any
    below: Any
    above: Any

    def width(self, t: Any) -> Any:
        """Return rho(t), (n,)."""
        return (self.start - self.floor) * ca.exp(-self.decay * t) + self.floor

    def width_rate(self, t: Any) -> Any:
        """Return rho'(t), (n,)."""
        return -self.decay * (self.start - self.floor) * ca.exp(-self.decay * t)

    def walls(self, t: Any) -> tuple[Any, Any]:
        """Return lower and upper wall, (n,) each."""
        width = self.width(t)
        return -self.below * width, self.above * width

    def left(self, t: Any, s: Any) -> Any:
        """Return 1 where the signal is outside on any axis."""
        lower, upper = self.walls(t)
        return ca.logic_not(bounds.all_of(ca.logic_and(s > lower, s < upper)))

    def position(self, t: Any, s: Any) -> Any:
        """Return lambda = s/rho, (n,), held inside the walls."""
        return bounds.clip(s / self.width(t), -(1 - GUARD) * self.below, (1 - GUARD) * self.above)

    def error(self, t: Any, s: Any) -> Any:
        """Return the transformed error e, (n,), zero at s = 0 (eqs 26 and 29)."""
        place = self.position(t, s)
        return (ca.log((self.below + place) / (self.above - place)) - exact.log(self.below / self.above)) / 2

    def spread(self, t: Any, s: Any) -> Any:
        """Return 1/r = ds/de, (n,), positive and bounded (eq. 28): r itself grows without limit."""
        place = self.position(t, s)
        return 2 * self.width(t) * (place + self.below) * (self.above - place) / (self.below + self.above)

    def use(self, t: Any, s: Any) -> Any:
        """Return the largest share of the way to a wall, over the axes: below 1 is inside."""
        return bounds.largest(self.use_by_axis(t, s))

    def use_by_axis(self, t: Any, s: Any) -> Any:
        """Return the share of the way to the nearer wall, (n,)."""
        lower, upper = self.walls(t)
        return bounds.maximum(s / upper, s / lower)
