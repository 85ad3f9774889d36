"""The combined spacecraft of a capture: chaser, locked arm and target on the chaser's thrusters.

Tables of the file: [spacecraft] with thrusters and engine, [truth], [believed], [environment],
[initial]. Source: Huang, Biggs, Duan (2020), doi:10.1016/j.ast.2019.105572.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

import casadi as ca
import numpy as np
from pydantic import Field, field_validator, model_validator

from casadi_gnc.allocation import AllocationProblem, OnlineInFlight, PseudoInverse, SolverInFlight
from casadi_gnc.errors import ProblemError
from casadi_gnc.mechanics.disturbances import Harmonics
from casadi_gnc.mechanics.rigid_body import RigidBody
from casadi_gnc.mechanics.thrusters import ThrusterGeometry
from casadi_gnc.missions.mission import Actuation, Panel
from casadi_gnc.problem_files.schema import (
    Matrix,
    MissionModel,
    NonNegative,
    Orientation,
    Part,
    Positive,
    Rows,
    SchemeModel,
    Vector,
    law_tables,
    orientation,
)
from casadi_gnc.tables import matrices
from casadi_gnc.vehicles import Craft, Where
from casadi_gnc.vehicles.combined_spacecraft.plant import BodyPart, CombinedSpacecraft, compose_inertia


class Engine(Part):
    """The orbit-control engine, in the chaser's frame."""

    force_N: NonNegative
    position_m: Vector
    direction: Vector

    _unit = field_validator("direction")(matrices.check_unit)


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
        return [matrices.check_unit(row, f"thruster {i}: ") for i, row in enumerate(value, 1)]

    @model_validator(mode="after")
    def _fit(self) -> Thrusters:
        if len(self.positions_m) != len(self.directions):
            raise ValueError(f"{len(self.positions_m)} positions but {len(self.directions)} directions")
        if self.min_force_N > self.max_force_N:
            raise ValueError(f"min_force_N {self.min_force_N} exceeds max_force_N {self.max_force_N}")
        return self


class BodyPartModel(Orientation):
    """One part of the composed body (eq. 70); orientation is part frame -> combined frame."""

    mass_kg: Positive
    inertia_kg_m2: Matrix
    position_m: Vector

    _spd = field_validator("inertia_kg_m2")(matrices.check_inertia)


class Spacecraft(Orientation):
    """The craft as known: inertia, frames, engine and thrusters."""

    model: Literal["combined_spacecraft"]
    inertia_kg_m2: Matrix | None = Field(default=None, description="about the combined centre of mass, combined frame")
    part: list[BodyPartModel] = Field(
        default=[], description="parts from which the inertia is composed instead (eq. 70)"
    )
    centre_of_mass_m: Vector = Field(description="of the combined body from the chaser's, chaser frame")
    rate_limit_rad_per_s: Positive = Field(default=10.0, description="larger measured rates per axis are rejected")
    orbit_engine: Engine | None = None
    thrusters: Thrusters

    @field_validator("inertia_kg_m2")
    @classmethod
    def _spd(cls, value: list[list[float]] | None) -> list[list[float]] | None:
        return None if value is None else matrices.check_inertia(value)

    @model_validator(mode="after")
    def _one_inertia(self) -> Spacecraft:
        if (self.inertia_kg_m2 is None) == (not self.part):
            raise ValueError("give either inertia_kg_m2 or one or more [[spacecraft.part]], not both")
        return self


class Truth(Part):
    """How the real craft differs from the known one."""

    inertia_factor: Positive = 1.0
    inertia_kg_m2: Matrix | None = Field(default=None, description="true inertia, instead of a factor")
    centre_of_mass_error_m: Vector = Field(default=[0.0, 0.0, 0.0], description="true minus known, chaser frame")

    @field_validator("inertia_kg_m2")
    @classmethod
    def _spd(cls, value: list[list[float]] | None) -> list[list[float]] | None:
        return None if value is None else matrices.check_inertia(value)


