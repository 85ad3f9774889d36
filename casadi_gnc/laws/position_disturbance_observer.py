"""Dock by a disturbance observer on the measured relative velocity: the baseline.

===========  ==========================================  =============================
symbol       meaning                                     name in the code
===========  ==========================================  =============================
eta          relative position and velocity, (6,)        now.position, now.velocity
A, B         pair of mass m0 on a circular orbit         body
K            controller gain                             controller_gain
L            observer gain on the velocity, [N s/m]      observer_gain
r_d          where to come to rest, (3,), [m]            body.port
w^           estimated disturbance, (3,), [N]            disturbance
===========  ==========================================  =============================

    u = -K (eta - [r_d; 0]) - w^ - m0 (A [r_d; 0])
    w^ = p + L v,      p' = -L (B w^ + A eta + B u)

This is m0 times the `DisturbanceObserver` of v' = known + w/m0 with the pole L/m0. The gains that
Shi et al. print for it are tuned for their start r0: L = 2519.15 I + 0.01255 r0 r0' to its last
digits, a multiple of the identity to 1.5e-4; a scalar is what is taken here.

Run at a sample period with the feed-through L of continuous time, L acts as a velocity gain of
2519 N s/m, and the loop is unstable beyond 2 m/L, m the true reduced mass: 22.7 ms. The sampled
feed-through of `DisturbanceObserver` has no such limit.

Source: Shi, Liu, Biggs, Sun, Yue (2020), section 4.B, doi:10.1016/j.ast.2020.105759, after their
reference [8]; the form of the observer is identified from its printed results (m0 in B).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from casadi_gnc.laws._law import Law, gain
from casadi_gnc.laws.approach import Approach, as_matrix
from casadi_gnc.laws.disturbance_observer import DisturbanceObserver
from casadi_gnc.laws.efforts import FORCE
from casadi_gnc.laws.sampled_loop import refuse_long_hold
from casadi_gnc.mechanics.relative_motion import PairModel
from casadi_gnc.signals import Layout, Signal
from casadi_gnc.status import StepStatus


@dataclass(frozen=True, eq=False)
class PositionDisturbanceObserver(Law):
    """Bring a docking pair to its port by state feedback and a disturbance observer on the measured velocity.

    `body` is what the software believes of the pair.
    """

    body: PairModel
    controller_gain: Any = gain("N/m, N s/m", "force per position and velocity", symbol="K", size=(3, 6))
    observer_gain: Any = gain("N s/m", "disturbance per velocity", symbol="L", above=0.0)
    approach_speed: Any = gain("m/s", "largest speed towards the port; none: no limit", above=0.0, default=None)

    effort = FORCE
    inputs = Layout((Signal("position", 3, "m"), Signal("velocity", 3, "m/s")))
    memory = Layout((Signal("observer", 3, "m/s^2"),))
    outputs = Layout((Signal("disturbance_estimate", 3, "N"),))
    errata = {
        "held_feed_through": "Sampled with the L of continuous time, the observer takes its own ramp for a disturbance."
    }

    @property
    def approach(self) -> Approach:
        """The feedback on position and velocity."""
        return Approach(as_matrix(self.controller_gain), self.body, self.approach_speed)

    @property
    def observer(self) -> DisturbanceObserver:
        """The disturbance observer on the velocity."""
        hold = 0.0 if "held_feed_through" in self.printed else self.hold
        return DisturbanceObserver(self.observer_gain / self.body.mass, hold)

    def check_hold(self) -> None:
        """Refuse a sample period at which the loop with the pair that is flown is unstable."""
        held = "held_feed_through" in self.printed
        refuse_long_hold(self, self.body.truth, "or take held_feed_through out of as_printed" if held else "")

    def disturbance(self, y: Any, m: Any) -> Any:
        """Return w^, (3,), [N]."""
        return self.body.mass * self.observer.estimate(m, self.inputs.split(y).velocity)

    def start(self, t: Any, y: Any) -> Any:
        """Return the first memory: no disturbance estimated."""
        return self.observer.start(self.inputs.split(y).velocity)

    def command(self, t: Any, y: Any, m: Any) -> Any:
        """Return u, (3,), [N]."""
        now = self.inputs.split(y)
        return self.approach.force(now.position, now.velocity) - self.disturbance(y, m)

    def rate(self, t: Any, y: Any, m: Any, wanted: Any, achieved: Any) -> Any:
        """Return the rate of the memory."""
        now = self.inputs.split(y)
        known = self.body.acceleration(now.position, now.velocity, achieved)
        return self.observer.rate(m, now.velocity, known)

    def status(self, t: Any, y: Any, m: Any) -> dict[StepStatus, Any]:
        """Return whether the pair closes in faster than allowed."""
        now = self.inputs.split(y)
        return self.approach.status(now.position, now.velocity)

    def show(self, t: Any, y: Any, m: Any) -> dict[str, Any]:
        """Return the estimated disturbance."""
        return {"disturbance_estimate": self.disturbance(y, m)}
