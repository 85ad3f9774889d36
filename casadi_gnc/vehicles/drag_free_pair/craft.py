"""A satellite around a free-falling test mass: relative attitude and position in six degrees of freedom.

Tables of the file: [spacecraft], the satellite; [orbit] of the test mass; [believed]; [environment];
[initial]. Source: Tao, Zhang (2019), doi:10.16356/j.1005-1120.2019.04.008.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal, cast

import casadi as ca
import numpy as np
from pydantic import Field, field_validator

from casadi_gnc.allocation.in_flight import Direct
from casadi_gnc.checks import Check
from casadi_gnc.laws.drag_free import DragFree
from casadi_gnc.laws.drag_free_motions import Satellite
from casadi_gnc.mechanics.circular_orbit import EARTH_MU, EARTH_RADIUS, CircularOrbit
from casadi_gnc.mechanics.rigid_body import RigidBody
from casadi_gnc.missions.mission import Actuation, Mission, Panel
from casadi_gnc.missions.mission import Scheme as MissionScheme
from casadi_gnc.problem_files.schema import Matrix, MissionModel, Part, Positive, SchemeModel, Vector, law_tables
from casadi_gnc.tables import matrices
from casadi_gnc.tables.orbital_environment import Environment
from casadi_gnc.vehicles import Craft, Where
from casadi_gnc.vehicles.drag_free_pair.plant import DragFreePair


class Spacecraft(Part):
    """The satellite as it is, and the largest measurements of each axis that can be true."""

    model: Literal["drag_free_pair"]
    mass_kg: Positive
    inertia_kg_m2: Matrix = Field(description="about the centre of mass, satellite frame")
    rate_limit_rad_per_s: Positive = 10.0
    position_limit_m: Positive = 10.0
    velocity_limit_m_per_s: Positive = 10.0

    _spd = field_validator("inertia_kg_m2")(matrices.check_inertia)


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
    inertia_kg_m2: Matrix

    _spd = field_validator("inertia_kg_m2")(matrices.check_inertia)


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


_Laws = law_tables("drag_free")
Limits = Annotated[list[Positive], Field(min_length=3, max_length=3)]


class Scheme(SchemeModel):
    """A scheme of this craft: every axis is clipped by itself."""

    force_limit_N: Limits
    torque_limit_N_m: Limits
    law: _Laws  # type: ignore[valid-type]


class MissionFile(MissionModel):
    """A mission of satellite and test mass."""

    spacecraft: Spacecraft
    orbit: Orbit
    believed: Believed
    environment: Environment = Environment()
    initial: Initial
    scheme: Annotated[list[Scheme], Field(min_length=1)]


def build(model: MissionFile, where: Where) -> Craft:
    """Return the craft that a file describes."""
    craft, believed, initial = model.spacecraft, model.believed, model.initial
    orbit = CircularOrbit(
        model.orbit.body_radius_m + model.orbit.altitude_m, model.orbit.gravitational_parameter_m3_per_s2
    )
    plant = DragFreePair(
        craft.mass_kg,
        RigidBody(ca.DM(craft.inertia_kg_m2)),
        orbit,
        model.environment.disturbance(),
        craft.rate_limit_rad_per_s,
        craft.position_limit_m,
        craft.velocity_limit_m_per_s,
    )
    keys = {
        "mrp": "mrp",
        "rate": "rate_rad_per_s",
        "position": "position_m",
        "velocity": "velocity_m_per_s",
    }
    return Craft(
        plant=plant,
        start=[number for name in plant.state.names for number in getattr(initial, keys[name])],
        start_keys=keys,
        believed=Satellite(believed.mass_kg, ca.DM(believed.inertia_kg_m2), orbit),
        actuation=lambda scheme: _actuation(scheme, plant),
        panels=(
            Panel("tracked", "position", "relative position"),
            Panel("tracked", "mrp", "relative attitude MRPs"),
            Panel("effort", "force", "force"),
            Panel("effort", "torque", "torque"),
        ),
        target={name: [0.0] * 3 for name in plant.state.names},
        checks=_checks,
    )


def _checks(mission: Mission, scheme: MissionScheme) -> Iterator[Check]:
    """Yield whether the law's own handling of saturation lets it keep its funnels."""
    from casadi_gnc.checking import manoeuvre

    law = cast(DragFree, scheme.law)
    for signal, handling in (("mrp", law.torque_saturation), ("position", law.force_saturation)):
        if law.keeps(signal) and handling == "auxiliary":
            yield from manoeuvre.auxiliary(mission, scheme, signal)


def _actuation(scheme: Scheme, plant: DragFreePair) -> Actuation:
    limits = [*scheme.force_limit_N, *scheme.torque_limit_N_m]
    return Actuation(
        effectiveness=ca.DM.eye(6),
        lower=[-limit for limit in limits],
        upper=limits,
        rate=float("inf"),
        limit_below=[-limit for limit in limits],
        limit_above=limits,
        allocator=Direct(),
        effort=plant.inputs,
    )
