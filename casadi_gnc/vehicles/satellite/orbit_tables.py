"""Where a satellite is: its orbit, when it flies, and the magnetic field there."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from casadi_gnc.errors import FlightError
from casadi_gnc.mechanics.circular_orbit import EARTH_MU, EARTH_RADIUS
from casadi_gnc.mechanics.disturbances import Harmonics
from casadi_gnc.mechanics.earth import Epoch
from casadi_gnc.mechanics.geomagnetic import DEGREE as HIGHEST
from casadi_gnc.mechanics.geomagnetic import GeomagneticField
from casadi_gnc.mechanics.orbits import EARTH_J2, Elements, gravity
from casadi_gnc.tables.disturbances import HarmonicTorque
from casadi_gnc.tables.part import MisfitError, Part, Positive, Vector

from .attitude_tables import DEGREE

#: Height [m] below which no orbit lasts a revolution.
_LOWEST = 100e3


class OrbitTable(Part):
    """An orbit about the Earth, by its elements at t = 0; the inertial frame is the mean equator and equinox."""

    altitude_m: Positive | None = Field(
        default=None, description="of a circular orbit above the equatorial radius, or give semi_major_axis_m"
    )
    semi_major_axis_m: Positive | None = None
    eccentricity: Annotated[float, Field(ge=0, lt=1)] = 0.0
    inclination_deg: float = 0.0
    node_deg: float = Field(default=0.0, description="right ascension of the ascending node")
    perigee_deg: float = Field(default=0.0, description="argument of the perigee, from the node")
    anomaly_deg: float = Field(default=0.0, description="true anomaly")
    j2: bool = Field(default=False, description="whether the oblateness of the Earth acts")
    epoch: str | None = Field(default=None, description='when t = 0 is, UTC, "2026-11-27T12:00:00"')

    @model_validator(mode="after")
    def _one_size(self) -> OrbitTable:
        if (self.altitude_m is None) == (self.semi_major_axis_m is None):
            raise ValueError("give either altitude_m or semi_major_axis_m")
        if self.altitude_m is not None and self.eccentricity:
            raise MisfitError("an altitude is of a circular orbit; give semi_major_axis_m", "eccentricity")
        if self.lowest() < EARTH_RADIUS + _LOWEST:
            told = f"the orbit comes down to {(self.lowest() - EARTH_RADIUS) / 1e3:.3g} km above the equatorial radius"
            raise ValueError(f"{told}, expected at least {_LOWEST / 1e3:.0f} km; lengths are in metres")
        return self

    @field_validator("epoch")
    @classmethod
    def _is_a_date(cls, value: str | None) -> str | None:
        if value is not None:
            try:
                Epoch.of(value)
            except FlightError as error:
                raise ValueError(str(error)) from None
        return value

    def _axis(self) -> Any:
        return self.semi_major_axis_m if self.altitude_m is None else EARTH_RADIUS + self.altitude_m

    def lowest(self) -> float:
        """Return the radius of the perigee, [m]."""
        return self._axis() * (1 - self.eccentricity)

    def elements(self) -> Elements:
        """Return the elements at t = 0."""
        angles = (self.inclination_deg, self.node_deg, self.perigee_deg, self.anomaly_deg)
        return Elements(self._axis(), self.eccentricity, *(DEGREE * angle for angle in angles))

    def gravity(self) -> Any:
        """Return the acceleration at a position, a function."""
        return partial(gravity, mu=EARTH_MU, j2=EARTH_J2 if self.j2 else 0.0)

    def when(self) -> Epoch | None:
        """Return when t = 0 is, if it is said."""
        return None if self.epoch is None else Epoch.of(self.epoch)


class FieldTable(Part):
    """The Earth's magnetic field: IGRF of the epoch's year, or the dipole that is its first degree."""

    model: Literal["igrf", "dipole"]
    degree: Annotated[int, Field(ge=1, le=HIGHEST)] | None = Field(
        default=None, description=f"of the igrf, {HIGHEST} if left out"
    )

    @model_validator(mode="after")
    def _one_degree(self) -> FieldTable:
        if self.model == "dipole" and self.degree not in (None, 1):
            raise MisfitError(f'a dipole is of degree 1, not {self.degree}; take model = "igrf"', "degree")
        return self

    def field(self, epoch: Epoch) -> GeomagneticField:
        """Return the field; raise `FlightError` outside the years of its coefficients."""
        return GeomagneticField(epoch, 1 if self.model == "dipole" else self.degree or HIGHEST)


class Environment(Part):
    """What turns a satellite from outside."""

    gravity_gradient: bool = Field(default=True, description="where there is an orbit")
    constant_torque_N_m: Vector = Field(default=[0.0, 0.0, 0.0], description="body axes")
    harmonic: list[HarmonicTorque] = []

    def disturbance(self) -> Harmonics:
        """Return the torque that acts besides gravity, body axes."""
        return Harmonics(
            tuple(self.constant_torque_N_m),
            tuple(each.frequency_rad_per_s for each in self.harmonic),
            tuple(tuple(each.amplitude_N_m) for each in self.harmonic),
            tuple(each.phase_rad for each in self.harmonic),
        )
