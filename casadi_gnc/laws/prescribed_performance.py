"""Turn to zero attitude inside a funnel: dynamic surface control with a disturbance observer.

==========  ======================================  =================================
symbol      meaning                                 name in the code
==========  ======================================  =================================
sigma       attitude MRPs, (3,)                     now.mrp
omega       rate, (3,), [rad/s]                     now.rate
e1, r       transformed error and its slope         funnel.error, 1/funnel.spread
lambda      place in the funnel, sigma/rho          funnel.position
x2bar       rate that shrinks e1                    target_rate
x2d, y2     filtered rate command, its lag          memory.rate_command
A, B        modelled acceleration, J0^-1            known, body.inverse_inertia
delta^      estimated acceleration by the rest      estimate
zeta        output of the saturation compensator    memory.missing
k1, k2      attitude and rate gain                  attitude_gain, rate_gain
k3, k4      compensation, its decay                 compensator_gain, compensator_decay
beta, tau   observer gain, filter time constant     observer_gain, filter_time_constant
==========  ======================================  =================================

    x2bar = -G^-1 (k1 e1/r - lambda rho')                                              (31)
    tau x2d' + x2d = x2bar,          e2 = omega - x2d                                  (22), (32)
    u_c0 = J0 (-k2 e2 + k3 B zeta - A - delta^ + x2d')                                 (36)
    zeta' = -k4 zeta + (u - u_c0)                                                      (38)
    z' = -beta (delta^ + A + B u),   delta^ = z + beta omega                           (39)

Differences from the printed law, each an entry of `errata`: the filter's rate enters (36) with the
sign that cancels it; zeta unloads; no cross term -G'r e1, whose gain grows with r until no sample
rate can follow. The observer is written on omega instead of e2, which is the same (put
z - beta x2d for z in (39)) and stays right when x2d moves during a hold.

With `max_acceleration` two limiters of our own keep the command within what the actuators can do:
the rate command can always be braked (`BrakingLimiter`) and its filter never asks for more
acceleration (`CommandFilter.max_rate`). Without them the paper's slew leaves its funnel.

Source: Huang, Biggs, Duan (2020), section 3, doi:10.1016/j.ast.2019.105572.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.checks import Check, sufficient
from casadi_gnc.laws._law import Law, gain
from casadi_gnc.laws.braking_limiter import BrakingLimiter
from casadi_gnc.laws.command_filter import CommandFilter
from casadi_gnc.laws.disturbance_observer import DisturbanceObserver
from casadi_gnc.laws.efforts import TORQUE
from casadi_gnc.laws.performance_funnel import PerformanceFunnel
from casadi_gnc.laws.saturation_compensator import SaturationCompensator
from casadi_gnc.mechanics import attitude
from casadi_gnc.mechanics.rigid_body import RigidBody
from casadi_gnc.signals import Layout, Signal
from casadi_gnc.status import StepStatus


@dataclass(frozen=True, eq=False)
class PrescribedPerformance(Law):
    """Keep the attitude inside a funnel that narrows as the mission prescribes.

    `body` is what the software believes of the craft.
    """

    body: RigidBody
    funnel: PerformanceFunnel
    attitude_gain: Any = gain("1/s", "convergence of the transformed error", symbol="k1", above=0.0)
    rate_gain: Any = gain("1/s", "damping of the rate error", symbol="k2", above=0.0)
    compensator_gain: Any = gain("1/s", "weight of the missing torque", symbol="k3", minimum=0.0)
    compensator_decay: Any = gain("1/s", "decay of the missing torque", symbol="k4", above=0.0)
    observer_gain: Any = gain("1/s", "pole of the disturbance estimate", symbol="beta", above=0.0)
    filter_time_constant: Any = gain("s", "lag of the rate command", symbol="tau", above=0.0)
    max_acceleration: Any = gain(
        "rad/s^2", "acceleration that the actuators can make about any axis; none: no limiters", above=0.0, default=None
    )
    braking_share: Any = gain("-", "share of max_acceleration to plan braking with", above=0.0, default=0.5)
    braking_floor: Any = gain("-", "MRP at which the braking limit stops shrinking", above=0.0, default=1e-6)

    funnels = {"funnel": "mrp"}
    effort = TORQUE
    inputs = Layout((Signal("mrp", 3, "-"), Signal("rate", 3, "rad/s")))
    memory = Layout(
        (Signal("rate_command", 3, "rad/s"), Signal("observer", 3, "rad/s^2"), Signal("missing", 3, "N m s"))
    )
    outputs = Layout((Signal("rate_command", 3, "rad/s"), Signal("disturbance_estimate", 3, "rad/s^2")))
    errata = {
        "filter_rate_sign": "(36) prints + y2/tau, which adds the filter's rate twice instead of following it.",
        "anti_windup_sign": "(36) prints -k3 B zeta; with (38) that is positive feedback when saturated.",
        "cross_term": "(36) contains -G'r e1; r grows without bound, so no sample rate is fast enough.",
        "observer_start": "zeta(0) = 0 claims a disturbance beta e2(0) that is not there.",
        "held_feed_through": "Sampled with the gain of continuous time, the observer takes its ramp for a disturbance.",
    }

    @property
    def observer(self) -> DisturbanceObserver:
        """The disturbance observer on the rate."""
        return DisturbanceObserver(self.observer_gain, 0.0 if "held_feed_through" in self.printed else self.hold)

    @property
    def compensator(self) -> SaturationCompensator:
        """The saturation compensator."""
        return SaturationCompensator(self.compensator_decay)

    @property
    def filter(self) -> CommandFilter:
        """The filter of the rate command."""
        return CommandFilter(self.filter_time_constant, self.max_acceleration)

    def checks(self) -> Iterator[Check]:
        """Yield the three conditions of Theorem 1; the third where it is easiest, at zero attitude in the end."""
        theorem = "Huang, Biggs, Duan (2020), Theorem 1"
        strength = float(np.linalg.norm(np.array(self.body.inverse_inertia), 2)) * float(self.compensator_gain)
        damping, decay = float(self.rate_gain), float(self.compensator_decay)
        floor = float(np.array(ca.DM(self.funnel.floor)).min())
        slope = float(np.max(1 / np.array(ca.DM(self.funnel.spread(ca.DM(np.inf), ca.DM.zeros(3))))))
        yield sufficient("gains.theorem1.compensation", 2 * decay * damping, 3 * strength**2, "1/s^2", theorem)
        yield sufficient("gains.theorem1.observer", 2 * float(self.observer_gain) * damping, 3.0, "1/s^2", theorem)
        limit = 3 * slope**2 * float(self.filter_time_constant)
        told = f"{theorem}, funnel at its floor of {floor:g}"
        yield sufficient("gains.theorem1.filter", 16 * float(self.attitude_gain), limit, "-", told)

    def target_rate(self, t: Any, mrp: Any) -> Any:
        """Return x2bar, (3,), [rad/s], the rate that shrinks the transformed error (eq. 31)."""
        drift = self.funnel.position(t, mrp) * self.funnel.width_rate(t)
        pull = self.attitude_gain * self.funnel.error(t, mrp) * self.funnel.spread(t, mrp)
        rate = -attitude.body_rate(mrp, pull - drift)
        if self.max_acceleration is None:
            return rate
        return BrakingLimiter(self.max_acceleration, self.braking_share, self.braking_floor).limit(mrp, rate)

    def start(self, t: Any, y: Any) -> Any:
        """Return the first memory: no disturbance estimated, nothing missing.

        The filter starts on its target as in the paper; a limited one cannot jump and starts from
        the rate that is there.
        """
        now = self.inputs.split(y)
        command = self.target_rate(t, now.mrp) if self.max_acceleration is None else now.rate
        seen = command if "observer_start" in self.printed else now.rate
        return self.memory.pack(rate_command=command, observer=self.observer.start(seen), missing=ca.DM.zeros(3))

    def command(self, t: Any, y: Any, m: Any) -> Any:
        """Return u_c0, (3,), [N m] (eq. 36)."""
        now, memory = self.inputs.split(y), self.memory.split(m)
        error = now.rate - memory.rate_command
        ahead = self.filter.rate(memory.rate_command, self.target_rate(t, now.mrp))
        estimate = self.observer.estimate(memory.observer, now.rate)
        wanted = -self.rate_gain * error - self.body.acceleration(now.mrp, now.rate) - estimate
        wanted += self.sign("filter_rate_sign") * ahead
        if "cross_term" in self.printed:
            slope = self.funnel.error(t, now.mrp) / self.funnel.spread(t, now.mrp)
            wanted -= ca.mtimes(attitude.kinematic_matrix(now.mrp).T, slope)
        compensation = self.sign("anti_windup_sign") * self.compensator_gain * memory.missing
        return ca.mtimes(self.body.inertia, wanted) + compensation

    def rate(self, t: Any, y: Any, m: Any, wanted: Any, achieved: Any) -> Any:
        """Return the rate of the memory (eqs 32, 38 and 39)."""
        now, memory = self.inputs.split(y), self.memory.split(m)
        known = self.body.acceleration(now.mrp, now.rate, achieved)
        return self.memory.pack(
            rate_command=self.filter.rate(memory.rate_command, self.target_rate(t, now.mrp)),
            observer=self.observer.rate(memory.observer, now.rate, known),
            missing=self.compensator.rate(memory.missing, wanted, achieved),
        )

    def status(self, t: Any, y: Any, m: Any) -> dict[StepStatus, Any]:
        """Return whether the attitude has left its funnel."""
        return {StepStatus.FUNNEL_LEFT: self.funnel.left(t, self.inputs.split(y).mrp)}

    def show(self, t: Any, y: Any, m: Any) -> dict[str, Any]:
        """Return the filtered rate command and the disturbance estimate."""
        now, memory = self.inputs.split(y), self.memory.split(m)
        estimate = self.observer.estimate(memory.observer, now.rate)
        return {"rate_command": memory.rate_command, "disturbance_estimate": estimate}
