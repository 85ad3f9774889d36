"""Tables of a file that only the drag-free pair has."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field, field_validator

from casadi_gnc.mechanics.circular_orbit import EARTH_MU, EARTH_RADIUS
from casadi_gnc.tables import matrices
from casadi_gnc.tables.part import Part, Positive, Vector


class Orbit(Part):
    """The circular orbit of the test mass, whose frame the orbiting frame is."""

    altitude_m: Annotated[
        float, Field(ge=1e5, description="above the radius of the body; below 100 km nothing falls freely")
    ]
    body_radius_m: Positive = EARTH_RADIUS
    gravitational_parameter_m3_per_s2: Positive = EARTH_MU


class Believed(Part):
    """What the flight software believes of the satellite, and where its estimates start."""

    mass_kg: Positive
    inertia_kg_m2: matrices.Inertia


class Initial(Part):
    """State at t = 0 relative to the test mass, resolved in the satellite's frame."""

    mrp: Vector = Field(description="sigma_e, test-mass frame -> satellite frame; shorter than 1")
    rate_rad_per_s: Vector = Field(description="omega_e")
    position_m: Vector = Field(description="r_e, of the satellite from the test mass")
    velocity_m_per_s: Vector = Field(description="v_e, difference of the inertial velocities")

    @field_validator("mrp")
    @classmethod
    def _is_the_short_turn(cls, value: list[float]) -> list[float]:
        length = float(np.linalg.norm(value))
        if length >= 1:
            raise ValueError(
                f"the MRPs have the length {length:.4g}; expected less than 1, half a turn: in a funnel they cannot "
                "change to the other set. Give the same attitude as minus the vector over its square"
            )
        return value
