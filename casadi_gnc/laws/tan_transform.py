"""Make a funnel endless by the tangent, and the same interface without a funnel.

With the place in the funnel lambda = e/rho, `below` and `above` the shares of rho allowed,

    place = (lambda - (above - below)/2) / half,     half = (above + below)/2         (18), (56)
    chi = tan(pi/2 place)                                                             (21), (59)
    chi' = r (e' + v),   r = pi/(2 half rho) (1 + chi^2),   v = -lambda rho'          (23), (61)

chi is infinite on the walls, and zero in the middle between them. Beyond a wall the tangent changes
its sign; lambda is therefore held inside as `PerformanceFunnel.position` holds it, everything stays
finite and pushes inward, and `PerformanceFunnel.left` tells.

Source: Tao, Zhang (2019), section 2, doi:10.16356/j.1005-1120.2019.04.008.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.laws.performance_funnel import PerformanceFunnel


@dataclass(frozen=True, eq=False)
class TanTransform:
    """Transform an error, element by element, by the tangent of its place in `funnel`."""

    funnel: PerformanceFunnel

    @property
    def half(self) -> Any:
        """Return half the distance of the walls as a share of rho, (n,), [-]."""
        return (self.funnel.above + self.funnel.below) / 2

    def error(self, t: Any, e: Any) -> Any:
        """Return chi, (n,), [-]."""
        middle = (self.funnel.above - self.funnel.below) / 2
        return ca.tan(math.pi / 2 * ((self.funnel.position(t, e) - middle) / self.half))

    def slope(self, t: Any, e: Any) -> Any:
        """Return r = d chi/de, (n,), positive, one over the unit of e."""
        return math.pi / 2 / (self.half * self.funnel.width(t)) * (1 + self.error(t, e) ** 2)

    def drift(self, t: Any, e: Any) -> Any:
        """Return v, (n,), unit of e per second: what the narrowing does."""
        return -self.funnel.position(t, e) * self.funnel.width_rate(t)


@dataclass(frozen=True, eq=False)
class PlainError:
    """Take the error itself, chi = e, r = 1, v = 0: the same law without prescribed performance."""

    def error(self, t: Any, e: Any) -> Any:
        """Return e."""
        return e

    def slope(self, t: Any, e: Any) -> Any:
        """Return ones, (n,)."""
        return ca.DM.ones(e.numel())

    def drift(self, t: Any, e: Any) -> Any:
        """Return zeros, (n,)."""
        return ca.DM.zeros(e.numel())
