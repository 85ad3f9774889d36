"""Keep adapted parameters inside a box without a jump in their rate.

An outward rate fades to zero, linearly, over the last tenth of the box; an inward one is left
alone. With a diagonal adaptation gain this, element by element, is a projection in the sense of
Pomet and Praly (1992): (estimate - true) (rate - projected rate) >= 0, which is what the proofs of
Tao, Zhang (2019) use in eqs (50) and (84), for every truth that is a tenth or more inside the box.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.errors import LawError
from casadi_gnc.mathematics import bounds, exact

#: Share of the box beside each wall over which an outward rate fades.
FADE = 0.1


@dataclass(frozen=True, eq=False)
class Projection:
    """Confine a vector of estimates to lower <= estimate <= upper, (n,) each, lower < upper."""

    lower: Any
    upper: Any

    @property
    def size(self) -> int:
        """Return n."""
        return ca.vec(self.lower).numel()

    def inside(self, estimate: Any) -> Any:
        """Return the estimate moved into the box: what a step of finite length overshot is not used."""
        return bounds.clip(estimate, self.lower, self.upper)

    def rate(self, estimate: Any, rate: Any) -> Any:
        """Return the projected rate, (n,)."""
        room = bounds.minimum(self.upper - estimate, estimate - self.lower) / (FADE * (self.upper - self.lower))
        # The nearer wall is the one that an outward rate leads to, or the rate is not outward.
        outward = (estimate - (self.lower + self.upper) / 2) * rate > 0
        return ca.if_else(outward, rate * bounds.clip(room, 0.0, 1.0), rate)

    def covers(self) -> tuple[Any, Any]:
        """Return between which ends, (n,) each, a truth must lie for the proofs: a tenth inside the box."""
        room = FADE * (self.upper - self.lower)
        return self.lower + room, self.upper - room

    def check(self, start: Any, name: str) -> None:
        """Raise `LawError` for an empty box, or one that `start` lies outside of; symbols pass."""
        if not all(map(exact.is_number, (self.lower, self.upper, start))):
            return
        rows = zip(*(np.array(ca.DM(part)).ravel() for part in (self.lower, start, self.upper)), strict=True)
        for i, (low, value, high) in enumerate(rows, 1):
            if not low < high:
                raise LawError(f"the box of {name}, element {i}, is [{low:g}, {high:g}]; its lower end must be lower")
            if not low <= value <= high:
                raise LawError(
                    f"{name}, element {i}, starts at {value:g}, outside its box [{low:g}, {high:g}]; widen the box"
                )


def inertia_box(least: Any, largest: Any, product: Any) -> Projection:
    """Return a box for (J11, J22, J33, J12, J13, J23) in which every inertia is positive definite.

    Parameters
    ----------
    least, largest : bounds of the moments of inertia, [kg m^2].
    product : largest magnitude of a product of inertia, [kg m^2].

    Raises
    ------
    LawError
        Where the box holds a matrix that is not diagonally dominant, for which nothing keeps it
        from being singular.
    """
    if exact.is_number(least) and exact.is_number(product) and not float(least) > 2 * float(product) > 0:
        raise LawError(
            f"the box of the inertia allows a singular one: the least moment is {float(least):g} kg m^2, and "
            f"two products together can be {2 * float(product):g} kg m^2; raise the moment above that"
        )
    return Projection(ca.vertcat(*[least] * 3, *[-product] * 3), ca.vertcat(*[largest] * 3, *[product] * 3))
