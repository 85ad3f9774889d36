"""Finite-time fault-tolerant attitude law: a baseline, reconstructed.

Huang and Duan (2019), doi:10.1109/ACCESS.2019.2949285, compare with the robust finite-time
fault-tolerant controller of Hu, Huo, Xiao and Zhang (2012, Proc. IMechE I 226(3), 416-428) and print
its gains but not its formula. This is a terminal sliding mode with such gains: **not their law**, and
the comparison's numbers are of the right order at best.

=============  =========================================  ======================
symbol         meaning                                    name in the code
=============  =========================================  ======================
sig(v)^a       |v|^a with the sign of v, by element       signed_power
S              sliding variable, (3,), [rad/s]            surface
Gamma, gamma   slope and exponent of the surface          surface_gain, surface_power
k1, k2, rho    linear gain, power gain, its exponent      linear_gain, power_gain, power
=============  =========================================  ======================

    S = omega + Gamma sig(sigma)^gamma
    u = -J0 (f + Gamma gamma diag(max(|sigma|, s_0)^(gamma - 1)) sigma') - k1 S - k2 sig(S)^rho

f is the acceleration by the body's own turning. The slope of sig(sigma)^gamma is infinite at zero; below
s_0 = `floor` it is held.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import casadi as ca

from casadi_gnc.laws._law import Law, gain
from casadi_gnc.laws.efforts import TORQUE
from casadi_gnc.mathematics import bounds
from casadi_gnc.mechanics import attitude
from casadi_gnc.mechanics.reaction_wheels import attitude_signals, modelled_acceleration
from casadi_gnc.mechanics.rigid_body import RigidBody
from casadi_gnc.signals import Layout


def signed_power(value: Any, exponent: Any) -> Any:
    """Return |v|^a with the sign of v, element by element; 0 at 0 for a > 0."""
    return ca.sign(value) * ca.fabs(value) ** exponent


@dataclass(frozen=True, eq=False)
class FiniteTimeFaultTolerant(Law):
    """Turn the MRPs to zero in finite time by a terminal sliding mode that bears actuator faults.

    `body` is what the software believes of the craft.
    """

    body: RigidBody
    surface_gain: Any = gain("1/s", "slope of the surface", symbol="Gamma", above=0.0)
    surface_power: Any = gain("-", "exponent of the surface", symbol="gamma", above=0.0)
    linear_gain: Any = gain("N m s/rad", "torque per sliding variable", symbol="k1", above=0.0)
    power_gain: Any = gain("N m", "torque per power of the sliding variable", symbol="k2", minimum=0.0)
    power: Any = gain("-", "exponent of that power", symbol="rho", above=0.0)
    floor: Any = gain("-", "MRP below which the slope is held", above=0.0, default=0.01)

    effort = TORQUE

    @classmethod
    def reads(cls, belief: RigidBody) -> Layout:
        """Return attitude and rate; the wheel speeds too where the body carries wheels."""
        return attitude_signals(belief)

    @property
    def inputs(self) -> Layout:  # type: ignore[override]
        """What the law reads on its own body."""
        return self.reads(self.body)

    def command(self, t: Any, y: Any, m: Any) -> Any:
        """Return u, (3,), [N m], on the body."""
        now = self.inputs.split(y)
        turning = replace(self.body, orbit_rate=0.0, constant_torque=(0.0, 0.0, 0.0))
        surface = now.rate + self.surface_gain * signed_power(now.mrp, self.surface_power)
        slope = self.surface_power * bounds.maximum(ca.fabs(now.mrp), self.floor) ** (self.surface_power - 1)
        sliding = modelled_acceleration(turning, now) + self.surface_gain * slope * attitude.mrp_rate(now.mrp, now.rate)
        pull = self.linear_gain * surface + self.power_gain * signed_power(surface, self.power)
        return -ca.mtimes(self.body.inertia, sliding) - pull
