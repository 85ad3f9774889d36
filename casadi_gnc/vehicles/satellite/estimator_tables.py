"""What estimates attitude and rate from the sensors, as a file says it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import Field

from casadi_gnc.mechanics.geomagnetic import DEGREE as HIGHEST
from casadi_gnc.mechanics.sensor import Sensor
from casadi_gnc.mechanics.sensors import Gyro, Magnetometer, StarTracker, SunSensor
from casadi_gnc.navigation import Estimator, Mekf
from casadi_gnc.tables.part import NonNegative, Part, Positive

from .attitude_tables import DEGREE


class MekfTable(Part):
    """The multiplicative Kalman filter of attitude and gyro bias, on all gyros, trackers, fields and suns there are."""

    kind: Literal["mekf"]
    attitude_deviation_deg: Positive = Field(default=35.0, description="of the first attitude, each axis")
    bias_deviation_deg_per_s: Positive = Field(default=1.0, description="of the first bias, zero, each axis")
    field_degree: Annotated[int, Field(ge=1, le=HIGHEST)] | None = Field(
        default=None, description="of the field known on board; that of [field] if left out"
    )
    field_error_T: NonNegative = Field(default=0.0, description="what the magnetometer's deviation grows by for that")
    gate: Positive = Field(default=6.0, description="deviations beyond which a measurement is left out")
    patience: Annotated[int, Field(ge=1)] = Field(default=20, description="such samples until the filter starts afresh")

    def estimator(
        self, sensors: Sequence[Sensor], field: Callable[[Any, Any], Any] | None, sun: Callable[[Any], Any] | None
    ) -> Estimator:
        """Return the filter on these sensors.

        Raises
        ------
        ValueError
            Without a gyro, or with two.
        LawError
            For what the filter itself refuses.
        """
        gyros = [each for each in sensors if isinstance(each, Gyro)]
        if len(gyros) != 1:
            raise ValueError(f'the filter moves by one gyro, there are {len(gyros)} [[sensor]] of kind = "gyro"')
        fields = [each for each in sensors if isinstance(each, Magnetometer)]
        return Mekf(
            gyros[0],
            tuple(each for each in sensors if isinstance(each, StarTracker)),
            tuple(replace(each, deviation=each.deviation + self.field_error_T) for each in fields),
            tuple(each for each in sensors if isinstance(each, SunSensor)),
            field,
            sun,
            DEGREE * self.attitude_deviation_deg,
            DEGREE * self.bias_deviation_deg_per_s,
            self.gate,
            self.patience,
        )


#: The kinds of estimators of a file.
AnyEstimator = MekfTable
