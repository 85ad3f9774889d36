"""Two craft that dock by their magnetic coils, on an elliptic orbit.

Tables of the file: [spacecraft] with the target's moment, [orbit], [believed], [environment], [fault],
[sensors], [initial]. Source: Shi, Liu, Biggs, Sun, Yue (2020), doi:10.1016/j.ast.2020.105759.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, ClassVar, Literal, cast

import casadi as ca
import numpy as np
from pydantic import Field, model_validator

from casadi_gnc.allocation import Direct
from casadi_gnc.checking import flown, numbers
from casadi_gnc.checks import Check
from casadi_gnc.mechanics.relative_motion import EllipticOrbit, PairModel
from casadi_gnc.missions.actuation import Actuation
from casadi_gnc.missions.craft import Craft
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.panel import Panel
from casadi_gnc.missions.scene import Arrow, Scene
from casadi_gnc.missions.scheme import Scheme
from casadi_gnc.signals import Layout, Signal
from casadi_gnc.tables.part import MisfitError, Part, Positive, Vector, table

from .coils import Coil
from .plant import DockingPair, MeasurementNoise
from .tables import (
    Believed,
    Environment,
    Fault,
    Initial,
    Orbit,
    SchemeKeys,
    Sensors,
    TargetMoment,
)

#: What a scheme wants: the force on the chaser.
FORCE = Layout((Signal("force", 3, "N", "orbit"),))
#: Mean radius of the Earth, [m]; only a warning rests on it.
EARTH_RADIUS = 6.371e6
#: Gravitational parameter [m^3/s^2] from which the orbit is one about the Earth, or about something heavier.
_EARTH = 3e14


class DockingPairCraft(Craft):
    """Two craft that dock by their coils: masses, actuator, port."""

    scheme_keys: ClassVar[type[Part]] = SchemeKeys
    example: ClassVar[str | None] = "shi2020/docking"

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
    orbit: Orbit = table()
    believed: Believed = table()
    environment: Environment = table(Environment())
    fault: Fault = table(Fault())
    sensors: Sensors = table(Sensors())
    initial: Initial = table()

    @model_validator(mode="after")
    def _fits(self) -> DockingPairCraft:
        if (self.actuator == "moment") != (self.max_moment_A_m2 is not None):
            raise ValueError('the actuator "moment", and no other, takes max_moment_A_m2')
        if not any(self.initial.position_m):
            raise MisfitError("both craft are at one place", "initial", "position_m")
        return self

    @property
    def nearest(self) -> float:
        """Distance [m] below which coils are no dipoles; 0 where no radius is given."""
        return self.near_field_radii * (self.coil_radius_m or 0.0)

    def _elliptic_orbit(self) -> EllipticOrbit:
        return EllipticOrbit(self.orbit.semi_major_axis_m, self.orbit.eccentricity, self.orbit.mu_m3_per_s2)

    def plant(self) -> DockingPair:
        """Return the truth."""
        sensors, outside = self.sensors, self.environment
        return DockingPair(
            self.chaser_mass_kg,
            self.target_mass_kg,
            self._elliptic_orbit(),
            self.target_moment.dipole(),
            self.belief(),
            self.actuator,
            on_chaser=outside.chaser.force(),
            on_target=outside.target.force(),
            fault=self.fault.profile(),
            position_error=sensors.sine(sensors.position_error_m),
            velocity_error=sensors.sine(sensors.velocity_error_m_per_s),
            white=MeasurementNoise(sensors.position_deviation_m, sensors.velocity_deviation_m_per_s),
            reach=self.reach_m,
            speed_limit=self.speed_limit_m_per_s,
        )

    def start(self) -> dict[str, Any]:
        """Return the relative state and the anomaly at t = 0."""
        begun = self.initial
        return {"position": begun.position_m, "velocity": begun.velocity_m_per_s, "anomaly": [begun.anomaly_rad]}

    def belief(self) -> PairModel:
        """Return the pair on a circular orbit that the flight software believes in."""
        reduced = self.chaser_mass_kg * self.target_mass_kg / (self.chaser_mass_kg + self.target_mass_kg)
        x, y, z = self.port_m
        return PairModel(self.believed.mass_kg, self._elliptic_orbit().mean_rate, (x, y, z), reduced)

    def actuation(self, keys: Part | None = None) -> Actuation:
        """Return the actuation of a scheme: a moment by the damped inverse, or the force itself."""
        told = cast(SchemeKeys, keys)
        limit, options = told.force_limit_N, told.allocation
        if self.actuator == "force" and options.damping is not None:
            message = 'the actuator is the force itself: nothing is inverted; take actuator = "moment"'
            raise MisfitError(message, "allocation", "damping")
        damping = 0.05 if options.damping is None else options.damping
        coil = Coil(self.target_moment.dipole(), damping, options.singular_below, self.nearest)
        most = [self.max_moment_A_m2] * 3 if self.max_moment_A_m2 is not None else limit
        by_moment = self.actuator == "moment"
        return Actuation(
            effectiveness=coil.effectiveness if by_moment else ca.DM.eye(3),
            lower=[-value for value in most],
            upper=most,
            effort=FORCE,
            judge=coil.judge,
            inverse=coil.moment if by_moment else None,
            limit_below=[-value for value in limit],
            limit_above=limit,
            allocator=Direct(),
        )

    def regulated(self, mission: Mission) -> dict[str, list[float]]:
        """Return rest at the port."""
        return {"position": self.port_m, "velocity": [0.0] * 3}

    def panels(self, mission: Mission) -> tuple[Panel, ...]:
        """Return miss, velocity, force, moment and torque."""
        return (
            Panel("tracked", "miss", "miss"),
            Panel("lines", "velocity", "velocity"),
            Panel("effort", "force", "force"),
            Panel("lines", "moment", "moment", 1e-3, "kA m²"),
            Panel("lines", "chaser_torque", "torque on chaser"),
        )

    def scene(self, mission: Mission) -> Scene:
        """Return the chaser on its way to the target, seen in the orbit frame."""
        return Scene(
            reference="orbit frame",
            position="position",
            other="target",
            arrows=(Arrow("achieved", "force", "reference"), Arrow("velocity", "velocity", "reference")),
        )

    @property
    def _perigee(self) -> float:
        return self.orbit.semi_major_axis_m * (1 - self.orbit.eccentricity)

    def checks(self, mission: Mission, scheme: Scheme) -> Iterator[Check]:
        """Yield whether the orbit is one, about the Earth, and how near the target's centre the chaser comes."""
        if self.orbit.mu_m3_per_s2 > _EARTH:
            yield from numbers.orbit(self.orbit.eccentricity, self._perigee, EARTH_RADIUS)
        closest = max(math.hypot(*self.port_m) / 2, 2 * (self.coil_radius_m or 0.0))
        if closest and flown.can_fly(mission, scheme):
            _, states = flown.path(mission, scheme)
            distance = np.linalg.norm(states[:, mission.truth.state.place("position")], axis=1)
            yield Check(
                "docking.clearance",
                float(distance.min()),
                closest,
                "m",
                "fail",
                "On its way to the port the chaser flies through the target: the law knows nothing of it.",
                "Start on the port's side of the target, or lead the chaser there by way points.",
                "least distance of the centres without noise, against half of the port's and two radii of a coil",
                at_least=True,
            )

    def notes(self) -> tuple[str, ...]:
        """Return what the models leave out."""
        told = []
        if self._perigee < EARTH_RADIUS and self.orbit.mu_m3_per_s2 > _EARTH:
            told.append("The perigee lies below the Earth's surface.")
        if self.actuator == "force":
            told.append(
                "The actuator is the force itself; the moment is found afterwards and what it cannot make is flown."
            )
        if math.hypot(*self.port_m) < self.nearest:
            told.append(
                f"The port lies nearer than {self.nearest:g} m, where coils are no dipoles: "
                "the last forces are guesses."
            )
        return tuple(told)

    def key_of(self, signal: str) -> tuple[str, ...]:
        """Return the key of [initial]."""
        return ("initial", {"position": "position_m", "velocity": "velocity_m_per_s"}[signal])
