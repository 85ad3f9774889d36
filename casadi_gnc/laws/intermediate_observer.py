"""Dock by an intermediate observer: relative state and lumped disturbance estimated together.

===========  ==========================================  =============================
symbol       meaning                                     name in the code
===========  ==========================================  =============================
eta          relative position and velocity, (6,)        y
eta^, w^     their estimate; that of the disturbance     memory
A, B         pair of mass m0 on a circular orbit         body
K, L         controller and observer gain                controller_gain, observer_gain
varpi        gain of the disturbance, [kg^2/s]           disturbance_gain
r_d          where to come to rest, (3,), [m]            body.port
===========  ==========================================  =============================

    u = -K (eta^ - [r_d; 0]) - w^ - m0 (A [r_d; 0])                                    (19)
    eta^' = A eta^ + B (u + w^) + L (y - eta^),    w^' = varpi B' L (y - eta^)     (15)-(18)

This is the paper's observer with xi^ = w^ - varpi B' eta^ eliminated: the same poles, and no
difference of large numbers. `u` is the achieved force. The last term of (19) holds the craft at a
point that is not the centre; an approach-speed limit bends the position's part of K (`Approach`).

Sampled every h seconds the measurement ramps during the hold: taken as held, a closing pair is
seen h/2 behind, which the estimate of w then explains. Instead the innovation i = y - eta^ is taken
at the sample, where it is true, and given its whole effect at once. Were it fed to the continuous
observer it would decay as (A - L) says, so that over one hold

    eta^ += L h phi1((A - L) h) i,      w^ += varpi B' L h phi1((A - L) h) i,

and between the samples the model runs alone, exactly. An estimate that is right stays right
whatever the pair does under a held force; the poles are those of the continuous observer to first
order in h, and a command uses the measurement of its own sample.

Source: Shi, Liu, Biggs, Sun, Yue (2020), section 3, doi:10.1016/j.ast.2020.105759. The sampled
form, the point and the speed limit are ours.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.laws._law import Law, gain
from casadi_gnc.laws.approach import Approach, as_matrix
from casadi_gnc.laws.efforts import FORCE
from casadi_gnc.laws.sampled_loop import refuse_long_hold
from casadi_gnc.laws.sampling import phi1
from casadi_gnc.mechanics.relative_motion import PairModel
from casadi_gnc.signals import Layout, Signal
from casadi_gnc.status import StepStatus


@dataclass(frozen=True, eq=False)
class IntermediateObserver(Law):
    """Bring a docking pair to its port by state feedback and an intermediate observer of disturbance and state.

    `body` is what the software believes of the pair.
    """

    body: PairModel
    controller_gain: Any = gain("N/m, N s/m", "force per position and velocity", symbol="K", size=(3, 6))
    observer_gain: Any = gain("1/s", "correction of the estimated state", symbol="L", size=(6, 6))
    disturbance_gain: Any = gain("kg^2/s", "correction of the disturbance", symbol="varpi", minimum=0.0)
    approach_speed: Any = gain("m/s", "largest speed towards the port; none: no limit", above=0.0, default=None)

    effort = FORCE
    inputs = Layout((Signal("position", 3, "m"), Signal("velocity", 3, "m/s")))
    memory = Layout(
        (
            Signal("position_estimate", 3, "m"),
            Signal("velocity_estimate", 3, "m/s"),
            Signal("disturbance_estimate", 3, "N"),
        )
    )
    outputs = memory
    errata = {
        "observer_start": "The estimate starts from zero although the first measurement is there.",
        "observer_input": "(15) feeds the observer u of (19), which (11) then cuts: it believes in force that was not.",
    }

    @property
    def approach(self) -> Approach:
        """The feedback on position and velocity."""
        return Approach(as_matrix(self.controller_gain), self.body, self.approach_speed)

    @property
    def correction(self) -> Any:
        """Rate of the memory per innovation, (9, 6): L over varpi B' L."""
        correct = as_matrix(self.observer_gain)
        return ca.vertcat(correct, self.disturbance_gain / self.body.mass * correct[3:, :])

    def check_hold(self) -> None:
        """Refuse a sample period at which the loop with the pair that is flown is unstable."""
        refuse_long_hold(self, self.body.truth)

    def start(self, t: Any, y: Any) -> Any:
        """Return the first memory: the measurement and no disturbance."""
        eta = ca.DM.zeros(6) if "observer_start" in self.printed else y
        return ca.vertcat(eta, ca.DM.zeros(3))

    def jump(self, t: Any, y: Any, m: Any) -> Any:
        """Return the memory corrected by the measurement: sampled, by what a whole hold would do."""
        if self.hold == 0:
            return m
        decay = self._drift - as_matrix(self.observer_gain)
        share = self.hold * phi1(ca.SX(decay) * self.hold)
        share = ca.evalf(share) if share.is_constant() else share  # numbers go with MX too
        return m + ca.mtimes(ca.mtimes(self.correction, share), y - m[:6])

    def command(self, t: Any, y: Any, m: Any) -> Any:
        """Return u, (3,), [N] (eq. 19)."""
        now = self.memory.split(m)
        return self.approach.force(now.position_estimate, now.velocity_estimate) - now.disturbance_estimate

    def rate(self, t: Any, y: Any, m: Any, wanted: Any, achieved: Any) -> Any:
        """Return the rate of the memory (eqs 15 to 18); sampled, without the correction of `jump`."""
        now = self.memory.split(m)
        acting = wanted if "observer_input" in self.printed else achieved
        drift = ca.vertcat(self.body.rate(m[:6], acting + now.disturbance_estimate), ca.DM.zeros(3))
        if self.hold:
            return drift
        return drift + ca.mtimes(self.correction, y - m[:6])

    def status(self, t: Any, y: Any, m: Any) -> dict[StepStatus, Any]:
        """Return whether the pair closes in faster than allowed."""
        now = self.memory.split(m)
        return self.approach.status(now.position_estimate, now.velocity_estimate)

    def show(self, t: Any, y: Any, m: Any) -> dict[str, Any]:
        """Return the estimates."""
        return vars(self.memory.split(m))

    @property
    def _drift(self) -> Any:
        """A, (6, 6), [1/s]."""
        eta = ca.SX.sym("eta", 6)
        return ca.jacobian(self.body.rate(eta), eta)
