"""Plates of a satellite, which air and sunlight push, and the air, as a file says them."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from casadi_gnc.mechanics.plates import Atmosphere, Plate
from casadi_gnc.tables import matrices
from casadi_gnc.tables.part import NonNegative, Part, Positive, Vector

Share = Annotated[float, Field(ge=0, le=1)]


class PlateTable(Part):
    """A flat side: air pushes it where there is [air], sunlight where [orbit] has an epoch. Plates do not shade."""

    area_m2: Positive
    normal: Vector = Field(description="outward unit vector, body axes")
    centre_m: Vector = Field(description="of the side, body axes, from the origin of positions")
    drag_coefficient: NonNegative = 2.2
    mirrored: Share = Field(default=0.0, description="share of light that is mirrored")
    scattered: Share = Field(default=0.0, description="share of light that is scattered evenly")

    @model_validator(mode="after")
    def _possible(self) -> PlateTable:
        matrices.check_unit(self.normal, prefix="normal: ")
        if self.mirrored + self.scattered > 1:
            total = self.mirrored + self.scattered
            raise ValueError(f"mirrored and scattered together are {total:g} of the light, expected at most 1")
        return self

    def plate(self) -> Plate:
        """Return the plate."""
        return Plate(self.area_m2, self.normal, self.centre_m, self.drag_coefficient, self.mirrored, self.scattered)


class AirTable(Part):
    """Air whose density falls exponentially with height, and that turns with the Earth."""

    density_kg_per_m3: Positive = Field(description="at altitude_m; the sun's activity moves it by ten times")
    altitude_m: Positive = Field(description="above the equatorial radius, at which the density is known")
    scale_m: Positive = Field(description="height over which the density falls by e, e.g. 65e3 at 500 km")

    def atmosphere(self) -> Atmosphere:
        """Return the model."""
        return Atmosphere(self.density_kg_per_m3, self.altitude_m, self.scale_m)
