"""A chaser close to a free, tumbling target in an orbit about the Earth, in six degrees of freedom.

The relative state is propagated, never formed as the difference of two absolute positions: after
60 s of that, 1e-12 of relative accuracy still costs 0.4 mm at 7000 km. The target's own state is
implied: omega_t = R'(omega - omega_e), r_t = R'(r - r_e) - p_t, v_t = R'(v - v_e) - omega_t x p_t.

========  ==========================================================================
symbol    meaning
========  ==========================================================================
r, v      chaser's position and inertial velocity, (3,), [m], [m/s], chaser frame
omega     chaser's rate, (3,), [rad/s], chaser frame
J_t       inertia of the target, (3, 3), [kg m^2], target frame
f, tau    control force [N] and torque [N m], (3,) each, chaser frame
d         disturbance force and torque, (6,), [N] and [N m], chaser frame
========  ==========================================================================

    r' = v - omega x r,   v' = -omega x v - mu r + (f + d_f)/m
    omega' = J^-1 (-omega x J omega + tau + d_tau),   omega_t' = -J_t^-1 (omega_t x J_t omega_t)

and the relative equations of `casadi_gnc.mechanics.proximity_motion` with their terms in omega_t'.

Source: Sun and Zheng (2018), section II, doi:10.1109/TCST.2017.2669145.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import casadi as ca

from casadi_gnc.mathematics.exact import array, is_zero
from casadi_gnc.mechanics import attitude
from casadi_gnc.mechanics.disturbances import OrbitalDisturbance
from casadi_gnc.mechanics.proximity_motion import ProximityMotion
from casadi_gnc.mechanics.rigid_body import RigidBody
from casadi_gnc.missions.plant import Plant
from casadi_gnc.signals import Layout, Signal
from casadi_gnc.status import StepStatus

FRAME = "chaser"
#: Norm of the MRPs beyond which the other set is kept, a turn of 225 degrees: a start that is written
#: the long way stays so in the records.
LONGEST = 1.5


@dataclass(frozen=True)
class RelativeSensor:
    """Say how far the measured relative state is off, as standard deviations of each axis.

    Parameters
    ----------
    position_error : [m].
    attitude_error : of the MRPs, [-].
    velocity_error : [m/s].
    rate_error : [rad/s].
    """

    position_error: float = 0.0
    attitude_error: float = 0.0
    velocity_error: float = 0.0
    rate_error: float = 0.0

    def deviations(self) -> dict[str, Any]:
        """Return the deviations that are not zero by measured signal."""
        every = {name: getattr(self, name) for name in RELATIVE.names}
        return {name: value for name, value in every.items() if not is_zero(value)}


#: The relative state.
RELATIVE = Layout(
    (
        Signal("position_error", 3, "m", FRAME, limit=1e7),
        Signal("attitude_error", 3, "-", FRAME, limit=1e4, kind="mrp"),
        Signal("velocity_error", 3, "m/s", FRAME, limit=1e5),
        Signal("rate_error", 3, "rad/s", FRAME, limit=20.0),
    )
)
#: What the chaser's actuators make.
EFFORT = Layout((Signal("force", 3, "N", FRAME), Signal("torque", 3, "N m", FRAME)))
_POSITION = Signal("position", 3, "m", FRAME, limit=1e11)
_RATE = Signal("rate", 3, "rad/s", FRAME, limit=20.0, kind="rate")


@dataclass(frozen=True, eq=False)
class ProximityPair(Plant):
    """Simulate chaser and target.

    Parameters
    ----------
    motion : true mass and inertia of the chaser, the point to hold, the Earth.
    target_inertia : J_t, (3, 3), [kg m^2], target frame.
    disturbance : d(t).
    sensor : errors of the relative navigation; the chaser's own position and rate are exact.
    keep_out_radius : of the sphere about the target's centre that the chaser must not enter, [m].
    """

    motion: ProximityMotion
    target_inertia: Any
    disturbance: OrbitalDisturbance = OrbitalDisturbance()
    sensor: RelativeSensor = RelativeSensor()
    keep_out_radius: float = 0.0

    @property
    def state(self) -> Layout:
        """The relative state, and the chaser's position, velocity and rate."""
        return RELATIVE + Layout((_POSITION, Signal("velocity", 3, "m/s", FRAME), _RATE))

    @property
    def measurement(self) -> Layout:
        """The relative state, and the chaser's position and rate."""
        return RELATIVE + Layout((_POSITION, _RATE))

    @property
    def inputs(self) -> Layout:
        """Control force and torque."""
        return EFFORT

    @property
    def outputs(self) -> Layout:
        """Distance of the two centres of mass."""
        return Layout((Signal("target_distance", 1, "m"),))

    @property
    def noise(self) -> Layout:
        """Random part of the disturbance, and of each measured signal that has one."""
        pushed = [Signal("disturbance", 6)] if self.disturbance.is_random else []
        read = [Signal(name, 3) for name in self.sensor.deviations()]
        return Layout((*pushed, *read))

    def inertias(self) -> dict[str, Any]:
        """Return the inertias of chaser and target."""
        return {"true": self.motion.inertia, "target": self.target_inertia}

    def measure(self, t: Any, x: Any, noise: Any) -> Any:
        """Return what the sensors say at time t [s], a column of `measurement`."""
        now, drawn = self.state.split(x), self.noise.split(noise)
        seen = {name: getattr(now, name) for name in self.measurement.names}
        for name, deviation in self.sensor.deviations().items():
            seen[name] = seen[name] + deviation * getattr(drawn, name)
        return self.measurement.pack(**seen)

    def rate(self, t: Any, x: Any, actuators: Any, noise: Any) -> Any:
        """Return x'."""
        now = self.state.split(x)
        mu = self.motion.pull(now.position)
        effort = actuators + self.disturbance.effort(t, ca.sqrt(mu))
        if "disturbance" in self.noise:
            effort += array(self.disturbance.deviation) * self.noise.split(noise).disturbance
        turn = attitude.dcm(now.attitude_error)
        spin_up = RigidBody(self.target_inertia).acceleration(None, self.target(x).rate)
        coupling = ca.vertcat(ca.cross(array(self.motion.hold_point), spin_up), -spin_up)
        relative = self.motion.acceleration(now, effort)
        return ca.vertcat(
            self.motion.error_rate(now),
            relative[:3] + ca.mtimes(turn, coupling[:3]),
            relative[3:] + ca.mtimes(turn, coupling[3:]),
            now.velocity - ca.cross(now.rate, now.position),
            effort[:3] / self.motion.mass - ca.cross(now.rate, now.velocity) - mu * now.position,
            self.motion.body.acceleration(None, now.rate, effort[3:]),
        )

    def settle(self, x: Any) -> Any:
        """Return the same physical state with the attitude error's MRPs no longer than `LONGEST`."""
        now = self.state.split(x)
        long = ca.sumsqr(now.attitude_error) > LONGEST**2
        now.attitude_error = ca.if_else(long, attitude.short_way(now.attitude_error), now.attitude_error)
        return self.state.pack(**vars(now))

    def target(self, x: Any) -> SimpleNamespace:
        """Return the target's position [m], inertial velocity [m/s] and rate [rad/s], (3,) each, target frame."""
        now = self.state.split(x)
        back, point = attitude.dcm(now.attitude_error).T, array(self.motion.hold_point)
        rate = ca.mtimes(back, self.motion.target_rate(now))
        return SimpleNamespace(
            position=ca.mtimes(back, now.position - now.position_error) - point,
            velocity=ca.mtimes(back, now.velocity - now.velocity_error) - ca.cross(rate, point),
            rate=rate,
        )

    def target_distance(self, x: Any) -> Any:
        """Return the distance of the two centres of mass, [m]."""
        return ca.sqrt(ca.sumsqr(self.motion.separation(self.state.split(x))))

    def show(self, t: Any, x: Any, actuators: Any) -> dict[str, Any]:
        """Return the distance to the target's centre."""
        return {"target_distance": self.target_distance(x)}

    def status(self, t: Any, x: Any, actuators: Any) -> dict[StepStatus, Any]:
        """Return whether the chaser's centre is inside the keep-out sphere."""
        return {StepStatus.KEEP_OUT_ENTERED: self.target_distance(x) < self.keep_out_radius}
