"""A satellite around a free-falling test mass: relative attitude and position in six degrees of freedom.

Tables of the file: [spacecraft], the satellite; [orbit] of the test mass; [believed]; [environment];
[initial]. Source: Tao, Zhang (2019), doi:10.16356/j.1005-1120.2019.04.008.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar, Literal, cast

from pydantic import Field

from casadi_gnc.checking import manoeuvre
from casadi_gnc.checks import Check
from casadi_gnc.laws.drag_free import DragFree
from casadi_gnc.laws.drag_free_motions import Satellite
from casadi_gnc.mathematics.exact import array
from casadi_gnc.mechanics.circular_orbit import CircularOrbit
from casadi_gnc.mechanics.rigid_body import RigidBody
from casadi_gnc.missions.actuation import Actuation
from casadi_gnc.missions.craft import Craft
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.panel import Panel
from casadi_gnc.missions.scene import Arrow, Scene
from casadi_gnc.missions.scheme import Scheme
from casadi_gnc.tables import matrices
from casadi_gnc.tables.disturbances import OrbitalPush
from casadi_gnc.tables.limits import ForceAndTorqueLimits
from casadi_gnc.tables.part import Part, Positive, table

from .plant import DragFreePair
from .tables import Believed, Initial, Orbit

_KEYS = {"mrp": "mrp", "rate": "rate_rad_per_s", "position": "position_m", "velocity": "velocity_m_per_s"}


class DragFreePairCraft(Craft):
    """A satellite around its free test mass: as it is, and the largest measurements of each axis that can be true."""

    scheme_keys: ClassVar[type[Part]] = ForceAndTorqueLimits
    example: ClassVar[str | None] = "tao2019/case1"

    mass_kg: Positive
    inertia_kg_m2: matrices.Inertia = Field(description="about the centre of mass, satellite frame")
    rate_limit_rad_per_s: Positive = 10.0
    position_limit_m: Positive = 10.0
    velocity_limit_m_per_s: Positive = 10.0
    orbit: Orbit = table()
    believed: Believed = table()
    environment: OrbitalPush = table(OrbitalPush())
    initial: Initial = table()

    def _circular_orbit(self) -> CircularOrbit:
        given = self.orbit
        return CircularOrbit(given.body_radius_m + given.altitude_m, given.gravitational_parameter_m3_per_s2)

    def plant(self) -> DragFreePair:
        """Return the truth."""
        return DragFreePair(
            self.mass_kg,
            RigidBody(array(self.inertia_kg_m2)),
            self._circular_orbit(),
            self.environment.disturbance(),
            self.rate_limit_rad_per_s,
            self.position_limit_m,
            self.velocity_limit_m_per_s,
        )

    def start(self) -> dict[str, list[float]]:
        """Return the relative state at t = 0."""
        return {signal: getattr(self.initial, key) for signal, key in _KEYS.items()}

    def belief(self) -> Satellite:
        """Return mass and inertia from which the estimates start, and the orbit."""
        return Satellite(self.believed.mass_kg, array(self.believed.inertia_kg_m2), self._circular_orbit())

    def actuation(self, keys: Part | None = None) -> Actuation:
        """Return the actuation of a scheme: every axis is clipped by itself."""
        return Actuation.direct(self.plant().inputs, cast(ForceAndTorqueLimits, keys).column())

    def regulated(self, mission: Mission) -> dict[str, list[float]]:
        """Return the relative state at zero."""
        return {name: [0.0] * 3 for name in mission.truth.state.names}

    def panels(self, mission: Mission) -> tuple[Panel, ...]:
        """Return position, attitude, efforts."""
        return (
            Panel("tracked", "position", "relative position"),
            Panel("tracked", "mrp", "relative attitude MRPs"),
            Panel("effort", "force", "force"),
            Panel("effort", "torque", "torque"),
        )

    def scene(self, mission: Mission) -> Scene:
        """Return the satellite about its test mass, seen in the frame of the test mass."""
        return Scene(
            attitude="mrp",
            reference="test-mass frame",
            position="position",
            position_frame="body",
            other="test mass",
            arrows=(Arrow("achieved_force", "force"), Arrow("achieved_torque", "torque")),
        )

    def checks(self, mission: Mission, scheme: Scheme) -> Iterator[Check]:
        """Yield whether the law's own handling of saturation lets it keep its funnels."""
        for signal in _shifted(scheme):
            yield from manoeuvre.auxiliary(mission, scheme, signal)

    def claimed(
        self, mission: Mission, scheme: Scheme, by: Literal["allocation", "theorem"]
    ) -> dict[str, tuple[float, float]]:
        """Return masses and inertias that the law's theorem covers."""
        if by == "allocation":
            return {}
        names = {"mass": "mass_kg", "inertia": "inertia_kg_m2"}
        parts = ((name.partition("."), ends) for name, ends in scheme.law.covers().items())
        return {f"spacecraft.{names[head]}{dot}{rest}": ends for (head, dot, rest), ends in parts if head in names}

    def rehearses(self, mission: Mission, scheme: Scheme) -> bool:
        """Return whether there is such a funnel."""
        return any(funnel.signal in _shifted(scheme) for funnel in mission.funnels)

    def key_of(self, signal: str) -> tuple[str, ...]:
        """Return the key of [initial]."""
        return ("initial", _KEYS[signal])


def _shifted(scheme: Scheme) -> list[str]:
    """Return the signals whose funnel a law keeps while it shifts their errors by what saturation cost."""
    law = scheme.law
    if not isinstance(law, DragFree):
        return []
    handled = (("mrp", law.torque_saturation), ("position", law.force_saturation))
    return [signal for signal, handling in handled if law.keeps(signal) and handling == "auxiliary"]
