"""Sensors of a satellite, as a file says them; what no sensor measures is told exactly, unless it is estimated."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator

from casadi_gnc.errors import FlightError
from casadi_gnc.mechanics.sensor import LATEST, Sensor
from casadi_gnc.mechanics.sensors import Gyro, Magnetometer, StarTracker, SunSensor, Tachometers
from casadi_gnc.tables import matrices
from casadi_gnc.tables.part import MisfitError, Name, NonNegative, Part, Positive, Vector, all_of

from .attitude_tables import DEGREE, Attitude

_NONE = [0.0, 0.0, 0.0]


class SensorTable(Part):
    """What every sensor has."""

    period_s: NonNegative = Field(
        default=0.0, description="between values, whole multiple of the sample period; 0: that"
    )
    dropout: Annotated[float, Field(ge=0, lt=1)] = Field(default=0.0, description="chance that a value does not come")
    delay_samples: Annotated[int, Field(ge=0, le=LATEST)] = Field(
        default=0, description="of the flight, from the look to the value"
    )

    def sensor(self, wheels: int) -> Sensor:
        """Return the sensor, on a satellite of so many wheels."""
        raise TypeError(f"{type(self).__name__} defines no sensor")

    def _shared(self) -> dict[str, Any]:
        return {"period": self.period_s, "dropout": self.dropout, "delay": self.delay_samples}


class GyroTable(SensorTable):
    """A gyro triad: rate, body axes, with noise and a bias that wanders."""

    kind: Literal["gyro"]
    name: Name = "gyro"
    angle_random_walk_rad_per_sqrt_s: NonNegative = 0.0
    bias_random_walk_rad_per_s_sqrt_s: NonNegative = 0.0
    bias_rad_per_s: Vector = Field(default=_NONE, description="at t = 0")
    scale_error: Vector = Field(default=_NONE, description="of each axis")
    misalignment_rad: Vector = Field(default=_NONE, description="small turn of the triad from the body")
    range_rad_per_s: Positive = Field(default=10.0, description="largest rate of an axis that can be true")

    def sensor(self, wheels: int) -> Gyro:
        """Return the gyro."""
        return Gyro(
            self.name,
            angle_random_walk=self.angle_random_walk_rad_per_sqrt_s,
            bias_random_walk=self.bias_random_walk_rad_per_s_sqrt_s,
            bias=tuple(self.bias_rad_per_s),
            scale=tuple(self.scale_error),
            misalignment=tuple(self.misalignment_rad),
            range=self.range_rad_per_s,
            **self._shared(),
        )


class StarTrackerTable(SensorTable):
    """A star tracker: attitude from inertial, less sure about its boresight, blind while turning fast."""

    kind: Literal["star_tracker"]
    name: Name = "star_tracker"
    mounting: Attitude = Field(default=Attitude(), description="of its frame from the body; z is the boresight")
    across_rad: NonNegative = Field(default=0.0, description="deviation across the boresight")
    about_rad: NonNegative = Field(default=0.0, description="deviation about the boresight")
    max_rate_rad_per_s: Positive | None = Field(default=None, description="of the body, beyond which it is blind")

    def sensor(self, wheels: int) -> StarTracker:
        """Return the tracker."""
        return StarTracker(
            self.name,
            mounting=tuple(self.mounting.quaternion().elements()),
            across=self.across_rad,
            about=self.about_rad,
            max_rate=math.inf if self.max_rate_rad_per_s is None else self.max_rate_rad_per_s,
            **self._shared(),
        )


class MagnetometerTable(SensorTable):
    """A magnetometer: field, body axes; it takes the place of the exact one. Needs [field]."""

    kind: Literal["magnetometer"]
    name: Name = "magnetic_field"
    deviation_T: NonNegative = 0.0
    bias_T: Vector = _NONE

    def sensor(self, wheels: int) -> Magnetometer:
        """Return the magnetometer."""
        return Magnetometer(self.name, deviation=self.deviation_T, bias=tuple(self.bias_T), **self._shared())


class SunSensorTable(SensorTable):
    """A sun sensor: direction, body axes, by day and in its view. Needs the epoch of [orbit]."""

    kind: Literal["sun_sensor"]
    name: Name = "sun_sensor"
    deviation_rad: NonNegative = 0.0
    axis: Vector = Field(default=[0.0, 0.0, 1.0], description="middle of the view, unit vector, body axes")
    view_deg: Annotated[float, Field(gt=0, le=180)] = Field(default=180.0, description="half angle; 180: all around")

    @field_validator("axis")
    @classmethod
    def _unit(cls, axis: list[float]) -> list[float]:
        return matrices.check_unit(axis)

    def sensor(self, wheels: int) -> SunSensor:
        """Return the sun sensor."""
        shared = self._shared()
        return SunSensor(
            self.name, deviation=self.deviation_rad, axis=tuple(self.axis), view=DEGREE * self.view_deg, **shared
        )


class TachometersTable(SensorTable):
    """Tachometers of all wheels; they take the place of the exact speeds."""

    kind: Literal["tachometers"]
    deviation_rad_per_s: NonNegative = 0.0
    quantum_rad_per_s: NonNegative = Field(default=0.0, description="least difference that is told")

    def sensor(self, wheels: int) -> Tachometers:
        """Return the tachometers."""
        if not wheels:
            raise ValueError("tachometers measure wheels, and there is no [[wheel]]")
        return Tachometers(
            "wheel_speed",
            count=wheels,
            deviation=self.deviation_rad_per_s,
            quantum=self.quantum_rad_per_s,
            **self._shared(),
        )


AnySensor = Annotated[
    GyroTable | StarTrackerTable | MagnetometerTable | SunSensorTable | TachometersTable, Field(discriminator="kind")
]


def made(tables: Sequence[Any], wheels: int, *, has_field: bool, has_sun: bool) -> tuple[Sensor, ...]:
    """Return the sensors of a satellite; raise `MisfitError` for one with nothing to look at or the name of another."""
    found: list[Sensor] = []

    def add(i: int, told: Any) -> None:
        if told.kind == "magnetometer" and not has_field:
            raise MisfitError('there is no field to measure; give [field], e.g. model = "igrf"', "sensor", i, "kind")
        if told.kind == "sun_sensor" and not has_sun:
            raise MisfitError("needs to know when and where it is; give [orbit] with an epoch", "sensor", i, "kind")
        try:
            found.append(told.sensor(wheels))
        except (FlightError, ValueError) as error:
            raise MisfitError(str(error), "sensor", i) from None
        if found[-1].name in [each.name for each in found[:-1]]:
            raise MisfitError(f"another sensor is named {found[-1].name} too; give it a name", "sensor", i, "name")

    all_of(*(partial(add, i, told) for i, told in enumerate(tables)))
    return tuple(found)
