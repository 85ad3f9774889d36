"""Tables of a file that only the combined spacecraft has."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from casadi_gnc.tables import matrices
from casadi_gnc.tables.allocation import Pinv, Robust
from casadi_gnc.tables.orientation import Orientation
from casadi_gnc.tables.part import NonNegative, Part, Positive, Vector


class BodyPartTable(Orientation):
    """One part of the composed body (eq. 70); orientation is part frame -> combined frame."""

    mass_kg: Positive
    inertia_kg_m2: matrices.Inertia
    position_m: Vector


class Truth(Part):
    """How the real craft differs from the known one."""

    inertia_factor: Positive = 1.0
    inertia_kg_m2: matrices.Inertia | None = Field(default=None, description="true inertia, instead of a factor")
    centre_of_mass_error_m: Vector = Field(default=[0.0, 0.0, 0.0], description="true minus known, chaser frame")


class Believed(Orientation):
    """What the flight software believes where that differs from the known craft."""

    inertia_kg_m2: matrices.Inertia | None = None
    centre_of_mass_m: Vector | None = None


class RobustAgainstMassCentre(Robust):
    """Robust min-max allocation against errors of the centre of mass."""

    centre_of_mass_error_m: Annotated[list[NonNegative], Field(min_length=3, max_length=3)] = Field(
        description="half width of the box of errors, chaser frame"
    )


class SchemeKeys(Part):
    """How far a law may ask, and how its torque is allocated."""

    torque_limit_N_m: Annotated[list[Positive], Field(min_length=3, max_length=3)]
    allocation: Annotated[Pinv | RobustAgainstMassCentre, Field(discriminator="method")]
