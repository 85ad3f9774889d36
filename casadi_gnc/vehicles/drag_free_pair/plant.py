"""Drag-free pair: a satellite around a free-falling test mass, their relative position and attitude.

========  ==========================================================================================
symbol    meaning
========  ==========================================================================================
F_t       test-mass frame, taken as the orbiting frame of its circular orbit
F_s       body frame of the satellite; all vectors below are resolved in it
sigma     MRPs of F_s with respect to F_t, (3,); R(sigma): F_t -> F_s
omega     rate of F_s with respect to F_t, (3,), [rad/s]
r, v      position [m] of the satellite from the test mass and relative *inertial* velocity [m/s]
u_t       rate of F_t, R(sigma) (0, 0, n), (3,), [rad/s]; omega_s = omega + u_t
f, tau    control force (3,), [N], and torque (3,), [N m]
========  ==========================================================================================

    sigma' = G(sigma) omega                                                                    (1)
    J omega' = -omega_s x J omega_s - J (u_t x omega) + tau + tau_d                       (4)-(6)
    r' = v - omega_s x r                                                                       (8)
    m v' = -m omega_s x v + m g_d + f + f_d                                              (9), (10)

Frames: the paper's text maps F_s to F_t and resolves omega in F_t; its equations hold only the
other way round. The acceleration of the test mass in (10) is the inertial one, so that h_p is m
times a difference of gravity, which `CircularOrbit` gives without loss of digits.

Source: Tao, Zhang (2019), section 1, doi:10.16356/j.1005-1120.2019.04.008.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.mathematics.exact import array
from casadi_gnc.mechanics import attitude
from casadi_gnc.mechanics.circular_orbit import CircularOrbit
from casadi_gnc.mechanics.disturbances import OrbitalDisturbance
from casadi_gnc.mechanics.rigid_body import RigidBody
from casadi_gnc.missions.plant import Plant
from casadi_gnc.signals import Layout, Signal

FRAME = "satellite"


@dataclass(frozen=True, eq=False)
class DragFreePair(Plant):
    """Simulate the pair.

    Parameters
    ----------
    mass : m of the satellite, [kg].
    body : its true inertia.
    orbit : orbit of the test mass.
    disturbance : f_d [N] and tau_d [N m], F_s.
    rate_limit, position_limit, velocity_limit : [rad/s], [m], [m/s] per axis beyond which a
        measurement cannot be true.
    """

    mass: float
    body: RigidBody
    orbit: CircularOrbit
    disturbance: OrbitalDisturbance = OrbitalDisturbance()
    rate_limit: float = 10.0
    position_limit: float = 10.0
    velocity_limit: float = 10.0

    @property
    def inputs(self) -> Layout:
        """Control force and torque."""
        return Layout((Signal("force", 3, "N", FRAME), Signal("torque", 3, "N m", FRAME)))

    @property
    def state(self) -> Layout:
        """Attitude, rate, position and velocity, each with the largest magnitude that can be true."""
        return Layout(
            (
                Signal("mrp", 3, "-", FRAME, limit=2.0, kind="mrp"),
                Signal("rate", 3, "rad/s", FRAME, limit=self.rate_limit, kind="rate"),
                Signal("position", 3, "m", FRAME, limit=self.position_limit),
                Signal("velocity", 3, "m/s", FRAME, limit=self.velocity_limit),
            )
        )

    @property
    def noise(self) -> Layout:
        """Random part of the disturbance, if it has one."""
        return Layout((Signal("disturbance", 6),) if self.disturbance.is_random else ())

    @property
    def measurement(self) -> Layout:
        """All of the state."""
        return self.state

    def inertias(self) -> dict[str, Any]:
        """Return the true inertia."""
        return {"true": self.body.inertia}

    def rate(self, t: Any, x: Any, actuators: Any, noise: Any) -> Any:
        """Return x' (eqs 1, 4, 8 and 9)."""
        now = self.state.split(x)
        orbital = self.orbit.rotation(now.mrp)
        spin = now.rate + orbital
        given = actuators + self.disturbance.effort(t, self.orbit.rate)
        if self.noise.size:
            given += array(self.disturbance.deviation) * noise
        effort = self.inputs.split(given)
        turned = self.body.acceleration(None, spin, effort.torque)
        pushed = effort.force / self.mass + self.orbit.gravity_difference(now.mrp, now.position)
        return self.state.pack(
            mrp=attitude.mrp_rate(now.mrp, now.rate),
            rate=turned - ca.cross(orbital, now.rate),
            position=now.velocity - ca.cross(spin, now.position),
            velocity=pushed - ca.cross(spin, now.velocity),
        )
