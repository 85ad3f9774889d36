"""Tables of a file that only the docking pair has."""

from __future__ import annotations

import itertools
from typing import Annotated

from pydantic import Field, model_validator

from casadi_gnc.mechanics.dipoles import TargetDipole
from casadi_gnc.mechanics.disturbances import Harmonics
from casadi_gnc.tables.disturbances import OuterForce
from casadi_gnc.tables.part import NonNegative, Part, Positive, Vector

from .plant import FaultPiece, FaultProfile


class TargetMoment(Part):
    """The target's moment: fixed in the orbit frame, or kept along the line of sight."""

    fixed_A_m2: Vector | None = None
    steered_A_m2: Positive | None = Field(default=None, description="its magnitude, away from the target to the chaser")

    @model_validator(mode="after")
    def _one(self) -> TargetMoment:
        if (self.fixed_A_m2 is None) == (self.steered_A_m2 is None):
            raise ValueError("give fixed_A_m2 or steered_A_m2, one of them")
        if self.fixed_A_m2 is not None and not any(self.fixed_A_m2):
            raise ValueError("a moment of zero makes no force")
        return self

    def dipole(self) -> TargetDipole:
        """Return the target's moment."""
        if self.fixed_A_m2 is not None:
            return TargetDipole(tuple(self.fixed_A_m2))
        return TargetDipole(self.steered_A_m2, steered=True)


class Orbit(Part):
    """Orbit of the centre of mass."""

    semi_major_axis_m: Positive
    eccentricity: Annotated[float, Field(ge=0, lt=1)]
    mu_m3_per_s2: Positive = 3.986004418e14


class Believed(Part):
    """What the flight software believes: a circular orbit of the same semi-major axis, and this mass."""

    mass_kg: Positive = Field(description="m0, in the place of m_C m_T/(m_C + m_T)")


class Environment(Part):
    """What acts from outside on each craft."""

    chaser: OuterForce = OuterForce()
    target: OuterForce = OuterForce()


class Piece(Part):
    """Share of the fault for from_s < t <= until_s."""

    from_s: NonNegative
    until_s: Positive
    constant: float = 0.0
    amplitude: float = 0.0
    frequency_rad_per_s: NonNegative = 0.0
    phase_rad: float = 0.0

    @model_validator(mode="after")
    def _forward(self) -> Piece:
        if self.until_s <= self.from_s:
            raise ValueError(f"until_s {self.until_s:g} is not after from_s {self.from_s:g}")
        return self


class Fault(Part):
    """A force that the actuator adds, on the believed mass (E = B); zero outside the pieces."""

    force_N: Vector = [0.0, 0.0, 0.0]
    piece: list[Piece] = []

    @model_validator(mode="after")
    def _apart(self) -> Fault:
        ordered = sorted(self.piece, key=lambda piece: piece.from_s)
        for first, second in itertools.pairwise(ordered):
            if second.from_s < first.until_s:
                raise ValueError(f"the pieces from {first.from_s:g} s and from {second.from_s:g} s overlap")
        return self

    def profile(self) -> FaultProfile:
        """Return the fault as a function of time."""
        pieces = (
            FaultPiece(p.from_s, p.until_s, p.constant, p.amplitude, p.frequency_rad_per_s, p.phase_rad)
            for p in self.piece
        )
        return FaultProfile(tuple(self.force_N), tuple(pieces))


class Sensors(Part):
    """Errors of the measurement: a sine, and white noise drawn as [noise] says."""

    position_error_m: Vector = [0.0, 0.0, 0.0]
    velocity_error_m_per_s: Vector = [0.0, 0.0, 0.0]
    error_frequency_rad_per_s: NonNegative = 0.0
    position_deviation_m: NonNegative = 0.0
    velocity_deviation_m_per_s: NonNegative = 0.0

    def sine(self, amplitude: list[float]) -> Harmonics:
        """Return an error that is a sine of these amplitudes."""
        return Harmonics(frequencies=(self.error_frequency_rad_per_s,), amplitudes=(tuple(amplitude),))


class Initial(Part):
    """State at t = 0, chaser from target, orbit frame."""

    position_m: Vector
    velocity_m_per_s: Vector = [0.0, 0.0, 0.0]
    anomaly_rad: float = 0.0


class Inversion(Part):
    """How a force becomes the chaser's moment: damped least squares (`casadi_gnc.mechanics.dipoles`)."""

    damping: Annotated[float, Field(ge=0, lt=1)] | None = Field(
        default=None, description="d, 0.05 if left out; 0 is the exact inverse. Of the actuator moment only"
    )
    singular_below: Annotated[float, Field(gt=0, lt=1)] = Field(
        default=0.05, description="|cosine| of line of sight and target moment that is reported as singular"
    )


class SchemeKeys(Part):
    """How far a law may ask, and how its force becomes the chaser's moment."""

    force_limit_N: Annotated[list[Positive], Field(min_length=3, max_length=3)]
    allocation: Inversion = Inversion()
