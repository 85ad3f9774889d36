"""A spacecraft, or a service craft with its captured target, that turns by reaction wheels.

==========  ========================================================================
symbol      meaning
==========  ========================================================================
sigma       attitude MRPs with respect to the orbit frame of t = 0, (3,)
omega       rate, (3,), [rad/s], body frame
Omega       wheel speeds, (N,), [rad/s]
x           wheel accelerations as commanded, (N,), [rad/s^2]
C, J_w      true wheel axes, (3, N), and the inertia of a wheel, [kg m^2]
d(t)        disturbance torque, (3,), [N m]
==========  ========================================================================

    sigma' = G(sigma) omega                                                             (1)
    J omega' = -omega x (J omega + C J_w Omega) + tau + u_g(sigma) + d(t)              (14)
    tau = -C J_w Omega',     Omega' = x                                          (11), (13)

The papers call it the orbit frame, which turns, and leave its rate out of (1): so sigma is relative to where that frame
was at t = 0, and u_g has a vertical that stands still. With `frame_rate` (erratum `orbit_frame_rate`) it does turn,
sigma' = G(sigma) (omega - R(sigma) w_o).

tau is the torque on the body; the paper's u is -tau. Faults act on the wheels (eq. 20: Omega' is
what a faulty wheel makes of x) or, as the paper's section IV has it, on the three torques after the
wheels. The latter breaks the balance of momentum: what is missing or added comes from outside.

The sensors see

    sigma^ = (1 + a_s) sigma + b_s,        omega^ = (1 + a_r) omega + b_r              (15), (60)

with a normal number a for all axes and b for each, drawn and held together.

Source: Huang and Duan (2019), doi:10.1109/ACCESS.2019.2949285.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca

from casadi_gnc.mathematics.exact import is_number, is_zero
from casadi_gnc.mechanics import attitude
from casadi_gnc.mechanics.actuator_faults import FaultSchedule
from casadi_gnc.mechanics.disturbances import Harmonics
from casadi_gnc.mechanics.reaction_wheels import Gyrostat
from casadi_gnc.missions.plant import Plant
from casadi_gnc.signals import Layout, Signal

FRAME = "body"
#: Speed [rad/s] beyond which no wheel turns, whatever it is said to withstand: a million turns a minute.
CREDIBLE_SPEED = 1e5


@dataclass(frozen=True)
class SensorError:
    """Describe a sensor's error by standard deviations.

    Parameters
    ----------
    additive : of the error of each axis, unit of the signal.
    scale : of the factor's error, [-], one for all axes.
    """

    additive: float = 0.0
    scale: float = 0.0

    @property
    def is_none(self) -> bool:
        """Whether the sensor is perfect."""
        return is_zero(self.additive) and is_zero(self.scale)

    def distort(self, true: Any, factor: Any, errors: Any) -> Any:
        """Return the measured signal for normal numbers `factor` (1,) and `errors` (n,)."""
        return true * (1 + self.scale * factor) + self.additive * errors


@dataclass(frozen=True, eq=False)
class WheelSpacecraft(Plant):
    """Simulate a spacecraft on wheels.

    Parameters
    ----------
    body : true inertia, wheels and orbit rate; a wheel that has reached its largest speed stops accelerating.
    disturbance : d(t).
    axis_faults, wheel_faults : on the three torques, [N m], and on the N wheels, [rad/s^2].
    attitude_error, rate_error : of the sensors.
    rate_limit : rate [rad/s] per axis beyond which a rate measurement cannot be true.
    frame_rate : of the frame of the attitude about its y axis, [rad/s]; 0 as printed.
    """

    body: Gyrostat
    disturbance: Harmonics = Harmonics()
    axis_faults: FaultSchedule = FaultSchedule(3)
    wheel_faults: FaultSchedule | None = None
    attitude_error: SensorError = SensorError()
    rate_error: SensorError = SensorError()
    rate_limit: float = 10.0
    frame_rate: Any = 0.0

    @property
    def _count(self) -> int:
        return self.body.wheels.count

    @property
    def state(self) -> Layout:
        """Mrp, rate and wheel speed."""
        return Layout(
            (
                Signal("mrp", 3, "-", FRAME, kind="mrp"),
                Signal("rate", 3, "rad/s", FRAME, kind="rate"),
                Signal("wheel_speed", self._count, "rad/s", kind="wheel_speed"),
            )
        )

    @property
    def measurement(self) -> Layout:
        """The state, each signal with the largest magnitude that can be true."""
        limits = {
            "mrp": 2.0,
            "rate": self.rate_limit,
            "wheel_speed": min(1.1 * self.body.wheels.max_speed, CREDIBLE_SPEED),
        }
        return Layout(tuple(replace(signal, limit=limits[signal.name]) for signal in self.state.signals))

    @property
    def inputs(self) -> Layout:
        """Wheel accelerations."""
        return Layout((Signal("wheel_acceleration", self._count, "rad/s^2"),))

    @property
    def noise(self) -> Layout:
        """Normal numbers of the sensors; none where they are perfect."""
        if self.attitude_error.is_none and self.rate_error.is_none:
            return Layout()
        return Layout((Signal("mrp_factor"), Signal("mrp_errors", 3), Signal("rate_factor"), Signal("rate_errors", 3)))

    @property
    def outputs(self) -> Layout:
        """The torque that the body really feels from the wheels, faults included."""
        return Layout((Signal("true_torque", 3, "N m", FRAME),))

    def inertias(self) -> dict[str, Any]:
        """Return the true inertia."""
        return {"true": self.body.inertia}

    def measure(self, t: Any, x: Any, noise: Any) -> Any:
        """Return what the sensors say; wheel speeds are told exactly."""
        if not self.noise.size:
            return x
        now, drawn = self.state.split(x), self.noise.split(noise)
        return self.measurement.pack(
            mrp=self.attitude_error.distort(now.mrp, drawn.mrp_factor, drawn.mrp_errors),
            rate=self.rate_error.distort(now.rate, drawn.rate_factor, drawn.rate_errors),
            wheel_speed=now.wheel_speed,
        )

    def acceleration(self, t: Any, speed: Any, command: Any) -> Any:
        """Return what the wheels make of a command, (N,), [rad/s^2]."""
        made = command if self.wheel_faults is None else self.wheel_faults.apply(t, command)
        fastest = self.body.wheels.max_speed
        if is_number(fastest) and fastest == math.inf:
            return made
        away = ca.logic_and(ca.fabs(speed) >= fastest, made * speed > 0)
        return ca.if_else(away, 0.0, made)

    def torque(self, t: Any, acceleration: Any) -> Any:
        """Return tau, (3,), [N m]: what the body feels when its wheels accelerate so."""
        return self.axis_faults.apply(t, self.body.wheels.torque(acceleration))

    def rate(self, t: Any, x: Any, actuators: Any, noise: Any) -> Any:
        """Return x' (eqs 1 and 14)."""
        now = self.state.split(x)
        acceleration = self.acceleration(t, now.wheel_speed, actuators)
        torque = self.torque(t, acceleration) + self.disturbance.at(t)
        torque += self.body.coupling(now.rate, now.wheel_speed)
        relative = now.rate
        if not is_zero(self.frame_rate):
            relative = relative - attitude.orbit_frame_rate(now.mrp, self.frame_rate)
        return self.state.pack(
            mrp=attitude.mrp_rate(now.mrp, relative),
            rate=self.body.acceleration(now.mrp, now.rate, torque),
            wheel_speed=acceleration,
        )

    def settle(self, x: Any) -> Any:
        """Return the same physical state in the representation kept between steps (|sigma| <= 1)."""
        now = self.state.split(x)
        return self.state.pack(mrp=attitude.short_way(now.mrp), rate=now.rate, wheel_speed=now.wheel_speed)

    def show(self, t: Any, x: Any, actuators: Any) -> dict[str, Any]:
        """Return the torque on the body."""
        speed = self.state.split(x).wheel_speed
        return {"true_torque": self.torque(t, self.acceleration(t, speed, actuators))}
