"""Two craft that dock by their magnetic coils, on an elliptic orbit.

Tables of the file: [spacecraft] with the target's moment, [orbit], [believed], [environment], [fault],
[sensors], [initial]. Source: Shi, Liu, Biggs, Sun, Yue (2020), doi:10.1016/j.ast.2020.105759.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import Annotated, Any, Literal

import casadi as ca
from pydantic import Field, model_validator

from casadi_gnc.allocation.in_flight import Direct
from casadi_gnc.checks import Check
from casadi_gnc.errors import ProblemError
from casadi_gnc.mechanics import dipoles
from casadi_gnc.mechanics.dipoles import TargetDipole
from casadi_gnc.mechanics.disturbances import Harmonics
from casadi_gnc.mechanics.relative_motion import EllipticOrbit, PairModel
from casadi_gnc.missions.mission import Actuation, Panel
from casadi_gnc.problem_files.schema import MissionModel, NonNegative, Part, Positive, SchemeModel, Vector, law_tables
from casadi_gnc.signals import Layout, Signal
from casadi_gnc.status import StepStatus
from casadi_gnc.vehicles import Craft, Where
from casadi_gnc.vehicles.docking_pair.plant import DockingPair, FaultPiece, FaultProfile, MeasurementNoise

#: What a scheme wants: the force on the chaser.
FORCE = Layout((Signal("force", 3, "N", "orbit"),))
#: Mean radius of the Earth, [m]; only a warning rests on it.
EARTH_RADIUS = 6.371e6


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


class Spacecraft(Part):
    """Both craft."""

    model: Literal["docking_pair"]
    chaser_mass_kg: Positive
    target_mass_kg: Positive
    actuator: Literal["moment", "force"] = Field(
        default="moment", description="of the chaser; force: as if the force could be commanded, the moment found after"
    )
    max_moment_A_m2: Positive | None = Field(default=None, description="of the chaser, per axis")
    target_moment: TargetMoment
    port_m: Vector = Field(default=[0.0, 0.0, 0.0], description="where the chaser comes to rest, seen from the target")
    coil_radius_m: Positive | None = Field(default=None, description="for the warning of the near field")
    near_field_radii: Positive = Field(default=8.0, description="distance below which coils are no dipoles")
    reach_m: Positive = Field(default=1e4, description="larger measured positions per axis are rejected")
    speed_limit_m_per_s: Positive = Field(default=1e2, description="larger measured velocities per axis are rejected")

    @model_validator(mode="after")
    def _has_limit(self) -> Spacecraft:
        if (self.actuator == "moment") != (self.max_moment_A_m2 is not None):
            raise ValueError('the actuator "moment", and no other, takes max_moment_A_m2')
        return self


class Orbit(Part):
    """Orbit of the centre of mass."""

    semi_major_axis_m: Positive
    eccentricity: Annotated[float, Field(ge=0, lt=1)]
    mu_m3_per_s2: Positive = 3.986004418e14


class Believed(Part):
    """What the flight software believes: a circular orbit of the same semi-major axis, and this mass."""

    mass_kg: Positive = Field(description="m0, in the place of m_C m_T/(m_C + m_T)")


class Harmonic(Part):
    """One harmonic of a force."""

    frequency_rad_per_s: Positive
    amplitude_N: Vector
    phase_rad: float = Field(default=0.0, description="at t = 0; pi/2 for a cosine")


class OuterForce(Part):
    """What acts on one craft from outside."""

    constant_N: Vector = [0.0, 0.0, 0.0]
    harmonic: list[Harmonic] = []

    def force(self) -> Harmonics:
        """Return the force as a function of time."""
        return Harmonics(
            tuple(self.constant_N),
            tuple(each.frequency_rad_per_s for each in self.harmonic),
            tuple(tuple(each.amplitude_N) for each in self.harmonic),
            tuple(each.phase_rad for each in self.harmonic),
        )


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


_Laws = law_tables("intermediate_observer", "position_disturbance_observer")


class Scheme(SchemeModel):
    """A scheme of this craft."""

    force_limit_N: Annotated[list[Positive], Field(min_length=3, max_length=3)]
    law: _Laws  # type: ignore[valid-type]
    allocation: Inversion = Inversion()


class MissionFile(MissionModel):
    """A mission of an electromagnetic docking pair."""

    spacecraft: Spacecraft
    orbit: Orbit
    believed: Believed
    environment: Environment = Environment()
    fault: Fault = Fault()
    sensors: Sensors = Sensors()
    initial: Initial
    scheme: Annotated[list[Scheme], Field(min_length=1)]


def build(model: MissionFile, where: Where) -> Craft:
    """Return the craft that a file describes."""
    craft, sensors, given = model.spacecraft, model.sensors, model.orbit
    orbit = EllipticOrbit(given.semi_major_axis_m, given.eccentricity, given.mu_m3_per_s2)
    reduced = craft.chaser_mass_kg * craft.target_mass_kg / (craft.chaser_mass_kg + craft.target_mass_kg)
    x, y, z = craft.port_m
    believed = PairModel(model.believed.mass_kg, orbit.mean_rate, (x, y, z), reduced)
    for i, scheme in enumerate(model.scheme):
        if craft.actuator == "force" and scheme.allocation.damping is not None:
            place = where(("scheme", i, "allocation", "damping"))
            raise ProblemError('the actuator is the force itself: nothing is inverted; take actuator = "moment"', place)
    if not any(model.initial.position_m):
        raise ProblemError("both craft are at one place", where(("initial", "position_m")))
    plant = DockingPair(
        craft.chaser_mass_kg,
        craft.target_mass_kg,
        orbit,
        craft.target_moment.dipole(),
        believed,
        craft.actuator,
        on_chaser=model.environment.chaser.force(),
        on_target=model.environment.target.force(),
        fault=model.fault.profile(),
        position_error=sensors.sine(sensors.position_error_m),
        velocity_error=sensors.sine(sensors.velocity_error_m_per_s),
        white=MeasurementNoise(sensors.position_deviation_m, sensors.velocity_deviation_m_per_s),
        reach=craft.reach_m,
        speed_limit=craft.speed_limit_m_per_s,
    )
    return Craft(
        plant=plant,
        start=[*model.initial.position_m, *model.initial.velocity_m_per_s, model.initial.anomaly_rad],
        start_keys={"position": "position_m", "velocity": "velocity_m_per_s"},
        believed=believed,
        actuation=lambda scheme: _actuation(scheme, craft, plant),
        target={"position": craft.port_m, "velocity": [0.0] * 3},
        checks=lambda mission, scheme: _checks(given),
        panels=(
            Panel("tracked", "miss", "miss"),
            Panel("lines", "velocity", "velocity"),
            Panel("effort", "force", "force"),
            Panel("lines", "moment", "moment", 1e-3, "kA m²"),
            Panel("lines", "chaser_torque", "torque on chaser"),
        ),
        notes=_notes(craft, given),
    )


def _checks(orbit: Orbit) -> Iterator[Check]:
    """Yield whether the orbit is one, about the Earth."""
    from casadi_gnc.checking import numbers

    if orbit.mu_m3_per_s2 > 3e14:
        yield from numbers.orbit(orbit.eccentricity, orbit.semi_major_axis_m * (1 - orbit.eccentricity), EARTH_RADIUS)


def _notes(craft: Spacecraft, orbit: Orbit) -> tuple[str, ...]:
    told = []
    if orbit.semi_major_axis_m * (1 - orbit.eccentricity) < EARTH_RADIUS and orbit.mu_m3_per_s2 > 3e14:
        told.append("The perigee lies below the Earth's surface.")
    if craft.actuator == "force":
        told.append(
            "The actuator is the force itself; the moment is found afterwards and what it cannot make is flown."
        )
    nearest = craft.near_field_radii * (craft.coil_radius_m or 0.0)
    if math.hypot(*craft.port_m) < nearest:
        told.append(
            f"The port lies nearer than {nearest:g} m, where coils are no dipoles: the last forces are guesses."
        )
    return tuple(told)


def _actuation(scheme: Scheme, craft: Spacecraft, plant: DockingPair) -> Actuation:
    limit, target, options = scheme.force_limit_N, plant.target, scheme.allocation
    nearest = craft.near_field_radii * (craft.coil_radius_m or 0.0)
    damping = 0.05 if options.damping is None else options.damping

    def judge(seen: Any, limited: Any, actuators: Any) -> dict[StepStatus, Any]:
        flags = {
            StepStatus.ALLOCATION_SINGULAR: dipoles.alignment(seen.position, target.at(seen.position))
            < options.singular_below
        }
        if nearest:
            flags[StepStatus.NEAR_FIELD] = dipoles.length(seen.position) < nearest
        return flags

    most = [craft.max_moment_A_m2] * 3 if craft.max_moment_A_m2 is not None else limit
    common: dict[str, Any] = {
        "lower": [-value for value in most],
        "upper": list(most),
        "rate": math.inf,
        "limit_below": [-value for value in limit],
        "limit_above": limit,
        "allocator": Direct(),
        "effort": FORCE,
        "judge": judge,
    }
    if craft.actuator == "force":
        return Actuation(effectiveness=ca.DM.eye(3), **common)
    return Actuation(
        effectiveness=lambda seen: dipoles.force_map(seen.position, target.at(seen.position)),
        inverse=lambda seen, force: dipoles.moment_for(force, seen.position, target.at(seen.position), damping),
        **common,
    )
