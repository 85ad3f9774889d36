"""Thrusters, and an engine, in the frame of the craft that carries them."""

from __future__ import annotations

import casadi as ca
from pydantic import Field, field_validator, model_validator

from casadi_gnc.mechanics.thrusters import ThrusterGeometry
from casadi_gnc.tables import matrices
from casadi_gnc.tables.orientation import Orientation
from casadi_gnc.tables.part import NonNegative, Part, Positive, Rows, Vector


class Thrusters(Part):
    """Attitude thrusters in the chaser's frame; bounds hold for each."""

    positions_m: Rows
    directions: Rows
    min_force_N: NonNegative = 0.0
    max_force_N: Positive
    max_force_rate_N_per_s: Positive | None = Field(default=None, description="no limit if left out")

    @field_validator("directions")
    @classmethod
    def _are_units(cls, value: list[list[float]]) -> list[list[float]]:
        return [matrices.check_unit(row, prefix=f"thruster {i}: ") for i, row in enumerate(value, 1)]

    @model_validator(mode="after")
    def _fit(self) -> Thrusters:
        if len(self.positions_m) != len(self.directions):
            raise ValueError(f"{len(self.positions_m)} positions but {len(self.directions)} directions")
        if self.min_force_N > self.max_force_N:
            raise ValueError(f"min_force_N {self.min_force_N} exceeds max_force_N {self.max_force_N}")
        return self

    def mounted(self) -> ThrusterGeometry:
        """Return positions and directions as they are given."""
        return ThrusterGeometry.from_rows(self.positions_m, self.directions)


class MountedThrusters(Thrusters, Orientation):
    """Thrusters in the chaser's frame, and how the combined frame lies in it."""

    centre_of_mass_m: Vector = [0.0, 0.0, 0.0]
    centre_of_mass_error_m: Vector = Field(default=[0.0, 0.0, 0.0], description="half width of the box of errors")


class Engine(Part):
    """The orbit-control engine, in the chaser's frame."""

    force_N: NonNegative
    position_m: Vector
    direction: Vector

    _unit = field_validator("direction")(matrices.check_unit)

    def torque(self, rotation: ca.DM, centre: list[float]) -> list[float]:
        """Return its torque, (3,), [N m], about a mass centre [m], in the frame that `rotation` leads to."""
        nozzle = ThrusterGeometry.from_rows([self.position_m], [self.direction]).seen_from(rotation, centre)
        return [self.force_N * entry for entry in nozzle.effectiveness.elements()]
