"""Hold a point that a tumbling target carries, aligned with it: damping, disturbance observer, anti-windup.

Six channels at once, force then torque; hats of the paper (measured values) are left out.

==========  ========================================  =====================================
symbol      meaning                                   name in the code
==========  ========================================  =====================================
e_1, e_2    [r_e; sigma_e], [v_e; omega_e]            now.position_error ... now.rate_error
M_0         believed diag(m_0 I, J_0)                 body.impulse
Lambda, s   slopes, sliding variable                  position_slope, attitude_slope; slide
h_s         M_0 s' without effort and disturbance     known
w^, z       estimate of everything else, its memory   estimate, memory.observer
zeta        output of the saturation compensator      memory.missing
K_1         damping                                   force_damping, torque_damping
K_2, K_3    compensation, compensator's decay         compensator_gain, compensator_decay
Gamma       pole of the estimate                      observer_gain
==========  ========================================  =====================================

    s = e_2 + Lambda e_1                                                               (15)
    h_s = h_0 + M_0 Lambda (C_1 e_1 + C_2 e_2)                                         (16)
    w^ = z + Gamma M_0 s,   z' = -Gamma (w^ + h_s + u)                                 (18)
    u_0 = -C_2' e_1 - K_1 s + K_2 zeta - h_s - w^                                      (21)
    zeta' = -K_3 zeta + (u - u_0)                                                      (22)

`u` is the effort that was made: told of u_0 instead, the observer winds up while saturated. An
observer or compensator gain of zero takes that part out.

The same turn has two MRP vectors. The law follows the one it is using, whichever is measured, so
noise near half a turn does nothing; above `switch_above` it takes the other, and moves z so that the
estimate does not jump. Without `switch_above` it starts with the set measured and never changes, as
the paper does: from |sigma_e| > 1 it turns the long way.

Source: Sun and Zheng (2018), doi:10.1109/TCST.2017.2669145. Theorem 2 asks for (27) below and for (28)
(`casadi_gnc.laws.proximity_conditions`), which its own gains violate.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import casadi as ca

from casadi_gnc.checks import Check, sufficient
from casadi_gnc.laws._law import Law, gain
from casadi_gnc.laws.disturbance_observer import DisturbanceObserver
from casadi_gnc.laws.efforts import FORCE_AND_TORQUE
from casadi_gnc.laws.saturation_compensator import SaturationCompensator
from casadi_gnc.mechanics import attitude
from casadi_gnc.mechanics.proximity_motion import ProximityMotion
from casadi_gnc.signals import Layout, Signal

#: Square of the MRPs below which the other set, beyond 1000, says no more than "a full turn".
_FULL_TURN = 1e-6


@dataclass(frozen=True, eq=False)
class ProximityTracking(Law):
    """Hold a point of a tumbling target: position and attitude error to zero, six degrees of freedom.

    `body` is what the software believes of the motion.
    """

    body: ProximityMotion
    position_slope: Any = gain("1/s", "closing speed per position error", symbol="Lambda_1", above=0.0)
    attitude_slope: Any = gain("1/s", "closing rate per MRP", symbol="Lambda_2", above=0.0)
    force_damping: Any = gain("N s/m", "force per sliding velocity", symbol="K_1", above=0.0)
    torque_damping: Any = gain("N m s", "torque per sliding rate", symbol="K_1", above=0.0)
    observer_gain: Any = gain("1/s", "pole of the disturbance estimate; 0: no observer", symbol="Gamma", minimum=0.0)
    compensator_gain: Any = gain("1/s", "weight of the missing effort; 0: no compensator", symbol="K_2", minimum=0.0)
    compensator_decay: Any = gain("1/s", "decay of the missing effort", symbol="K_3", above=0.0)
    switch_above: Any = gain(
        "-", "norm of the MRPs at which the law turns to the short way; none: never", minimum=1.0, default=None
    )

    effort = FORCE_AND_TORQUE
    inputs = Layout(
        (
            Signal("position_error", 3, "m"),
            Signal("attitude_error", 3, "-"),
            Signal("velocity_error", 3, "m/s"),
            Signal("rate_error", 3, "rad/s"),
            Signal("position", 3, "m"),
            Signal("rate", 3, "rad/s"),
        )
    )
    memory = Layout((Signal("observer", 6, "N, N m"), Signal("missing", 6, "N s, N m s"), Signal("attitude", 3, "-")))
    outputs = Layout(
        (
            Signal("force_estimate", 3, "N"),
            Signal("torque_estimate", 3, "N m"),
            Signal("missing_force", 3, "N s"),
            Signal("missing_torque", 3, "N m s"),
            Signal("tracked_attitude", 3, "-"),
        )
    )
    errata = {
        "observer_start": "z(0) = 0 claims a disturbance Gamma M_0 s(0), up to 17 N and 13 N m, that is not there.",
        "frame_rate": "(7), (10) and (11) print S(omega_e) in C_1; the frame turns with omega.",
    }

    @property
    def observer(self) -> DisturbanceObserver:
        """The disturbance observer on M_0 s."""
        return DisturbanceObserver(self.observer_gain, self.hold)

    @property
    def compensator(self) -> SaturationCompensator:
        """The saturation compensator."""
        return SaturationCompensator(self.compensator_decay)

    def checks(self) -> Iterator[Check]:
        """Yield the two conditions (27)."""
        damping = min(float(self.force_damping), float(self.torque_damping))
        missing = float(self.compensator_decay) / 2 - float(self.compensator_gain) ** 2 / damping
        estimated = float(self.observer_gain) / 2 - 1 / damping
        for part, value in (("compensator", missing), ("observer", estimated)):
            yield sufficient(f"gains.theorem2.{part}", value, 0.0, "1/s", "Sun and Zheng (2018), eq. (27)")

    def slide(self, now: SimpleNamespace) -> Any:
        """Return s, (6,), [m/s] and [rad/s] (eq. 15)."""
        lean = ca.vertcat(self.position_slope * now.position_error, self.attitude_slope * now.attitude_error)
        return ca.vertcat(now.velocity_error, now.rate_error) + lean

    def known(self, now: SimpleNamespace) -> Any:
        """Return h_s, (6,), [N] and [N m] (eq. 16)."""
        frame = SimpleNamespace(**{**vars(now), "rate": now.rate_error}) if "frame_rate" in self.printed else now
        moving = self.body.error_rate(frame)
        lean = ca.vertcat(self.position_slope * moving[:3], self.attitude_slope * moving[3:])
        return self.body.impulse(self.body.acceleration(now) + lean)

    def start(self, t: Any, y: Any) -> Any:
        """Return the first memory: no disturbance estimated, nothing missing, the set of MRPs chosen."""
        now = self.inputs.split(y)
        if self.switch_above is not None:
            now.attitude_error = attitude.short_way(now.attitude_error)
        first = self.observer.start(self.body.impulse(self.slide(now)))
        observer = ca.DM.zeros(6) if "observer_start" in self.printed else first
        return self.memory.pack(observer=observer, missing=ca.DM.zeros(6), attitude=now.attitude_error)

    def jump(self, t: Any, y: Any, m: Any) -> Any:
        """Return the memory with the set of MRPs to use; where that changes, z keeps the estimate."""
        now, memory = self.seen(y, m), self.memory.split(m)
        tracked = now.attitude_error
        if self.switch_above is not None:
            before = self.body.impulse(self.slide(now))
            turned = ca.sumsqr(tracked) > self.switch_above**2
            tracked = ca.if_else(turned, attitude.short_way(tracked), tracked)
            now.attitude_error = tracked
            change = before - self.body.impulse(self.slide(now))
            memory.observer = memory.observer + self.observer.through * change
        return self.memory.pack(observer=memory.observer, missing=memory.missing, attitude=tracked)

    def command(self, t: Any, y: Any, m: Any) -> Any:
        """Return u_0, (6,), [N] and [N m] (eq. 21)."""
        now, memory = self.seen(y, m), self.memory.split(m)
        slide, tracked = self.slide(now), now.attitude_error
        pull = ca.vertcat(now.position_error, (1 + ca.sumsqr(tracked)) / 4 * tracked)  # C_2' e_1
        damping = ca.vertcat(self.force_damping * slide[:3], self.torque_damping * slide[3:])
        estimate = self.observer.estimate(memory.observer, self.body.impulse(slide))
        return self.compensator_gain * memory.missing - pull - damping - self.known(now) - estimate

    def rate(self, t: Any, y: Any, m: Any, wanted: Any, achieved: Any) -> Any:
        """Return the rate of the memory (eqs 18 and 22)."""
        now, memory = self.seen(y, m), self.memory.split(m)
        watched = self.body.impulse(self.slide(now))
        return self.memory.pack(
            observer=self.observer.rate(memory.observer, watched, self.known(now) + achieved),
            missing=self.compensator.rate(memory.missing, wanted, achieved),
            attitude=ca.DM.zeros(3),
        )

    def show(self, t: Any, y: Any, m: Any) -> dict[str, Any]:
        """Return the disturbance estimate, the missing effort and the MRPs in use."""
        now, memory = self.seen(y, m), self.memory.split(m)
        estimate = self.observer.estimate(memory.observer, self.body.impulse(self.slide(now)))
        return {
            "force_estimate": estimate[:3],
            "torque_estimate": estimate[3:],
            "missing_force": memory.missing[:3],
            "missing_torque": memory.missing[3:],
            "tracked_attitude": now.attitude_error,
        }

    def seen(self, y: Any, m: Any) -> SimpleNamespace:
        """Return the measurement, its attitude error in whichever set is nearer to the one in use."""
        now, last = self.inputs.split(y), self.memory.split(m).attitude
        n = ca.sumsqr(now.attitude_error)
        shadow = -now.attitude_error / ca.if_else(n > _FULL_TURN, n, 1.0)
        nearer = ca.sumsqr(shadow - last) < ca.sumsqr(now.attitude_error - last)
        now.attitude_error = ca.if_else(ca.logic_and(nearer, n > _FULL_TURN), shadow, now.attitude_error)
        return now
