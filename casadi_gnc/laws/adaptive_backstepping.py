"""Adaptive backstepping with prescribed performance, for any motion of the form

    e' = B u + c,        M(theta) u' = h(theta) + effort + disturbance,

whose M and h are linear in unknown constants theta. Attitude and position are two such motions.

==========  ==========================================  ===================================
symbol      meaning                                     name in the code
==========  ==========================================  ===================================
e, u        tracked error, its rate variable, (3,)      motion.error, motion.rate
chi, r, v   transformed error, slope, drift             transform
xi1, xi2    shifts by saturation                        memory.error_shift, .rate_shift
x1, x2      chi - xi1,  u - a                           now.x1, now.x2
a           virtual control with xi2 cancelled          now.target
q1, q2      filtered a - xi2, its rate                  memory.filtered, .filtered_rate
theta^      estimated constants, used inside their box  memory.estimate
eta         estimated bound of the disturbance, (3,)    memory.bound
==========  ==========================================  ===================================

    B a + c = -v - (K1 x1 + Ks1 xi1 - Ks21 xi2)/r                                     (31), (69)
    effort = -B' r x1 - K2 x2 - H theta^ - tanh(x2/eps) eta - auxiliary               (42), (77)
    theta^' = Proj(Gamma (H - H4)' x2),    H4 theta = M(theta) xi2'                   (43), (78)

H theta is M u' + (parts that do no work on x2) as it would be at u = a, u' = q2, less the effort:
`motion.feed_forward`. The paper's virtual control is a - xi2, and x2 = u - (a - xi2) - xi2 is free
of xi2 but for Ks21. The columns of H come from H theta at unit vectors: one text for both.

Nothing closes an algebraic loop: the missing effort drives only xi2' and theta^'.

Source: Tao, Zhang (2019), section 2, doi:10.16356/j.1005-1120.2019.04.008.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, Protocol

import casadi as ca

from casadi_gnc.laws.adaptive_bound import AdaptiveBound
from casadi_gnc.laws.auxiliary_saturation import AuxiliarySaturation, NoAuxiliary
from casadi_gnc.laws.projection import Projection
from casadi_gnc.laws.second_order_filter import SecondOrderFilter
from casadi_gnc.laws.tan_transform import PlainError, TanTransform
from casadi_gnc.signals import Layout, Signal


class Motion(Protocol):
    """What the law needs to know of a motion, at one measurement."""

    @property
    def error(self) -> Any:
        """Return e, (3,)."""
        ...

    @property
    def rate(self) -> Any:
        """Return u, (3,)."""
        ...

    def rate_for(self, error_rate: Any) -> Any:
        """Return the u that makes e' = error_rate, (3,)."""
        ...

    def transposed(self, vector: Any) -> Any:
        """Return B' vector, (3,)."""
        ...

    def inertia(self, estimate: Any) -> Any:
        """Return M(theta), (3, 3) or a scalar; linear in theta."""
        ...

    def divided(self, estimate: Any, effort: Any) -> Any:
        """Return M(theta)^-1 effort, (3,)."""
        ...

    def feed_forward(self, estimate: Any, target: Any, target_rate: Any) -> Any:
        """Return H theta, (3,), unit of the effort; linear in theta."""
        ...


def memory_layout(prefix: str, estimates: int, rate_unit: str, estimate_unit: str, effort_unit: str) -> Layout:
    """Return the memory of one motion, its names beginning with `prefix`."""
    return Layout(
        (
            Signal(f"{prefix}error_shift", 3, "-"),
            Signal(f"{prefix}rate_shift", 3, rate_unit),
            Signal(f"{prefix}filtered", 3, rate_unit),
            Signal(f"{prefix}filtered_rate", 3, f"{rate_unit}^2"),
            Signal(f"{prefix}estimate", estimates, estimate_unit),
            Signal(f"{prefix}bound", 3, effort_unit),
            Signal(f"{prefix}gain", 1, "-"),
        )
    )