class Believed(Orientation):
    """What the flight software believes where that differs from the known craft."""

    inertia_kg_m2: Matrix | None = None
    centre_of_mass_m: Vector | None = None

    @field_validator("inertia_kg_m2")
    @classmethod
    def _spd(cls, value: list[list[float]] | None) -> list[list[float]] | None:
        return None if value is None else matrices.check_inertia(value)


class Harmonic(Part):
    """One harmonic of the disturbance torque."""

    frequency_rad_per_s: Positive
    amplitude_N_m: Vector
    phase_rad: float = Field(default=0.0, description="at t = 0; pi/2 for a cosine")


class Environment(Part):
    """What acts from outside."""

    orbit_rate_rad_per_s: NonNegative = 0.0
    constant_torque_N_m: Vector = [0.0, 0.0, 0.0]
    harmonic: list[Harmonic] = []

    def disturbance(self) -> Harmonics:
        """Return the torque that acts besides gravity."""
        return Harmonics(
            tuple(self.constant_torque_N_m),
            tuple(harmonic.frequency_rad_per_s for harmonic in self.harmonic),
            tuple(tuple(harmonic.amplitude_N_m) for harmonic in self.harmonic),
            tuple(harmonic.phase_rad for harmonic in self.harmonic),
        )


class Initial(Part):
    """State at t = 0."""

    mrp: Vector
    rate_rad_per_s: Vector


class PinvModel(Part):
    """Pseudo-inverse, then clip."""

    method: Literal["pinv"]


class RobustModel(Part):
    """Robust min-max allocation against errors of the centre of mass."""

    method: Literal["robust"]
    backend: Literal["online", "clarabel"] = Field(default="online", description="online: the on-board solver, in C")
    centre_of_mass_error_m: Annotated[list[NonNegative], Field(min_length=3, max_length=3)] = Field(
        description="half width of the box of errors, chaser frame"
    )
    accuracy_weight: Positive = Field(default=1e6, description="h, weight of the squared torque error")
    effort_weight: NonNegative = Field(default=1.0, description="diagonal of M1")
    change_weight: NonNegative = Field(default=1.0, description="diagonal of M2")


_Laws = law_tables("rate_damping", "attitude_pd", "detumble", "prescribed_performance")


class Scheme(SchemeModel):
    """A scheme of this craft."""

    torque_limit_N_m: Annotated[list[Positive], Field(min_length=3, max_length=3)]
    law: _Laws  # type: ignore[valid-type]
    allocation: Annotated[PinvModel | RobustModel, Field(discriminator="method")]


class MissionFile(MissionModel):
    """A mission of the combined spacecraft."""

    spacecraft: Spacecraft
    truth: Truth = Truth()
    believed: Believed = Believed()
    environment: Environment = Environment()
    initial: Initial
    scheme: Annotated[list[Scheme], Field(min_length=1)]


def _inertia(craft: Spacecraft) -> ca.DM:
    if craft.inertia_kg_m2 is not None:
        return ca.DM(craft.inertia_kg_m2)
    parts = []
    for part in craft.part:
        rotation = orientation(part)
        turned = ca.DM.eye(3) if rotation is None else rotation
        parts.append(BodyPart(part.mass_kg, part.inertia_kg_m2, part.position_m, turned))
    return compose_inertia(parts)


class _View:
    """Geometry of one view of the craft: the known one, the true one or the believed one."""

    def __init__(self, craft: Spacecraft, rotation: ca.DM, centre: list[float]) -> None:
        thrusters = craft.thrusters
        mounted = ThrusterGeometry.from_rows(thrusters.positions_m, thrusters.directions)
        self.rotation = rotation
        self.thrusters = mounted.seen_from(rotation, centre)
        self.engine_torque = [0.0, 0.0, 0.0]
        if craft.orbit_engine is not None:
            engine = craft.orbit_engine
            nozzle = ThrusterGeometry.from_rows([engine.position_m], [engine.direction]).seen_from(rotation, centre)
            self.engine_torque = [engine.force_N * entry for entry in np.array(nozzle.effectiveness).ravel()]


