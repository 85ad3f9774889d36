"""Tables of a file that only the proximity pair has."""

from __future__ import annotations

from pydantic import Field, field_validator

from casadi_gnc.tables import matrices
from casadi_gnc.tables.part import NonNegative, Part, Positive, Vector


class Target(Part):
    """The target, which tumbles freely."""

    inertia_kg_m2: matrices.Inertia = Field(description="J_t, about the centre of mass, target frame")


class Orbit(Part):
    """The body that is orbited."""

    gravitational_parameter_m3_per_s2: Positive = 3.986004418e14
    body_radius_m: Positive = Field(default=6378137.0, description="a perigee below it is a crash")
    circular: bool = Field(default=False, description="true: refuse an orbit of the target that is not circular")


class Believed(Part):
    """What the flight software believes."""

    mass_factor: Positive = Field(default=1.0, description="believed over true mass")
    inertia_factor: Positive = Field(default=1.0, description="believed over true inertia")
    target_orbit_radius_m: Positive | None = Field(
        default=None, description="r_o, if the target's gravity is taken as constant; else from measured positions"
    )


class Sensors(Part):
    """Standard deviations of each axis of the measured relative state, drawn as [noise] says."""

    position_deviation_m: NonNegative = 0.0
    attitude_deviation: NonNegative = Field(default=0.0, description="of the MRPs")
    velocity_deviation_m_per_s: NonNegative = 0.0
    rate_deviation_rad_per_s: NonNegative = 0.0


class Initial(Part):
    """State at t = 0, resolved in the chaser's frame; the target's follows from it."""

    position_error_m: Vector = Field(description="r_e, from the point to hold")
    attitude_error: Vector = Field(description="sigma_e, MRPs from the target's frame to the chaser's")
    velocity_error_m_per_s: Vector = Field(description="v_e, inertial velocity less that of the point to hold")
    rate_error_rad_per_s: Vector = Field(description="omega_e")
    position_m: Vector = Field(description="r, of the chaser from the Earth's centre")
    velocity_m_per_s: Vector = Field(description="v, inertial")
    rate_rad_per_s: Vector = [0.0, 0.0, 0.0]

    @field_validator("position_m")
    @classmethod
    def _is_somewhere(cls, value: list[float]) -> list[float]:
        if not any(value):
            raise ValueError("the chaser is at the Earth's centre")
        return value
