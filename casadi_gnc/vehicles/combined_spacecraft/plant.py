"""Chaser and captured target, locked together by an arm: one rigid body on the chaser's thrusters.

========  ==========================================================================
symbol    meaning
========  ==========================================================================
sigma     attitude MRPs of the combined body with respect to the orbit frame of t = 0, (3,)
omega     rate, (3,), [rad/s], combined body frame
F         thruster forces, (N,), [N]
A_c       true effectiveness, 3 x N, [m]
u_t       torque of the orbit-control engine, (3,), [N m]
d(t)      disturbance torque, (3,), [N m]
========  ==========================================================================

    sigma' = G(sigma) omega                                                             (1)
    J omega' = -omega x J omega + A_c F + u_t + u_g(sigma) + d(t)                       (14)

The papers call it the orbit frame, which turns, and leave its rate out of (1): so sigma is relative to where that frame
was at t = 0, and u_g has a vertical that stands still. With `frame_rate` (erratum `orbit_frame_rate`) it does turn,
sigma' = G(sigma) (omega - R(sigma) w_o).

Source: Huang, Biggs, Duan (2020), section 2, doi:10.1016/j.ast.2019.105572.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import casadi as ca

from casadi_gnc.mathematics.exact import array, is_zero
from casadi_gnc.mechanics import attitude
from casadi_gnc.mechanics.disturbances import Harmonics
from casadi_gnc.mechanics.rigid_body import RigidBody
from casadi_gnc.missions.plant import Plant
from casadi_gnc.signals import Layout, Signal

FRAME = "combined body"


@dataclass(frozen=True, eq=False)
class CombinedSpacecraft(Plant):
    """Simulate the combined spacecraft.

    Parameters
    ----------
    body : true inertia, engine torque and orbit rate.
    effectiveness : true A_c, (3, N), [m].
    disturbance : d(t).
    rate_limit : rate [rad/s] per axis beyond which a rate measurement cannot be true.
    frame_rate : of the frame of the attitude about its y axis, [rad/s]; 0 as printed.
    """

    body: RigidBody
    effectiveness: ca.DM
    disturbance: Harmonics = Harmonics()
    rate_limit: float = 10.0
    frame_rate: Any = 0.0

    @property
    def state(self) -> Layout:
        """Mrp and rate."""
        return Layout((Signal("mrp", 3, "-", FRAME, kind="mrp"), Signal("rate", 3, "rad/s", FRAME, kind="rate")))

    @property
    def measurement(self) -> Layout:
        """Mrp and rate, each with the largest magnitude that can be true."""
        mrp, rate = self.state.signals
        return Layout((replace(mrp, limit=2.0), replace(rate, limit=self.rate_limit)))

    @property
    def inputs(self) -> Layout:
        """Thruster forces."""
        return Layout((Signal("force", self.effectiveness.shape[1], "N"),))

    def inertias(self) -> dict[str, Any]:
        """Return the true inertia."""
        return {"true": self.body.inertia}

    def torque(self, force: Any) -> Any:
        """Return the torque that the thrusters really make, A_c F, (3,), [N m]."""
        return ca.mtimes(self.effectiveness, force)

    def rate(self, t: Any, x: Any, actuators: Any, noise: Any) -> Any:
        """Return x' (eqs 1 and 14)."""
        now = self.state.split(x)
        torque = self.torque(actuators) + self.disturbance.at(t)
        relative = now.rate
        if not is_zero(self.frame_rate):
            relative = relative - attitude.orbit_frame_rate(now.mrp, self.frame_rate)
        return self.state.pack(
            mrp=attitude.mrp_rate(now.mrp, relative),
            rate=self.body.acceleration(now.mrp, now.rate, torque),
        )

    def settle(self, x: Any) -> Any:
        """Return the same physical state in the representation kept between steps (|sigma| <= 1)."""
        now = self.state.split(x)
        return self.state.pack(mrp=attitude.short_way(now.mrp), rate=now.rate)


@dataclass(frozen=True, eq=False)
class BodyPart:
    """Describe one rigid part of a composed body (eq. 70).

    Parameters
    ----------
    mass : [kg].
    inertia : (3, 3), [kg m^2], about the part's own centre of mass, in the part's frame.
    position : (3,), [m], of that centre of mass from the common one, combined frame.
    rotation : (3, 3), part frame -> combined frame.
    """

    mass: float
    inertia: Any
    position: Any
    rotation: Any


def compose_inertia(parts: list[BodyPart]) -> ca.DM:
    """Return J = sum R J R' + m (p'p I - p p'), (3, 3), [kg m^2], about the common centre (eq. 70)."""
    total: Any = ca.DM.zeros(3, 3)
    for part in parts:
        r, p = array(part.rotation), array(part.position)
        own = ca.mtimes([r, array(part.inertia), r.T])
        total = total + own + part.mass * (ca.dot(p, p) * ca.DM.eye(3) - ca.mtimes(p, p.T))
    return total
