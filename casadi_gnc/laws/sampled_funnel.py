"""How narrow a funnel a sampled law can keep, from the poles of its loop at rest in a funnel of constant width.

In a funnel of half width rho the transformed error pulls with the stiffness (pi/(2 rho))^2, so the
loop swings at a frequency that grows as 1/rho, while the damping that the law adds does not grow:
the filter of the virtual control follows too late. A command held for h takes away some h/2 times
the swing's square. With rho = 1 mm and 20 kg that leaves 1.6 us.

One sample of the loop is the law's own command and memory, differentiated at rest, around the
plant e' = B u, M u' = effort, which is exact under a held effort. Estimates that nothing excites at
rest are left out, and so is what the adapted bound adds: it damps, so the answer is strict by a
little. (In the funnels of Tao, Zhang 2019, of 1 mm, 10 us still work and 20 us swing.)
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from functools import cached_property
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from casadi_gnc.checks import Check
from casadi_gnc.laws.performance_funnel import PerformanceFunnel
from casadi_gnc.laws.sampling import advance

if TYPE_CHECKING:
    from casadi_gnc.laws.drag_free import DragFree

#: Shortest hold [s] that is looked at.
SHORTEST = 1e-8
#: Ratio of neighbouring widths that are looked at.
_STEP = 1.03
#: Ratio to which a longest hold or a narrowest width is refined.
_FINE = 1.001
_SIGNALS = {"attitude": ("mrp", "rate", "-"), "position": ("position", "velocity", "m")}


@dataclass(frozen=True, eq=False)
class SampledFunnel:
    """Analyse one motion of a sampled law; `part` is "attitude" or "position"."""

    law: DragFree
    part: str

    @property
    def funnel(self) -> PerformanceFunnel:
        """The funnel of the motion."""
        return getattr(self.law, f"{self.part}_funnel")

    @property
    def floor(self) -> float:
        """Narrowest last half width of the axes."""
        return float(np.array(ca.DM(self.funnel.floor)).min())

    def _linear(self) -> list[int]:
        """Return the rows of the memory that take part in a linear loop at rest."""
        handling = self.law.torque_saturation if self.part == "attitude" else self.law.force_saturation
        names = ("filtered", "filtered_rate") + (() if handling == "none" else ("error_shift", "rate_shift"))
        layout = self.law.memory
        return [row for name in names for row in range(layout.size)[layout.place(f"{self.part}_{name}")]]

    @cached_property
    def _sample(self) -> ca.Function:
        """(half width, hold) -> one sample of the loop, linearised at rest, (n, n)."""
        width, hold = ca.SX.sym("width"), ca.SX.sym("hold")
        still = replace(self.funnel, start=width * ca.DM.ones(3), floor=width * ca.DM.ones(3), decay=ca.DM.zeros(3))
        narrowed: dict[str, Any] = {f"{self.part}_funnel": still, "hold": hold}
        law = replace(self.law, **narrowed)
        y, m = law.inputs.symbol("y"), law.memory.symbol("m")
        wanted, attitude = law.command(0.0, y, m), self.part == "attitude"
        motion, effort = law.motions(y)[0 if attitude else 1], wanted[3:] if attitude else wanted[:3]
        inertia = ca.DM(law.body.inertia) if attitude else law.body.mass * ca.DM.eye(3)
        turning, pulled = ca.solve(inertia, effort), ca.SX.sym("pulled", 3)
        kinematic = ca.jacobian(motion.transposed(pulled), pulled).T
        way = ca.mtimes(kinematic, hold * motion.rate + hold**2 / 2 * turning)
        kept = self._linear()
        later = ca.vertcat(way, hold * turning, advance(law, 0.0, y, m, wanted, wanted)[kept])
        rows = [row for name in _SIGNALS[self.part][:2] for row in range(law.inputs.size)[law.inputs.place(name)]]
        slope = ca.horzcat(ca.jacobian(later, y)[:, rows], ca.jacobian(later, m)[:, kept])
        slope += ca.diagcat(ca.DM.eye(6), ca.DM.zeros(len(kept), len(kept)))
        middle = ca.SX.zeros(law.inputs.size)
        middle[law.inputs.place(_SIGNALS[self.part][0])] = width * (still.above - still.below) / 2
        rest = ca.vertcat(middle, law.start(0.0, middle))
        return ca.Function("sample", [width, hold], [ca.substitute(slope, ca.vertcat(y, m), rest)])

    def growth(self, width: float, hold: float) -> float:
        """Return the growth of the fastest growing mode, [1/s]; the loop is stable where it is negative."""
        eigenvalues = np.linalg.eigvals(np.array(self._sample(width, hold)))
        return float(np.log(np.abs(eigenvalues).max()) / hold)

    def longest_hold(self, width: float) -> float:
        """Return the longest stable hold [s] up to the law's own in a funnel so wide; 0 if there is none."""
        low, high = SHORTEST, self.law.hold
        if self.growth(width, high) < 0:
            return high
        if self.growth(width, low) >= 0:
            return 0.0
        while high > _FINE * low:
            middle = (low * high) ** 0.5
            low, high = (middle, high) if self.growth(width, middle) < 0 else (low, middle)
        return low

    def narrowest(self) -> float:
        """Return the least half width such that the loop is stable in it and in all wider ones up to the start's.

        It is infinite where even the start is too narrow.
        """
        high = float(np.array(ca.DM(self.funnel.start)).max())
        if self.growth(high, self.law.hold) >= 0:
            return float("inf")
        low = high / _STEP
        while self.growth(low, self.law.hold) < 0 and low > 1e-6 * self.floor:
            low, high = low / _STEP, low
        while high > _FINE * low:
            middle = (low * high) ** 0.5
            low, high = (low, middle) if self.growth(middle, self.law.hold) < 0 else (middle, high)
        return high

    def checks(self) -> Iterator[Check]:
        """Yield whether the last width can be kept at the law's sample period, and which one could be."""
        floor, hold = self.floor, self.law.hold
        stable = self.growth(floor, hold) < 0
        narrowest = min(self.narrowest(), floor) if stable else self.narrowest()
        longest = hold if stable else self.longest_hold(floor)
        unit = _SIGNALS[self.part][2]
        wide = f"widen its floor to {_rounded(narrowest, ROUND_CEILING)} {unit}".rstrip(" -")
        remedies = [wide] if np.isfinite(narrowest) else []
        remedies += [f"sample every {_rounded(longest, ROUND_FLOOR)} s"] if longest else []
        yield Check(
            f"sampling.{self.part}_funnel",
            floor,
            narrowest,
            unit,
            "warn",
            f"Sampled every {hold:g} s the {self.part} is not stable in a funnel of {floor:g}"
            f"{'' if unit == '-' else ' ' + unit}; at rest it grows by {self.growth(floor, hold):.3g} 1/s.",
            f"{' or '.join(remedies).capitalize()}." if remedies else "Lower the gains or raise filter_frequency.",
            "poles of the sampled loop at rest in the funnel's last width",
            at_least=True,
        )


def _rounded(value: float, way: str) -> str:
    """Return three digits of a limit, rounded to the safe side."""
    return f"{float(Context(prec=3, rounding=way).create_decimal(value)):g}"
