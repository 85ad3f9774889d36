"""An attitude as a file may say it: quaternion, MRPs, axis and angle, or three angles; exactly one of them."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

import casadi as ca
from pydantic import Field, model_validator

from casadi_gnc.mathematics import exact
from casadi_gnc.mechanics import quaternions
from casadi_gnc.tables import matrices
from casadi_gnc.tables.part import Part, Vector

Quaternion = Annotated[list[float], Field(min_length=4, max_length=4)]
#: Radians of a degree.
DEGREE = math.pi / 180
#: How far the length of a quaternion may be from 1.
_UNIT = 1e-4


class Attitude(Part):
    """An attitude, of the body or a reference from another frame; no turn where nothing is said."""

    quaternion_scalar_first: Quaternion | None = Field(default=None, description="(cos(a/2), e sin(a/2))")
    quaternion_scalar_last: Quaternion | None = Field(default=None, description="(e sin(a/2), cos(a/2))")
    mrp: Vector | None = Field(default=None, description="modified Rodrigues parameters, e tan(a/4)")
    axis: Vector | None = Field(default=None, description="unit vector e of a turn by angle_deg or angle_rad")
    angle_deg: float | None = None
    angle_rad: float | None = None
    euler_321_deg: Vector | None = Field(default=None, description="yaw, pitch, roll: C = Rx(roll) Ry(pitch) Rz(yaw)")
    euler_321_rad: Vector | None = None

    @model_validator(mode="after")
    def _one_attitude(self) -> Attitude:
        ways = ("quaternion_scalar_first", "quaternion_scalar_last", "mrp", "axis", "euler_321_deg", "euler_321_rad")
        given = [way for way in ways if getattr(self, way) is not None]
        if len(given) > 1:
            raise ValueError(f"the attitude is given {len(given)} times, by {' and '.join(given)}; keep one")
        angles = [name for name in ("angle_deg", "angle_rad") if getattr(self, name) is not None]
        if (self.axis is not None) != (len(angles) == 1):
            told = " and ".join((["axis"] if self.axis is not None else []) + angles)
            raise ValueError(f"an axis needs one angle, angle_deg or angle_rad, and an angle an axis; there is {told}")
        if self.axis is not None and all(exact.is_number(value) for value in self.axis):
            matrices.check_unit(self.axis, prefix="axis: ")
        for name in ways[:2]:
            value = getattr(self, name)
            if value is not None and abs(math.hypot(*value) - 1) > _UNIT:
                raise ValueError(f"{name} has length {math.hypot(*value):.6g}, expected 1")
        return self

    def quaternion(self) -> Any:
        """Return the attitude as a unit quaternion, (4,), scalar first."""
        if self.mrp is not None:
            return quaternions.from_mrp(exact.array(self.mrp))
        if self.axis is not None:
            angle = DEGREE * self.angle_deg if self.angle_deg is not None else self.angle_rad
            return _unit(quaternions.from_axis_angle(_unit(exact.array(self.axis)), angle))
        if self.euler_321_rad is not None:
            return quaternions.from_321(*self.euler_321_rad)
        if self.euler_321_deg is not None:
            return quaternions.from_321(*(DEGREE * angle for angle in self.euler_321_deg))
        first = self.quaternion_scalar_first
        if self.quaternion_scalar_last is not None:
            *vector, scalar = self.quaternion_scalar_last
            first = [scalar, *vector]
        return ca.DM([1.0, 0.0, 0.0, 0.0]) if first is None else _unit(exact.array(first))


def _unit(column: Any) -> Any:
    """Return a column over its length, the same words on every machine."""
    square = sum(value * value for value in column.elements())
    return column / exact.sqrt(float(square) if exact.is_number(square) else square)


class InitialAttitude(Attitude):
    """Attitude and rate at t = 0."""

    relative_to: Literal["inertial", "reference"] = Field(
        default="inertial", description="frame from which attitude and rate are told; reference: as it is at t = 0"
    )
    rate_rad_per_s: Vector | None = Field(default=None, description="body axes")
    rate_deg_per_s: Vector | None = Field(default=None, description="body axes")

    @model_validator(mode="after")
    def _one_rate(self) -> InitialAttitude:
        if self.rate_rad_per_s is not None and self.rate_deg_per_s is not None:
            raise ValueError("rate_rad_per_s and rate_deg_per_s are both given; keep one")
        return self

    def rate(self) -> Any:
        """Return the rate, (3,), [rad/s]."""
        if self.rate_deg_per_s is not None:
            return exact.array([DEGREE * value for value in self.rate_deg_per_s])
        return exact.array(self.rate_rad_per_s or [0.0, 0.0, 0.0])
