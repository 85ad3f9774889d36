"""Sensors of a satellite, each by what it tells of the truth and how wrong: the measuring of `sensor` in their terms.

Gyro: Farrenkopf (1978), doi:10.2514/3.55779, with the noise of a sample arw/sqrt(h) and the bias's walk rrw sqrt(h).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import casadi as ca

from casadi_gnc.mathematics import exact
from casadi_gnc.mechanics import quaternions
from casadi_gnc.mechanics.sensor import Sensor
from casadi_gnc.signals import Layout, Signal

_NONE = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Gyro(Sensor):
    """Measure the rate, (3,), [rad/s], body axes: M w + bias + noise.

    Parameters
    ----------
    angle_random_walk : arw, [rad/sqrt(s)]: white noise of the rate.
    bias_random_walk : rrw, [rad/s/sqrt(s)]: how the bias wanders.
    bias : at t = 0, (3,), [rad/s].
    scale : error of each axis' factor, (3,), [-].
    misalignment : small turn of the triad from the body, (3,), [rad]; M = (I + diag(scale)) (I - [misalignment]x).
    range : largest rate of an axis that it can tell, [rad/s].
    """

    looks_at = ("rate",)

    angle_random_walk: float = 0.0
    bias_random_walk: float = 0.0
    bias: tuple[float, ...] = _NONE
    scale: tuple[float, ...] = _NONE
    misalignment: tuple[float, ...] = _NONE
    range: float = 10.0

    @property
    def value(self) -> Signal:
        """The rate."""
        return Signal(self.name, 3, "rad/s", "body", self.range)

    @property
    def state(self) -> Layout:
        """The bias."""
        return Layout((Signal(f"{self.name}_bias", 3, "rad/s", "body"),))

    @property
    def noise(self) -> Layout:
        """White noise, and the bias's walk."""
        return super().noise + Layout((Signal(f"{self.name}_walk", 3),))

    def start(self) -> dict[str, Any]:
        """Return the bias."""
        return {f"{self.name}_bias": list(self.bias)}

    def rate(self, t: Any, own: Any, drawn: Any) -> dict[str, Any]:
        """Return the bias's walk: held over a sample, it moves the bias by rrw sqrt(h) n."""
        density = self.density(self.bias_random_walk)
        return {f"{self.name}_bias": density * getattr(drawn, f"{self.name}_walk")}

    def read(self, truth: Any, own: Any, noise: Any) -> tuple[Any, Any]:
        """Return M w + bias + arw/sqrt(h) n."""
        turned = truth.rate - ca.cross(exact.array(self.misalignment), truth.rate)
        distorted = turned + exact.array(self.scale) * turned
        density = self.density(self.angle_random_walk)
        return distorted + getattr(own, f"{self.name}_bias") + density * noise, 1.0


@dataclass(frozen=True, eq=False)
class StarTracker(Sensor):
    """Measure the attitude of the body from inertial, a quaternion, (4,), scalar first and not negative.

    Parameters
    ----------
    mounting : quaternion of the tracker's frame from the body, (4,); its z axis is the boresight.
    across, about : standard deviations of the turn across and about the boresight, [rad].
    max_rate : rate of the body, [rad/s], beyond which it finds no attitude.
    """

    looks_at = ("mrp", "rate")

    mounting: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0)
    across: float = 0.0
    about: float = 0.0
    max_rate: float = math.inf

    @property
    def is_partial(self) -> bool:
        """Whether there is a signal NAME_valid."""
        return super().is_partial or self._blinds

    @property
    def value(self) -> Signal:
        """The quaternion."""
        return Signal(self.name, 4, "-", limit=1.01)

    @property
    def _blinds(self) -> bool:
        """Whether some rate is too fast for it."""
        return not (exact.is_number(self.max_rate) and float(self.max_rate) == math.inf)

    @property
    def deviations(self) -> tuple[float, float, float]:
        """Standard deviations of the turns about the tracker's axes, [rad]."""
        return self.across, self.across, self.about

    def read(self, truth: Any, own: Any, noise: Any) -> tuple[Any, Any]:
        """Return the attitude, turned by the noise in the tracker's frame."""
        mounting = exact.array(self.mounting)
        wrong = quaternions.from_rotation_vector(exact.array(self.deviations) * noise)
        tracker = quaternions.compose(wrong, quaternions.compose(mounting, truth.quaternion))
        body = quaternions.compose(quaternions.conjugate(mounting), tracker)
        slow = ca.sumsqr(truth.rate) <= self.max_rate**2 if self._blinds else 1.0
        return quaternions.short_way(body), slow


