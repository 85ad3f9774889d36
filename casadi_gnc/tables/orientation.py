"""How one frame is turned from another, as a file says it."""

from __future__ import annotations

import casadi as ca
from pydantic import Field, field_validator, model_validator

from casadi_gnc.mathematics.exact import array
from casadi_gnc.mechanics import attitude
from casadi_gnc.tables import matrices
from casadi_gnc.tables.part import Angles, Matrix, Part


class Orientation(Part):
    """How the combined frame is turned from the chaser's: a matrix or three angles, not both."""

    rotation: Matrix | None = Field(default=None, description="R, v_combined = R v_chaser, orthonormal to 1e-4")
    rotation_321_rad: Angles | None = Field(default=None, description="yaw, pitch, roll of the frame: R = Rx Ry Rz")

    @field_validator("rotation")
    @classmethod
    def _is_rotation(cls, value: list[list[float]] | None) -> list[list[float]] | None:
        return None if value is None else matrices.check_rotation(value)

    @model_validator(mode="after")
    def _not_both(self) -> Orientation:
        if self.rotation is not None and self.rotation_321_rad is not None:
            raise ValueError("rotation and rotation_321_rad are both given; keep one")
        return self

    def turned(self) -> ca.DM | None:
        """Return the rotation that is given, (3, 3), or None if there is none."""
        if self.rotation is not None:
            return array(self.rotation)
        if self.rotation_321_rad is not None:
            return attitude.frame_rotation(*self.rotation_321_rad)
        return None

    def matrix(self) -> ca.DM:
        """Return the rotation that is given, (3, 3), or none at all: the identity."""
        turned = self.turned()
        return ca.DM.eye(3) if turned is None else turned