def build(model: MissionFile, where: Where) -> Craft:
    """Return the craft that a file describes."""
    craft, truth, environment = model.spacecraft, model.truth, model.environment
    turned = orientation(craft)
    rotation = ca.DM.eye(3) if turned is None else turned
    inertia, centre = _inertia(craft), craft.centre_of_mass_m
    real = _View(craft, rotation, [c + e for c, e in zip(centre, truth.centre_of_mass_error_m, strict=True)])
    true_inertia = inertia * truth.inertia_factor if truth.inertia_kg_m2 is None else ca.DM(truth.inertia_kg_m2)
    plant = CombinedSpacecraft(
        RigidBody(true_inertia, tuple(real.engine_torque), environment.orbit_rate_rad_per_s),
        real.thrusters.effectiveness,
        environment.disturbance(),
        craft.rate_limit_rad_per_s,
    )
    believed = model.believed
    thought_rotation = orientation(believed)
    thought = _View(
        craft,
        rotation if thought_rotation is None else thought_rotation,
        centre if believed.centre_of_mass_m is None else believed.centre_of_mass_m,
    )
    body = RigidBody(
        inertia if believed.inertia_kg_m2 is None else ca.DM(believed.inertia_kg_m2),
        tuple(thought.engine_torque),
        environment.orbit_rate_rad_per_s,
    )
    strength = np.linalg.svd(np.array(thought.thrusters.effectiveness), compute_uv=False)
    if len(strength) < 3 or strength[2] < 1e-9 * strength[0]:
        raise ProblemError(
            "the thrusters make no torque about some axis; add or turn one", where(("spacecraft", "thrusters"))
        )
    return Craft(
        plant=plant,
        start=[*model.initial.mrp, *model.initial.rate_rad_per_s],
        start_keys={"mrp": "mrp", "rate": "rate_rad_per_s"},
        believed=body,
        actuation=lambda scheme: _actuation(scheme, craft.thrusters, thought),
        target={"mrp": [0.0] * 3, "rate": [0.0] * 3} if model.funnel else {"rate": [0.0] * 3},
        panels=(
            Panel("tracked", "mrp", "attitude MRP") if model.funnel else Panel("tracked", "rate", "rate"),
            Panel("effort", "torque", "torque", 1e3, "mN m"),
            Panel("actuators", "force", "force, thruster no.", 1e3, "mN"),
        ),
    )


def _actuation(scheme: Scheme, thrusters: Thrusters, thought: _View) -> Actuation:
    count, limit = thought.thrusters.count, scheme.torque_limit_N_m
    return Actuation(
        effectiveness=thought.thrusters.effectiveness,
        lower=[thrusters.min_force_N] * count,
        upper=[thrusters.max_force_N] * count,
        rate=thrusters.max_force_rate_N_per_s or float("inf"),
        limit_below=[-value for value in limit],
        limit_above=limit,
        allocator=_allocator(scheme.allocation, thrusters, thought),
    )


def _allocator(model: Any, thrusters: Thrusters, thought: _View) -> Any:
    if isinstance(model, PinvModel):
        return PseudoInverse()
    half = model.centre_of_mass_error_m
    problem = AllocationProblem.of_thrusters(
        thought.thrusters,
        thought.rotation,
        ([-value for value in half], half),
        lower=thrusters.min_force_N,
        upper=thrusters.max_force_N,
        effort_weight=model.effort_weight,
        change_weight=model.change_weight,
        accuracy_weight=model.accuracy_weight,
    )
    return OnlineInFlight(problem) if model.backend == "online" else SolverInFlight(problem, model.backend)
