"""The combined spacecraft of a capture: chaser, locked arm and target on the chaser's thrusters.

Tables of the file: [spacecraft] with thrusters and engine, [truth], [believed], [environment], [initial].
Source: Huang, Biggs, Duan (2020), doi:10.1016/j.ast.2019.105572.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Literal, cast

import casadi as ca
import numpy as np
from pydantic import Field, model_validator

from casadi_gnc.allocation import AllocationProblem
from casadi_gnc.checking import geometry
from casadi_gnc.checks import Check
from casadi_gnc.mathematics.exact import array
from casadi_gnc.mechanics.rigid_body import RigidBody
from casadi_gnc.mechanics.thrusters import ThrusterGeometry
from casadi_gnc.missions.actuation import Actuation, Actuators
from casadi_gnc.missions.craft import Craft
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.panel import Panel
from casadi_gnc.missions.scene import Arrow, Jets, Scene
from casadi_gnc.missions.scheme import Scheme
from casadi_gnc.tables import matrices
from casadi_gnc.tables.allocation import mass_centre
from casadi_gnc.tables.attitude import AttitudeStart
from casadi_gnc.tables.disturbances import OrbitAndTorque
from casadi_gnc.tables.orientation import Orientation
from casadi_gnc.tables.part import MisfitError, Part, Positive, Vector, table
from casadi_gnc.tables.thrusters import Engine, Thrusters

from .plant import BodyPart, CombinedSpacecraft, compose_inertia
from .tables import (
    Believed,
    BodyPartTable,
    RobustAgainstMassCentre,
    SchemeKeys,
    Truth,
)

#: Smallest over largest singular value below which thrusters leave an axis out.
_FLAT = 1e-9


@dataclass(frozen=True, eq=False)
class _View:
    """The craft's actuators in one view of it: the known one, the true one or the believed one."""

    rotation: ca.DM
    thrusters: ThrusterGeometry
    engine_torque: tuple[float, ...]


