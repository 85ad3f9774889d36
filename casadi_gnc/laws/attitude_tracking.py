"""What laws of attitude that follow a reference have in common: what they read, what they feed forward.

==========  ====================================================================================
symbol      meaning
==========  ====================================================================================
q_e, sigma  attitude of the body from the reference, quaternion (c, v), c >= 0, and MRPs
w, w_r      rate of the body and of the reference from inertial, body axes, (3,), [rad/s]
w_e         w - w_r
w_r'        inertial derivative of w_r, body axes, (3,), [rad/s^2]
J, h        believed inertia, and the momentum of wheels, so that J w + h is the whole
==========  ====================================================================================

Under the torque  J (w_r' - w x w_r) + w x (J w + h)  a body that is on its reference stays on it:
J w_e' = 0 there, since w_e' = w' - w_r' + w x w_r.
"""

from __future__ import annotations

from typing import Any

import casadi as ca

from casadi_gnc.mechanics.reaction_wheels import Gyrostat
from casadi_gnc.mechanics.rigid_body import RigidBody
from casadi_gnc.signals import Layout, Signal


def tracking_signals(body: RigidBody, attitude: str) -> Layout:
    """Return what such a law reads on a body: the attitude as "mrp" or "quaternion", rates, and speeds of wheels."""
    wheels = (Signal("wheel_speed", body.wheels.count, "rad/s"),) if isinstance(body, Gyrostat) else ()
    return Layout(
        (
            Signal(attitude, {"mrp": 3, "quaternion": 4}[attitude], "-"),
            Signal("rate", 3, "rad/s"),
            Signal("body_rate", 3, "rad/s"),
            Signal("reference_rate", 3, "rad/s"),
            Signal("reference_acceleration", 3, "rad/s^2"),
            *wheels,
        )
    )


def whole_momentum(body: RigidBody, now: Any) -> Any:
    """Return J w + h, (3,), [N m s], body axes."""
    known = body.momentum(now.body_rate)
    return known + body.stored(now.body_rate, now.wheel_speed) if isinstance(body, Gyrostat) else known


def feed_forward(body: RigidBody, now: Any) -> Any:
    """Return J (w_r' - w x w_r), (3,), [N m]: what the reference's motion asks for."""
    turning = now.reference_acceleration - ca.cross(now.body_rate, now.reference_rate)
    return ca.mtimes(body.inertia, turning)