@dataclass(frozen=True, eq=False)
class Magnetometer(Sensor):
    """Measure the magnetic field, (3,), [T], body axes, with a bias and noise.

    Parameters
    ----------
    deviation : of each axis, [T].
    bias : what is left after calibration, (3,), [T].
    """

    looks_at = ("mrp", "position")

    deviation: float = 0.0
    bias: tuple[float, ...] = _NONE

    @property
    def value(self) -> Signal:
        """The field."""
        return Signal(self.name, 3, "T", "body", 1e-3)

    def read(self, truth: Any, own: Any, noise: Any) -> tuple[Any, Any]:
        """Return the field."""
        return truth.magnetic_field + exact.array(self.bias) + self.deviation * noise, 1.0


@dataclass(frozen=True, eq=False)
class SunSensor(Sensor):
    """Measure the direction of the sun, a unit vector, (3,), body axes, while it is lit and in view.

    Parameters
    ----------
    deviation : of the direction across each axis, [rad].
    axis : middle of the view, unit vector, (3,), body axes.
    view : half angle of the cone that is seen, [rad]; pi: all around, as several sensors together see.
    """

    looks_at = ("mrp", "position")

    deviation: float = 0.0
    axis: tuple[float, ...] = (0.0, 0.0, 1.0)
    view: float = math.pi

    @property
    def is_partial(self) -> bool:
        """Whether there is a signal NAME_valid: there are nights."""
        return True

    @property
    def value(self) -> Signal:
        """The direction."""
        return Signal(self.name, 3, "-", "body", 1.01)

    def read(self, truth: Any, own: Any, noise: Any) -> tuple[Any, Any]:
        """Return the direction."""
        found = truth.sun + self.deviation * noise
        lit = truth.sunlight > 0.5
        inside = ca.dot(exact.array(self.axis), truth.sun) >= exact.cos_sin(self.view)[0]
        return found / ca.sqrt(ca.sumsqr(found)), ca.logic_and(lit, inside)


@dataclass(frozen=True, eq=False)
class Tachometers(Sensor):
    """Measure the speeds of the wheels, (N,), [rad/s].

    Parameters
    ----------
    count : N.
    deviation : of each, [rad/s].
    quantum : least difference that is told, [rad/s]; 0: none.
    max_speed : beyond which no value is true, [rad/s].
    """

    looks_at = ("wheel_speed",)

    count: int = field(kw_only=True)
    deviation: float = 0.0
    quantum: float = 0.0
    max_speed: float = 1e5

    @property
    def value(self) -> Signal:
        """The speeds."""
        return Signal(self.name, self.count, "rad/s", "", self.max_speed, kind="wheel_speed")

    @property
    def noise(self) -> Layout:
        """White noise of each."""
        return Layout((Signal(f"{self.name}_noise", self.count), *super().noise.signals[1:]))

    def read(self, truth: Any, own: Any, noise: Any) -> tuple[Any, Any]:
        """Return the speeds, rounded to the quantum."""
        speed = truth.wheel_speed + self.deviation * noise
        return (self.quantum * ca.floor(speed / self.quantum + 0.5) if not exact.is_zero(self.quantum) else speed), 1.0