class CombinedSpacecraftCraft(Craft, Orientation):
    """A chaser with its captured target on thrusters, as known: inertia, frames, engine, thrusters."""

    scheme_keys: ClassVar[type[Part]] = SchemeKeys
    example: ClassVar[str | None] = "huang2020/detumble"

    inertia_kg_m2: matrices.Inertia | None = Field(
        default=None, description="about the combined centre of mass, combined frame"
    )
    part: list[BodyPartTable] = Field(
        default=[], description="parts from which the inertia is composed instead (eq. 70)"
    )
    centre_of_mass_m: Vector = Field(description="of the combined body from the chaser's, chaser frame")
    rate_limit_rad_per_s: Positive = Field(default=10.0, description="larger measured rates per axis are rejected")
    orbit_engine: Engine | None = None
    thrusters: Thrusters
    truth: Truth = table(Truth())
    believed: Believed = table(Believed())
    environment: OrbitAndTorque = table(OrbitAndTorque())
    initial: AttitudeStart = table()

    @model_validator(mode="after")
    def _one_inertia(self) -> CombinedSpacecraftCraft:
        if (self.inertia_kg_m2 is None) == (not self.part):
            raise ValueError("give either inertia_kg_m2 or one or more [[spacecraft.part]], not both")
        return self

    def known_inertia(self) -> ca.DM:
        """Return the inertia as known, (3, 3), [kg m^2], about the combined centre of mass."""
        if self.inertia_kg_m2 is not None:
            return array(self.inertia_kg_m2)
        return compose_inertia(
            [BodyPart(part.mass_kg, part.inertia_kg_m2, part.position_m, part.matrix()) for part in self.part]
        )

    def plant(self) -> CombinedSpacecraft:
        """Return the truth."""
        truth, known = self.truth, self.known_inertia()
        centre = [c + e for c, e in zip(self.centre_of_mass_m, truth.centre_of_mass_error_m, strict=True)]
        real = self._view(self.matrix(), centre)
        inertia = known * truth.inertia_factor if truth.inertia_kg_m2 is None else array(truth.inertia_kg_m2)
        return CombinedSpacecraft(
            RigidBody(inertia, real.engine_torque, self.environment.orbit_rate_rad_per_s),
            real.thrusters.effectiveness,
            self.environment.disturbance(),
            self.rate_limit_rad_per_s,
            self.environment.frame_rate,
        )

    def start(self) -> dict[str, list[float]]:
        """Return attitude and rate at t = 0."""
        return self.initial.state()

    def belief(self) -> RigidBody:
        """Return the body that the flight software believes in."""
        told = self.believed.inertia_kg_m2
        inertia = self.known_inertia() if told is None else array(told)
        return RigidBody(inertia, self._thought().engine_torque, self.environment.orbit_rate_rad_per_s)

    def actuators(self) -> Actuators:
        """Return the thrusters as the flight software sees them."""
        thrusters, seen = self.thrusters, self._thought().thrusters
        return Actuators(
            effectiveness=seen.effectiveness,
            lower=[thrusters.min_force_N] * seen.count,
            upper=[thrusters.max_force_N] * seen.count,
            rate=thrusters.max_force_rate_N_per_s or float("inf"),
        )

    def actuation(self, keys: Part | None = None) -> Actuation:
        """Return the actuation of a scheme."""
        told = cast(SchemeKeys, keys)
        return Actuation.of(self.actuators(), told.torque_limit_N_m, told.allocation.allocator(self._problem(told)))

    def _problem(self, told: SchemeKeys) -> AllocationProblem | None:
        """Return the problem of a robust allocation; none of another."""
        if not isinstance(told.allocation, RobustAgainstMassCentre):
            return None
        half, thought = told.allocation.centre_of_mass_error_m, self._thought()
        return AllocationProblem.of_thrusters(
            thought.thrusters,
            thought.rotation,
            ([-value for value in half], half),
            lower=self.thrusters.min_force_N,
            upper=self.thrusters.max_force_N,
            **told.allocation.weights(),
        )

    def regulated(self, mission: Mission) -> dict[str, list[float]]:
        """Return rest; and no turn, where a funnel says that the attitude matters."""
        return {"mrp": [0.0] * 3, "rate": [0.0] * 3} if mission.funnels else {"rate": [0.0] * 3}

    def panels(self, mission: Mission) -> tuple[Panel, ...]:
        """Return attitude or rate, torque, thrusters."""
        return (
            Panel("tracked", "mrp", "attitude MRP") if mission.funnels else Panel("tracked", "rate", "rate"),
            Panel("effort", "torque", "torque", 1e3, "mN m"),
            Panel("actuators", "force", "force, thruster no.", 1e3, "mN"),
        )

    def scene(self, mission: Mission) -> Scene:
        """Return the chaser as the box that holds its thrusters, about the combined centre of mass."""
        thrusters, known = self.thrusters, self._view(self.matrix(), self.centre_of_mass_m).thrusters
        corners = np.array([np.min(thrusters.positions_m, axis=0), np.max(thrusters.positions_m, axis=0)])
        return Scene(
            attitude="mrp",
            reference="orbit frame",
            size=[float(value) for value in np.maximum(corners[1] - corners[0], 0.02)],
            centre=[float(value) for value in corners.mean(axis=0) - self.centre_of_mass_m],
            turned=np.array(self.matrix()).tolist(),
            jets=Jets(
                "force",
                np.array(known.positions).T.tolist(),
                np.array(known.directions).T.tolist(),
                [thrusters.max_force_N] * known.count,
            ),
            arrows=(Arrow("rate", "rate"), Arrow("achieved", "torque of the thrusters")),
        )

    def checks(self, mission: Mission, scheme: Scheme) -> Iterator[Check]:
        """Yield how far the frame of the attitude ought to turn, where it does not, and what axes are believed in."""
        yield from geometry.orbit_frame(self.environment, mission)
        if self.believed.turned() is not None:
            yield geometry.believed_axes(self.matrix(), self.believed.matrix())

    def claimed(
        self, mission: Mission, scheme: Scheme, by: Literal["allocation", "theorem"]
    ) -> dict[str, tuple[float, float]]:
        """Return the errors of the centre of mass that a robust allocation is set up for."""
        told = cast(SchemeKeys, scheme.keys).allocation
        if by == "theorem" or not isinstance(told, RobustAgainstMassCentre):
            return {}
        return mass_centre(told.centre_of_mass_error_m)

    def mass_centre_key(self) -> str:
        """Return the key of the error of the centre of mass."""
        return "truth.centre_of_mass_error_m"

    def flaws(self) -> Iterator[MisfitError]:
        """Yield whether the thrusters leave an axis out."""
        strength = np.linalg.svd(np.array(self._thought().thrusters.effectiveness), compute_uv=False)
        if len(strength) < 3 or strength[2] < _FLAT * strength[0]:
            yield MisfitError(
                "the thrusters make no torque about some axis; add or turn one", "spacecraft", "thrusters"
            )

    def key_of(self, signal: str) -> tuple[str, ...]:
        """Return the key of [initial]."""
        return ("initial", {"mrp": "mrp", "rate": "rate_rad_per_s"}[signal])

    def _view(self, rotation: ca.DM, centre: list[float]) -> _View:
        """Return thrusters and engine about a mass centre [m], in the frame that `rotation` leads to."""
        engine = self.orbit_engine
        torque = [0.0, 0.0, 0.0] if engine is None else engine.torque(rotation, centre)
        return _View(rotation, self.thrusters.mounted().seen_from(rotation, centre), tuple(torque))

    def _thought(self) -> _View:
        """Return what the flight software believes of thrusters and engine."""
        told = self.believed
        rotation = self.matrix() if told.turned() is None else told.matrix()
        return self._view(rotation, told.centre_of_mass_m or self.centre_of_mass_m)
