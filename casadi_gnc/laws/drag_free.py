"""Keep a satellite around its free-falling test mass, attitude and position inside funnels.

Attitude and position are two motions (`casadi_gnc.laws.drag_free_motions`) under one law
(`casadi_gnc.laws.adaptive_backstepping`, which has its equations); here they get their gains, the
measurement, and the satellite's force and torque. K1, K2 of the attitude are K3, K4 of the position.

Measured with the data of the paper, the auxiliary system against saturation helps in torque
(1.0 N m is enough, without it 1.5 N m are needed) and hurts in force (from 9.8 N down it leaves the
funnel that the clipped command keeps down to 7.2 N). Theorems 1 and 2 hold only while the missing
effort stays below K_sigma2 and K_p2. So the default is the auxiliary system in torque, none in force.

Source: Tao, Zhang (2019), section 2, doi:10.16356/j.1005-1120.2019.04.008.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.checks import Check
from casadi_gnc.errors import LawError
from casadi_gnc.laws._law import Law, gain, gains_of, option
from casadi_gnc.laws.adaptive_backstepping import AdaptiveBackstepping, memory_layout
from casadi_gnc.laws.adaptive_bound import AdaptiveBound
from casadi_gnc.laws.auxiliary_saturation import AuxiliarySaturation, NoAuxiliary
from casadi_gnc.laws.drag_free_motions import AttitudeMotion, PositionMotion, Satellite, inertia_elements
from casadi_gnc.laws.efforts import FORCE_AND_TORQUE
from casadi_gnc.laws.performance_funnel import PerformanceFunnel
from casadi_gnc.laws.projection import Projection, inertia_box
from casadi_gnc.laws.sampled_funnel import SampledFunnel
from casadi_gnc.laws.second_order_filter import SecondOrderFilter
from casadi_gnc.laws.tan_transform import PlainError, TanTransform
from casadi_gnc.mathematics import bounds, exact
from casadi_gnc.signals import Layout, Signal
from casadi_gnc.status import StepStatus

#: Printed b_sigma1 of Table 1.
PRINTED_THRESHOLD = 0.001
_ATTITUDE = memory_layout("attitude_", 6, "rad/s", "kg m^2", "N m")
_POSITION = memory_layout("position_", 1, "m/s", "kg", "N")


@dataclass(frozen=True, eq=False)
class DragFree(Law):
    """Keep a satellite around its free test mass, inside funnels, with mass and inertia adapted.

    `body` is what the software believes of the satellite.
    """

    body: Satellite
    attitude_funnel: PerformanceFunnel
    position_funnel: PerformanceFunnel
    prescribed_performance: Any = option("keep to the funnels; false: the same law on the plain errors", default=True)
    torque_saturation: Any = option(
        "shift the errors by missing torque", "auxiliary", "bounded", "none", default="auxiliary"
    )
    force_saturation: Any = option("shift the errors by missing force", "auxiliary", "bounded", "none", default="none")
    attitude_error_gain: Any = gain("1/s", "convergence of the transformed attitude", symbol="K_1", above=0.0)
    attitude_rate_gain: Any = gain("N m s/rad", "damping of the rate error", symbol="K_2", above=0.0)
    position_error_gain: Any = gain("1/s", "convergence of the transformed position", symbol="K_3", above=0.0)
    position_rate_gain: Any = gain("N s/m", "damping of the velocity error", symbol="K_4", above=0.0)
    filter_frequency: Any = gain("rad/s", "of the filters of the virtual controls", symbol="omega_n", above=0.0)
    filter_damping: Any = gain("-", "of the same", symbol="zeta", above=0.0)
    inertia_adaptation: Any = gain("-", "speed of the inertia estimate", symbol="Gamma_1", minimum=0.0)
    mass_adaptation: Any = gain("-", "speed of the mass estimate", symbol="gamma_3", minimum=0.0)
    bound_adaptation: Any = gain("-", "speed of both disturbance bounds", symbol="Gamma_2, Gamma_4", minimum=0.0)
    bound_leakage: Any = gain("-", "leak of both disturbance bounds", symbol="lambda", minimum=0.0)
    bound_layer: Any = gain("rad/s, m/s", "rate error up to which bounds damp", symbol="epsilon", above=0.0)
    moment_box: Any = gain("kg m^2", "least and largest moment of inertia", size=2, above=0.0)
    product_box: Any = gain("kg m^2", "largest product of inertia", above=0.0)
    mass_box: Any = gain("kg", "least and largest mass", size=2, above=0.0)
    shift_decay: Any = gain("1/s", "decay of the shift of the error", symbol="K_sigma1, K_p1", above=0.0, default=1.0)
    shift_coupling: Any = gain("s/rad, s/m", "rate shift in it", symbol="K_sigma21, K_p21", above=0.0, default=1.0)
    torque_unloading: Any = gain("N m", "torque that unloads the shift", symbol="K_sigma2", above=0.0, default=2.0)
    force_unloading: Any = gain("N", "force that unloads the shift", symbol="K_p2", above=0.0, default=2.0)
    counted_share: Any = gain("-", "of the unloading, that bounded shifts count", above=0.0, default=0.9)
    gain_growth: Any = gain("-", "growth of the auxiliary gain", symbol="b", above=0.0, default=0.001)
    gain_threshold: Any = gain("-", "decay of the auxiliary gain", symbol="b_1", above=0.0, default=0.75)
    gain_softness: Any = gain("-", "softness of the auxiliary gain", symbol="b_2", above=0.0, default=0.1)
    first_gain: Any = gain("-", "auxiliary gain at the start", symbol="k(0)", above=0.0, default=0.001)

    effort = FORCE_AND_TORQUE
    inputs = Layout(
        (
            Signal("mrp", 3, "-"),
            Signal("rate", 3, "rad/s"),
            Signal("position", 3, "m"),
            Signal("velocity", 3, "m/s"),
        )
    )
    memory = _ATTITUDE + _POSITION
    outputs = Layout(
        (
            Signal("attitude_use", 3, "-"),
            Signal("position_use", 3, "-"),
            Signal("attitude_shift", 3, "-"),
            Signal("position_shift", 3, "-"),
            Signal("inertia_estimate", 6, "kg m^2"),
            Signal("mass_estimate", 1, "kg"),
        )
    )
    funnels = {"attitude_funnel": "mrp", "position_funnel": "position"}
    errata = {
        "unloading_term": "(77) subtracts K_p2 xi_p2; only K_p2 tanh(xi_p2/2) cancels what (67) adds.",
        "adaptation_regressor": "(43) adapts with H_sigma; the proof, (48) and (50), needs H_sigma - H_sigma4.",
        "gain_threshold": "Table 1 prints b_sigma1 = 0.001, but the proof needs b_1 >= b_2 = 0.1.",
        "gain_singular": "(46) and (80) divide by k, which reaches zero; the square of k has a regular rate.",
        "leakage_gain": "(43) and (78) leak by the state k of (46) and (80); (53) and (87) need a constant.",
        "filter_start": "Filters that start at zero instead of on their target ask for 140 N m that nothing needs.",
    }
    #: Largest product of filter frequency and sample period: one Runge-Kutta step follows the filter.
    longest_hold = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        self._inertia_box().check(inertia_elements(self.body.inertia), "the believed inertia")
        self._mass_box().check(self.body.mass, "the believed mass")
        if exact.is_number(self.counted_share) and not self.counted_share < 1:
            raise LawError(f"counted_share is {self.counted_share:g}, expected a number between 0 and 1")
        numbers = exact.is_number(self.gain_threshold) and exact.is_number(self.gain_softness)
        if numbers and self.gain_threshold < self.gain_softness:
            raise LawError(
                f"gain_threshold is {self.gain_threshold:g}, less than gain_softness {self.gain_softness:g}; the proof "
                "needs it to be at least as large"
            )

    def check_hold(self) -> None:
        """Raise `LawError` if the sample period is too long for the filter."""
        if exact.is_number(self.filter_frequency) and self.hold * self.filter_frequency > self.longest_hold:
            raise LawError(
                f"a sample period of {self.hold:g} s is too long for filter_frequency {self.filter_frequency:g} rad/s; "
                f"use at most {self.longest_hold / self.filter_frequency:.3g} s or a slower filter"
            )

    def keeps(self, signal: str) -> bool:
        """Return whether the law means to keep a signal inside its funnel: not without prescribed performance."""
        return self.prescribed_performance and super().keeps(signal)

    def checks(self) -> Iterator[Check]:
        """Yield how the auxiliary gains fare, and which funnels the sample period is too long for."""
        for part, handling in (("attitude", self.torque_saturation), ("position", self.force_saturation)):
            if handling != "none":
                yield from getattr(self, part).auxiliary.checks(part)
        numbers = (self.hold, *(getattr(self, name) for name in gains_of(type(self))))
        if self.hold == 0 or not self.prescribed_performance or not all(map(exact.is_number, numbers)):
            return
        for part in ("attitude", "position"):
            yield from SampledFunnel(self, part).checks()

    def covers(self) -> dict[str, tuple[float, float]]:
        """Return mass and inertia for which the adaptation's proofs, eqs (50) and (84), hold."""
        names = ("inertia.1.1", "inertia.2.2", "inertia.3.3", "inertia.1.2", "inertia.1.3", "inertia.2.3")
        found = {}
        for box, rows in ((self._mass_box(), ("mass",)), (self._inertia_box(), names)):
            ends = (ca.DM(part).elements() for part in box.covers())
            found.update(zip(rows, zip(*ends, strict=True), strict=True))
        return found

    def _inertia_box(self) -> Projection:
        return inertia_box(self.moment_box[0], self.moment_box[1], self.product_box)

    def _mass_box(self) -> Projection:
        return Projection(self.mass_box[0], self.mass_box[1])

    def _auxiliary(self, handling: str, unloading: Any, threshold: Any) -> AuxiliarySaturation | NoAuxiliary:
        if handling == "none":
            return NoAuxiliary()
        return AuxiliarySaturation(
            decay=self.shift_decay,
            coupling=self.shift_coupling,
            unloading=unloading,
            growth=self.gain_growth,
            threshold=threshold,
            softness=self.gain_softness,
            first_gain=self.first_gain,
            counted=self.counted_share if handling == "bounded" else None,
            singular_gain="gain_singular" in self.printed,
        )

    def _common(self, funnel: PerformanceFunnel) -> dict[str, Any]:
        """Return what is the same in both motions."""
        return {
            "transform": TanTransform(funnel) if self.prescribed_performance else PlainError(),
            "filter": SecondOrderFilter(self.filter_frequency, self.filter_damping),
            "bound": AdaptiveBound(self.bound_adaptation, self.bound_leakage, self.bound_layer),
            "filter_from_zero": "filter_start" in self.printed,
            "dynamic_leakage": "leakage_gain" in self.printed,
        }

    @property
    def attitude(self) -> AdaptiveBackstepping:
        """The law of the attitude."""
        threshold = PRINTED_THRESHOLD if "gain_threshold" in self.printed else self.gain_threshold
        return AdaptiveBackstepping(
            error_gain=self.attitude_error_gain,
            rate_gain=self.attitude_rate_gain,
            adaptation=self.inertia_adaptation,
            projection=self._inertia_box(),
            auxiliary=self._auxiliary(self.torque_saturation, self.torque_unloading, threshold),
            whole_regressor="adaptation_regressor" in self.printed,
            **self._common(self.attitude_funnel),
        )

    @property
    def position(self) -> AdaptiveBackstepping:
        """The law of the position."""
        return AdaptiveBackstepping(
            error_gain=self.position_error_gain,
            rate_gain=self.position_rate_gain,
            adaptation=self.mass_adaptation,
            projection=self._mass_box(),
            auxiliary=self._auxiliary(self.force_saturation, self.force_unloading, self.gain_threshold),
            plain_unloading="unloading_term" in self.printed,
            **self._common(self.position_funnel),
        )

    def motions(self, y: Any) -> tuple[AttitudeMotion, PositionMotion]:
        """Return both motions at a measurement."""
        now, orbit = self.inputs.split(y), self.body.orbit
        spin = now.rate + orbit.rotation(now.mrp)
        gravity = orbit.gravity_difference(now.mrp, now.position)
        return AttitudeMotion(orbit, now.mrp, now.rate), PositionMotion(now.position, now.velocity, spin, gravity)

    def start(self, t: Any, y: Any) -> Any:
        """Return the first memory: estimates as believed, filters on their targets."""
        turning, moving = self.motions(y)
        first = self.attitude.start(t, turning, inertia_elements(self.body.inertia))
        return ca.vertcat(first, self.position.start(t, moving, self.body.mass))

    def command(self, t: Any, y: Any, m: Any) -> Any:
        """Return force [N] and torque [N m], (6,) (eqs 77 and 42)."""
        turning, moving = self.motions(y)
        force = self.position.command(t, moving, m[_ATTITUDE.size :])
        return ca.vertcat(force, self.attitude.command(t, turning, m[: _ATTITUDE.size]))

    def rate(self, t: Any, y: Any, m: Any, wanted: Any, achieved: Any) -> Any:
        """Return the rate of the memory."""
        turning, moving = self.motions(y)
        missing = achieved - wanted
        turned = self.attitude.rate(t, turning, m[: _ATTITUDE.size], missing[3:])
        return ca.vertcat(turned, self.position.rate(t, moving, m[_ATTITUDE.size :], missing[:3]))

    def status(self, t: Any, y: Any, m: Any) -> dict[StepStatus, Any]:
        """Return whether attitude or position has left its funnel."""
        now = self.inputs.split(y)
        left = ca.vertcat(self.attitude_funnel.left(t, now.mrp), self.position_funnel.left(t, now.position))
        return {StepStatus.FUNNEL_LEFT: bounds.any_of(left)}

    def show(self, t: Any, y: Any, m: Any) -> dict[str, Any]:
        """Return the use of the funnels by axis, the shifts by saturation and the estimates."""
        now, memory = self.inputs.split(y), self.memory.split(m)
        return {
            "attitude_use": self.attitude_funnel.use_by_axis(t, now.mrp),
            "position_use": self.position_funnel.use_by_axis(t, now.position),
            "attitude_shift": memory.attitude_error_shift,
            "position_shift": memory.position_error_shift,
            "inertia_estimate": memory.attitude_estimate,
            "mass_estimate": memory.position_estimate,
        }
