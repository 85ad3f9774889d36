"""Turn to zero attitude with measurements that lie: dynamic surface control with two observers.

============  ==========================================  ================================
symbol        meaning                                     name in the code
============  ==========================================  ================================
sigma^        measured attitude MRPs, (3,)                now.mrp
omega^        measured rate, (3,), [rad/s]                now.rate
h             stored momentum of wheels, (3,), [N m s]    body.coupling
x2bar         rate that shrinks sigma^                    target_rate
x2d, y2       filtered rate command, its lag              memory.rate_command
S2            omega^ - x2d                                error
f             modelled acceleration                       known
delta1^       estimated drift of sigma^                   attitude_drift
delta2^       estimated acceleration by the rest          estimate
zeta          output of the saturation compensator        memory.missing
k1, k2        attitude and rate gain                      attitude_gain, rate_gain
k3, k4        compensation, its decay                     compensator_gain, compensator_decay
gamma         gain of the observer of the attitude        attitude_observer_gain
lambda        gain of the observer of the rate            observer_gain
tau2          filter time constant                        filter_time_constant
============  ==========================================  ================================

    x2bar = -G^-1 (k1 sigma^ + delta1^)                                                (28)
    delta1^ = s + gamma sigma^,      s' = -gamma (delta1^ + G omega^)                  (29)
    tau2 x2d' + x2d = x2bar,         S2 = omega^ - x2d                                 (26), (30)
    u_0 = -J0 (G'sigma^ + f + k2 S2 + delta2^ + y2/tau2) + k3 zeta                     (36)
    zeta' = -k4 zeta + (u - u_0)                                                       (37)
    delta2^ = z + lambda omega^,     z' = -lambda (delta2^ + f + J0^-1 u)              (38)

u is the torque on the body; the paper's is on the wheels, of opposite sign, and so is its zeta. The
observer (38) is written on omega^ instead of S2, which is the same (put z - lambda x2d for eta) and
stays right when x2d moves during a hold. Each entry of `errata` keeps a printed variant.

delta1^ mostly follows the noise of the attitude: it makes 4 (k1 + gamma) J0/tau2 of it, in N m per
unit of sigma^. `attitude_observer_gain = 0` leaves it out. Where the plant changes to the shadow set, that
observer starts afresh; the rate command is a rate and stays.

Source: Huang and Duan (2019), section III.A, doi:10.1109/ACCESS.2019.2949285. Theorem 1 asks for
32 k1 >= 9 tau2, 2 k1 gamma >= 3, lambda k2 >= 2 and 2 k2 k4 >= 3 (k3 ||J0^-1||)^2; the printed gains
have lambda k2 = 1.6.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.checks import Check, sufficient
from casadi_gnc.laws._law import Law, gain
from casadi_gnc.laws.command_filter import CommandFilter
from casadi_gnc.laws.disturbance_observer import DisturbanceObserver
from casadi_gnc.laws.efforts import TORQUE
from casadi_gnc.laws.saturation_compensator import SaturationCompensator
from casadi_gnc.mechanics import attitude
from casadi_gnc.mechanics.reaction_wheels import attitude_signals, modelled_acceleration
from casadi_gnc.mechanics.rigid_body import RigidBody
from casadi_gnc.signals import Layout, Signal


@dataclass(frozen=True, eq=False)
class TwoObserverAttitude(Law):
    """Turn the MRPs to zero with two disturbance observers, of the attitude and of the rate.

    `body` is what the software believes of the craft, perhaps with wheels.
    """

    body: RigidBody
    attitude_gain: Any = gain("1/s", "convergence of the attitude", symbol="k1", above=0.0)
    rate_gain: Any = gain("1/s", "damping of the rate error", symbol="k2", above=0.0)
    compensator_gain: Any = gain("1/s", "weight of the missing torque", symbol="k3", minimum=0.0)
    compensator_decay: Any = gain("1/s", "decay of the missing torque", symbol="k4", above=0.0)
    attitude_observer_gain: Any = gain("1/s", "pole of the drift estimate; 0: none", symbol="gamma", minimum=0.0)
    observer_gain: Any = gain("1/s", "pole of the disturbance estimate", symbol="lambda", above=0.0)
    filter_time_constant: Any = gain("s", "lag of the rate command", symbol="tau2", above=0.0)

    effort = TORQUE
    memory = Layout(
        (
            Signal("rate_command", 3, "rad/s"),
            Signal("attitude_observer", 3, "1/s"),
            Signal("observer", 3, "rad/s^2"),
            Signal("missing", 3, "N m s"),
            Signal("last_mrp", 3, "-"),
        )
    )
    outputs = Layout(
        (
            Signal("rate_command", 3, "rad/s"),
            Signal("attitude_drift", 3, "1/s"),
            Signal("disturbance_estimate", 3, "rad/s^2"),
        )
    )
    errata = {
        "anti_windup_sign": "(36) prints -k3 zeta; with (37) that is positive feedback when saturated.",
        "inertia_bracket": "(36) closes the bracket of J0 after the first two terms; (41) needs it around all.",
        "gravity_denominator": "R3 of (12) is divided by 1 + s's; only (1 + s's)^2 makes it a unit vector.",
    }

    @classmethod
    def reads(cls, belief: RigidBody) -> Layout:
        """Return attitude and rate; the wheel speeds too where the body carries wheels."""
        return attitude_signals(belief)

    @property
    def inputs(self) -> Layout:  # type: ignore[override]
        """What the law reads on its own body."""
        return self.reads(self.body)

    @property
    def attitude_observer(self) -> DisturbanceObserver:
        """The observer of what moves the attitude besides the rate."""
        return DisturbanceObserver(self.attitude_observer_gain, self.hold)

    @property
    def observer(self) -> DisturbanceObserver:
        """The disturbance observer on the rate."""
        return DisturbanceObserver(self.observer_gain, self.hold)

    @property
    def compensator(self) -> SaturationCompensator:
        """The saturation compensator."""
        return SaturationCompensator(self.compensator_decay)

    @property
    def filter(self) -> CommandFilter:
        """The filter of the rate command."""
        return CommandFilter(self.filter_time_constant)

    def checks(self) -> Iterator[Check]:
        """Yield the four conditions of Theorem 1."""
        theorem = "Huang and Duan (2019), Theorem 1"
        strength = float(np.linalg.norm(np.array(self.body.inverse_inertia), 2)) * float(self.compensator_gain)
        attitude_gain, rate_gain = float(self.attitude_gain), float(self.rate_gain)
        drift, decay = float(self.attitude_observer_gain), float(self.compensator_decay)
        lag = float(self.filter_time_constant)
        yield sufficient("gains.theorem1.filter", 32 * attitude_gain, 9 * lag, "-", theorem)
        yield sufficient("gains.theorem1.drift", 2 * attitude_gain * drift, 3.0, "1/s^2", theorem)
        yield sufficient("gains.theorem1.observer", float(self.observer_gain) * rate_gain, 2.0, "1/s^2", theorem)
        yield sufficient("gains.theorem1.compensation", 2 * rate_gain * decay, 3 * strength**2, "1/s^2", theorem)

    def known(self, now: Any, torque: Any) -> Any:
        """Return the modelled acceleration under a torque [N m] on the body, (3,), [rad/s^2]."""
        if "gravity_denominator" in self.printed:
            printed = self.body.gravity_gradient(now.mrp) * (1 + ca.sumsqr(now.mrp)) ** 2
            return modelled_acceleration(replace(self.body, orbit_rate=0.0), now, torque + printed)
        return modelled_acceleration(self.body, now, torque)

    def target_rate(self, now: Any, memory: Any) -> Any:
        """Return x2bar, (3,), [rad/s], the rate that shrinks the attitude (eq. 28)."""
        drift = self.attitude_observer.estimate(memory.attitude_observer, now.mrp)
        return -attitude.body_rate(now.mrp, self.attitude_gain * now.mrp + drift)

    def start(self, t: Any, y: Any) -> Any:
        """Return the first memory: nothing estimated, nothing missing, the filter on its target."""
        now = self.inputs.split(y)
        return self.memory.pack(
            rate_command=-attitude.body_rate(now.mrp, self.attitude_gain * now.mrp),
            attitude_observer=self.attitude_observer.start(now.mrp),
            observer=self.observer.start(now.rate),
            missing=ca.DM.zeros(3),
            last_mrp=now.mrp,
        )

    def jump(self, t: Any, y: Any, m: Any) -> Any:
        """Return the memory with a fresh observer of the attitude where its MRPs have become the shadow set."""
        mrp, memory = self.inputs.split(y).mrp, self.memory.split(m)
        # The other set of a turn by more than 110 degrees is more than 110 degrees the other way.
        far = ca.logic_and(ca.sumsqr(mrp) > 0.25, ca.sumsqr(memory.last_mrp) > 0.25)
        turned = ca.logic_and(far, ca.dot(mrp, memory.last_mrp) < 0)
        observer = ca.if_else(turned, self.attitude_observer.start(mrp), memory.attitude_observer)
        return self.memory.pack(**{**vars(memory), "attitude_observer": observer, "last_mrp": mrp})

    def command(self, t: Any, y: Any, m: Any) -> Any:
        """Return u_0, (3,), [N m], on the body (eq. 36)."""
        now, memory = self.inputs.split(y), self.memory.split(m)
        cross = ca.mtimes(attitude.kinematic_matrix(now.mrp).T, now.mrp)
        ahead = self.filter.rate(memory.rate_command, self.target_rate(now, memory))
        estimate = self.observer.estimate(memory.observer, now.rate)
        rest = ahead - self.known(now, 0) - self.rate_gain * (now.rate - memory.rate_command) - estimate
        if "inertia_bracket" not in self.printed:
            rest = ca.mtimes(self.body.inertia, rest)
        compensation = self.sign("anti_windup_sign") * self.compensator_gain * memory.missing
        return rest - ca.mtimes(self.body.inertia, cross) + compensation

    def rate(self, t: Any, y: Any, m: Any, wanted: Any, achieved: Any) -> Any:
        """Return the rate of the memory (eqs 29, 30, 37 and 38)."""
        now, memory = self.inputs.split(y), self.memory.split(m)
        turning = attitude.mrp_rate(now.mrp, now.rate)
        return self.memory.pack(
            rate_command=self.filter.rate(memory.rate_command, self.target_rate(now, memory)),
            attitude_observer=self.attitude_observer.rate(memory.attitude_observer, now.mrp, turning),
            observer=self.observer.rate(memory.observer, now.rate, self.known(now, achieved)),
            missing=self.compensator.rate(memory.missing, wanted, achieved),
            last_mrp=ca.DM.zeros(3),
        )

    def show(self, t: Any, y: Any, m: Any) -> dict[str, Any]:
        """Return the filtered rate command and both estimates."""
        now, memory = self.inputs.split(y), self.memory.split(m)
        return {
            "rate_command": memory.rate_command,
            "attitude_drift": self.attitude_observer.estimate(memory.attitude_observer, now.mrp),
            "disturbance_estimate": self.observer.estimate(memory.observer, now.rate),
        }
