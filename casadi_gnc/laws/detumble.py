"""De-tumble a body whose inertia is known roughly: rate damping, disturbance observer, anti-windup.

=========  =====================================  ==========================
symbol     meaning                                name in the code
=========  =====================================  ==========================
omega      body rate, (3,), [rad/s]               now.rate
J0, B      believed inertia and its inverse       body.inertia, .inverse_inertia
A          B (-omega x J0 omega + u_t)            known
delta^     estimated angular acceleration by      estimate
           everything not in the model
zeta       output of the saturation compensator   memory.missing
k2, k3     damping, compensation                  rate_gain, compensator_gain
k4, beta   compensator decay, observer gain       compensator_decay, observer_gain
=========  =====================================  ==========================

    u_c0 = J0 (-k2 omega + k3 B zeta - A - delta^)                                     (43)
    zeta' = -k4 zeta + (u - u_c0)                                                      (38)
    delta^ = z + beta omega,   z' = -beta (delta^ + A + B u)                           (44)

Eq. (43) is printed with -k3 B zeta, which is positive feedback while saturated. The gravity
gradient is left to the observer. `u` is the achieved torque.

Source: Huang, Biggs, Duan (2020), section 3.1, doi:10.1016/j.ast.2019.105572. Theorem 2 asks for
8 k2 k4 > 15 ||B||^2 k3^2 and 8 beta k2 > 15.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.checks import Check, sufficient
from casadi_gnc.laws._law import Law, gain
from casadi_gnc.laws.disturbance_observer import DisturbanceObserver
from casadi_gnc.laws.efforts import TORQUE
from casadi_gnc.laws.saturation_compensator import SaturationCompensator
from casadi_gnc.mechanics.rigid_body import RigidBody
from casadi_gnc.signals import Layout, Signal


@dataclass(frozen=True, eq=False)
class Detumble(Law):
    """Bring the rate to zero against a disturbance that an observer estimates, without wind-up at the limits.

    `body` is what the software believes of the craft.
    """

    body: RigidBody
    rate_gain: Any = gain("1/s", "damping of the rate", symbol="k2", above=0.0)
    compensator_gain: Any = gain("1/s", "weight of the missing torque", symbol="k3", minimum=0.0)
    compensator_decay: Any = gain("1/s", "decay of the missing torque", symbol="k4", above=0.0)
    observer_gain: Any = gain("1/s", "pole of the disturbance estimate", symbol="beta_omega", above=0.0)

    effort = TORQUE
    inputs = Layout((Signal("rate", 3, "rad/s"),))
    memory = Layout((Signal("observer", 3, "rad/s^2"), Signal("missing", 3, "N m s")))
    outputs = Layout((Signal("disturbance_estimate", 3, "rad/s^2"),))
    errata = {
        "anti_windup_sign": "(43) prints -k3 B zeta; with (38) that is positive feedback when saturated.",
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

    def checks(self) -> Iterator[Check]:
        """Yield the two conditions of Theorem 2."""
        theorem = "Huang, Biggs, Duan (2020), Theorem 2"
        strength = float(np.linalg.norm(np.array(self.body.inverse_inertia), 2)) * float(self.compensator_gain)
        damping, decay = float(self.rate_gain), float(self.compensator_decay)
        yield sufficient("gains.theorem2.compensation", 8 * damping * decay, 15 * strength**2, "1/s^2", theorem)
        yield sufficient("gains.theorem2.observer", 8 * damping * float(self.observer_gain), 15.0, "1/s^2", theorem)

    def known(self, rate: Any) -> Any:
        """Return A, (3,), [rad/s^2]: the modelled acceleration, gravity gradient left out."""
        return replace(self.body, orbit_rate=0.0).acceleration(None, rate)

    def start(self, t: Any, y: Any) -> Any:
        """Return the memory at rest: no disturbance estimated, nothing missing."""
        return self.memory.pack(observer=self.observer.start(self.inputs.split(y).rate), missing=ca.DM.zeros(3))

    def command(self, t: Any, y: Any, m: Any) -> Any:
        """Return u_c0, (3,), [N m] (eq. 43)."""
        rate, memory = self.inputs.split(y).rate, self.memory.split(m)
        estimate = self.observer.estimate(memory.observer, rate)
        wanted = -self.rate_gain * rate - self.known(rate) - estimate
        compensation = self.sign("anti_windup_sign") * self.compensator_gain * memory.missing
        return ca.mtimes(self.body.inertia, wanted) + compensation

    def rate(self, t: Any, y: Any, m: Any, wanted: Any, achieved: Any) -> Any:
        """Return the rate of the memory (eqs 38 and 44)."""
        rate, memory = self.inputs.split(y).rate, self.memory.split(m)
        known = self.known(rate) + ca.mtimes(self.body.inverse_inertia, achieved)
        return self.memory.pack(
            observer=self.observer.rate(memory.observer, rate, known),
            missing=self.compensator.rate(memory.missing, wanted, achieved),
        )

    def show(self, t: Any, y: Any, m: Any) -> dict[str, Any]:
        """Return the disturbance estimate."""
        rate = self.inputs.split(y).rate
        return {"disturbance_estimate": self.observer.estimate(self.memory.split(m).observer, rate)}
