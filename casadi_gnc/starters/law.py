"""StarterLaw: proportional and derivative control of attitude, with a disturbance observer.

========  =========================================  =======================
symbol    meaning                                    name in the code
========  =========================================  =======================
sigma     attitude MRPs, (3,)                        now.mrp
omega     body rate, (3,), [rad/s]                   now.rate
J         believed inertia, (3, 3), [kg m^2]         body.inertia
a         modelled acceleration, (3,), [rad/s^2]     known
delta^    estimated acceleration by everything       disturbance
          that is not in the model, (3,), [rad/s^2]
========  =========================================  =======================

    u = -k_p sigma - k_d omega - J (a + delta^),      delta^' = beta (omega' - a - J^-1 u - delta^)

Say here where the law comes from: paper, equations, DOI.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

import casadi_gnc as gnc
from casadi_gnc.laws import DisturbanceObserver
from casadi_gnc.mechanics.rigid_body import RigidBody


@dataclass(frozen=True, eq=False)
class StarterLaw(gnc.Law):
    """Bring attitude and rate to zero; `body` is what the flight software believes of the craft."""

    # A field `body` receives what the craft believes. Leave it out if the law models nothing.
    body: RigidBody
    # Gains stand in the file under these names. Unit, meaning and range go into the schema and the messages.
    attitude_gain: Any = gnc.gain("N m", "torque per MRP", symbol="k_p", above=0.0)
    rate_gain: Any = gnc.gain("N m s/rad", "torque per rate", symbol="k_d", above=0.0)
    observer_gain: Any = gnc.gain("1/s", "pole of the disturbance estimate", symbol="beta", above=0.0, default=0.05)

    # What the law commands: the craft must make the same. TORQUE, FORCE, FORCE_AND_TORQUE, or a Layout.
    effort = gnc.TORQUE
    # What it reads: names, sizes and units as the craft measures them.
    inputs = gnc.Layout((gnc.Signal("mrp", 3, "-"), gnc.Signal("rate", 3, "rad/s")))
    # What it remembers from sample to sample; leave it out if nothing.
    memory = gnc.Layout((gnc.Signal("observer", 3, "rad/s^2"),))
    # What it shows in records and pictures besides its command.
    outputs = gnc.Layout((gnc.Signal("disturbance_estimate", 3, "rad/s^2"),))

    @property
    def observer(self) -> DisturbanceObserver:
        """The disturbance observer on the rate; `hold` makes it unbiased when it is sampled."""
        return DisturbanceObserver(self.observer_gain, self.hold)

    def start(self, t: Any, y: Any) -> Any:
        """Return the memory at the first measurement: no disturbance is estimated."""
        return self.observer.start(self.inputs.split(y).rate)

    def command(self, t: Any, y: Any, m: Any) -> Any:
        """Return the wanted torque, (3,), [N m]; limits and allocation come after it."""
        now = self.inputs.split(y)
        known = self.body.acceleration(now.mrp, now.rate)
        feed_forward = ca.mtimes(self.body.inertia, known + self.observer.estimate(m, now.rate))
        return -self.attitude_gain * now.mrp - self.rate_gain * now.rate - feed_forward

    def rate(self, t: Any, y: Any, m: Any, wanted: Any, achieved: Any) -> Any:
        """Return d(memory)/dt; `achieved` is what the actuators made of the command."""
        now = self.inputs.split(y)
        return self.observer.rate(m, now.rate, self.body.acceleration(now.mrp, now.rate, achieved))

    def show(self, t: Any, y: Any, m: Any) -> dict[str, Any]:
        """Return the signals of `outputs`."""
        return {"disturbance_estimate": self.observer.estimate(m, self.inputs.split(y).rate)}