@dataclass(frozen=True, eq=False)
class AdaptiveBackstepping:
    """Control one motion.

    Parameters
    ----------
    error_gain, rate_gain : K1 [1/s], K2 [effort per rate].
    adaptation : Gamma of theta^.
    transform, filter, bound, projection, auxiliary : the parts; see their files.
    filter_from_zero, whole_regressor, plain_unloading, dynamic_leakage : errata to keep as printed
        (see `casadi_gnc.laws.drag_free`).
    """

    error_gain: Any
    rate_gain: Any
    adaptation: Any
    transform: TanTransform | PlainError
    filter: SecondOrderFilter
    bound: AdaptiveBound
    projection: Projection
    auxiliary: AuxiliarySaturation | NoAuxiliary
    filter_from_zero: bool = False
    whole_regressor: bool = False
    plain_unloading: bool = False
    dynamic_leakage: bool = False

    @property
    def memory(self) -> Layout:
        """Memory without prefix and units."""
        return memory_layout("", self.projection.size, "", "", "")

    def errors(self, t: Any, motion: Motion, memory: Any) -> SimpleNamespace:
        """Return slope r, errors x1 and x2, and target a, (3,) each."""
        slope = self.transform.slope(t, motion.error)
        x1 = self.transform.error(t, motion.error) - memory.error_shift
        pull = (self.error_gain * x1 + self.auxiliary.pull(memory)) / slope
        target = motion.rate_for(-self.transform.drift(t, motion.error) - pull)
        return SimpleNamespace(slope=slope, x1=x1, x2=motion.rate - target, target=target)

    def start(self, t: Any, motion: Motion, estimate: Any) -> Any:
        """Return the first memory: the filter on its target, no shift, no disturbance known."""
        still: dict[str, Any] = {
            name: ca.DM.zeros(3) for name in ("error_shift", "rate_shift", "filtered_rate", "bound")
        }
        first = self.errors(t, motion, SimpleNamespace(**still))
        filtered = ca.DM.zeros(3) if self.filter_from_zero else first.target
        return self.memory.pack(**still, filtered=filtered, estimate=estimate, gain=self.auxiliary.start)

    def command(self, t: Any, motion: Motion, m: Any) -> Any:
        """Return the wanted effort, (3,) (eqs 42 and 77)."""
        memory = self.memory.split(m)
        now = self.errors(t, motion, memory)
        estimate = self.projection.inside(memory.estimate)
        known = motion.feed_forward(estimate, now.target, memory.filtered_rate)
        unload = self.auxiliary.unload(memory)
        if self.plain_unloading and isinstance(self.auxiliary, AuxiliarySaturation):
            unload = self.auxiliary.unloading * memory.rate_shift
        wanted = -motion.transposed(now.slope * now.x1) - self.rate_gain * now.x2 - known
        return wanted - self.bound.effort(now.x2, memory.bound) - unload - self.auxiliary.damping(memory, now.x2)

    def rate(self, t: Any, motion: Motion, m: Any, missing: Any) -> Any:
        """Return the rate of the memory; `missing` is achieved less wanted effort, (3,)."""
        memory = self.memory.split(m)
        now = self.errors(t, motion, memory)
        shifting = self.auxiliary.counts(missing) - self.auxiliary.unload(memory)
        shift_rate = motion.divided(self.projection.inside(memory.estimate), shifting)
        filtered, filtered_rate = self.filter.rates(
            memory.filtered, memory.filtered_rate, now.target - memory.rate_shift
        )
        learned = self.adaptation * self._regression(motion, now, memory.filtered_rate, shift_rate)
        leakage = self.auxiliary.gain(memory) if self.dynamic_leakage else None
        return self.memory.pack(
            error_shift=-self.auxiliary.pull(memory),
            rate_shift=shift_rate,
            filtered=filtered,
            filtered_rate=filtered_rate,
            estimate=self.projection.rate(memory.estimate, learned),
            bound=self.bound.rate(now.x2, memory.bound, leakage),
            gain=self.auxiliary.gain_rate(memory, now.x2),
        )

    def _regression(self, motion: Motion, now: SimpleNamespace, target_rate: Any, shift_rate: Any) -> Any:
        """Return (H - H4)' x2, (p,)."""
        rows = []
        for i in range(self.projection.size):
            unit = ca.DM.zeros(self.projection.size)
            unit[i] = 1
            column = motion.feed_forward(unit, now.target, target_rate)
            if not self.whole_regressor:
                column -= ca.mtimes(motion.inertia(unit), shift_rate)
            rows.append(ca.dot(now.x2, column))
        return ca.vertcat(*rows)
