"""Reaction wheels in the frame of the craft that carries them.

One convention: a wheel's command is its acceleration x [rad/s^2], and the torque on the body is -J_w x along
its axis. A file may give torque and momentum in the place of acceleration and speed: both are divided by J_w.
"""

from __future__ import annotations

import math

from pydantic import Field, field_validator, model_validator

from casadi_gnc.tables import matrices
from casadi_gnc.tables.part import Part, Positive, Rows


class Wheels(Part):
    """The wheels; limits hold for each."""

    axes: Rows = Field(description="spin axes, unit vectors, one a row")
    inertia_kg_m2: Positive = Field(description="J_w, of each wheel about its axis")
    max_acceleration_rad_per_s2: Positive | None = Field(default=None, description="of each; or give max_torque_N_m")
    max_torque_N_m: Positive | None = Field(default=None, description="of each motor, instead of an acceleration")
    max_speed_rad_per_s: Positive | None = Field(default=None, description="no limit if left out")
    max_momentum_N_m_s: Positive | None = Field(default=None, description="of each wheel, instead of a speed")

    @field_validator("axes")
    @classmethod
    def _are_units(cls, value: list[list[float]]) -> list[list[float]]:
        return [matrices.check_unit(row, prefix=f"wheel {i}: ") for i, row in enumerate(value, 1)]

    @model_validator(mode="after")
    def _one_of_each(self) -> Wheels:
        if (self.max_acceleration_rad_per_s2 is None) == (self.max_torque_N_m is None):
            raise ValueError("give either max_torque_N_m or max_acceleration_rad_per_s2 of the wheels")
        if self.max_speed_rad_per_s is not None and self.max_momentum_N_m_s is not None:
            raise ValueError("max_speed_rad_per_s and max_momentum_N_m_s are both given; keep one")
        return self

    @property
    def max_acceleration(self) -> float:
        """Largest acceleration, [rad/s^2]."""
        if self.max_acceleration_rad_per_s2 is not None:
            return self.max_acceleration_rad_per_s2
        return (self.max_torque_N_m or 0.0) / self.inertia_kg_m2

    @property
    def max_speed(self) -> float:
        """Largest speed, [rad/s]; infinite without a limit."""
        if self.max_momentum_N_m_s is not None:
            return self.max_momentum_N_m_s / self.inertia_kg_m2
        return math.inf if self.max_speed_rad_per_s is None else self.max_speed_rad_per_s
