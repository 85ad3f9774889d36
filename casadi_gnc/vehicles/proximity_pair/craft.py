"""A chaser that approaches a tumbling target and holds a point fixed to it, in six degrees of freedom.

Tables of the file: [spacecraft], the chaser; [target]; [orbit]; [believed]; [sensors]; [environment];
[initial]. Source: Sun and Zheng (2018), doi:10.1109/TCST.2017.2669145.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Literal

import casadi as ca
import numpy as np
from pydantic import Field, field_validator, model_validator

from casadi_gnc.allocation.in_flight import Direct
from casadi_gnc.checks import Check
from casadi_gnc.errors import ProblemError
from casadi_gnc.laws.proximity_conditions import coupling_condition
from casadi_gnc.mechanics.proximity_motion import ProximityMotion
from casadi_gnc.mechanics.rigid_body import RigidBody
from casadi_gnc.missions.mission import Actuation, Panel
from casadi_gnc.problem_files.schema import (
    Matrix,
    MissionModel,
    NonNegative,
    Part,
    Positive,
    SchemeModel,
    Vector,
    law_tables,
)
from casadi_gnc.tables import matrices
from casadi_gnc.tables.orbital_environment import Environment
from casadi_gnc.vehicles import Craft, Where
from casadi_gnc.vehicles.proximity_pair.plant import EFFORT, RELATIVE, ProximityPair, RelativeSensor

#: Largest eccentricity of an orbit that a file may call circular: 0.5 m/s at 7.5 km/s make 1.4e-4.
CIRCULAR = 1e-3


class Spacecraft(Part):
    """The chaser as it is, the point of the target that it holds, and the sphere that it must not enter."""

    model: Literal["proximity_pair"]
    mass_kg: Positive
    inertia_kg_m2: Matrix = Field(description="about the centre of mass, chaser frame")
    hold_point_m: Vector = Field(description="p_t, from the target's centre of mass, target frame")
    keep_out_radius_m: NonNegative = Field(default=0.0, description="about the target's centre of mass; 0: none")

    _spd = field_validator("inertia_kg_m2")(matrices.check_inertia)

    @model_validator(mode="after")
    def _point_is_outside(self) -> Spacecraft:
        distance = float(np.linalg.norm(self.hold_point_m))
        if distance <= self.keep_out_radius_m:
            raise ValueError(
                f"hold_point_m is {distance:g} m from the target's centre, inside the keep-out sphere of "
                f"{self.keep_out_radius_m:g} m; move the point out or make keep_out_radius_m smaller"
            )
        return self


class Target(Part):
    """The target, which tumbles freely."""

    inertia_kg_m2: Matrix = Field(description="J_t, about the centre of mass, target frame")

    _spd = field_validator("inertia_kg_m2")(matrices.check_inertia)


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


_Laws = law_tables("proximity_tracking")
Limits = Annotated[list[Positive], Field(min_length=3, max_length=3)]


class Scheme(SchemeModel):
    """A scheme of this craft: every channel is clipped by itself."""

    force_limit_N: Limits
    torque_limit_N_m: Limits
    law: _Laws  # type: ignore[valid-type]


class MissionFile(MissionModel):
    """A mission of chaser and target."""

    spacecraft: Spacecraft
    target: Target
    orbit: Orbit = Orbit()
    believed: Believed = Believed()
    sensors: Sensors = Sensors()
    environment: Environment = Environment()
    initial: Initial
    scheme: Annotated[list[Scheme], Field(min_length=1)]


def build(model: MissionFile, where: Where) -> Craft:
    """Return the craft that a file describes."""
    craft, believed, sensors = model.spacecraft, model.believed, model.sensors
    earth = model.orbit.gravitational_parameter_m3_per_s2
    inertia = ca.DM(craft.inertia_kg_m2)
    motion = ProximityMotion(RigidBody(inertia), craft.mass_kg, craft.hold_point_m, earth)
    plant = ProximityPair(
        motion,
        ca.DM(model.target.inertia_kg_m2),
        model.environment.disturbance(),
        RelativeSensor(
            position_error=sensors.position_deviation_m,
            attitude_error=sensors.attitude_deviation,
            velocity_error=sensors.velocity_deviation_m_per_s,
            rate_error=sensors.rate_deviation_rad_per_s,
        ),
        craft.keep_out_radius_m,
    )
    thought = ProximityMotion(
        RigidBody(believed.inertia_factor * inertia),
        believed.mass_factor * craft.mass_kg,
        craft.hold_point_m,
        earth,
        believed.target_orbit_radius_m,
    )
    keys = {
        "position_error": "position_error_m",
        "attitude_error": "attitude_error",
        "velocity_error": "velocity_error_m_per_s",
        "rate_error": "rate_error_rad_per_s",
        "position": "position_m",
        "velocity": "velocity_m_per_s",
        "rate": "rate_rad_per_s",
    }
    start = [number for name in plant.state.names for number in getattr(model.initial, keys[name])]
    return Craft(
        plant=plant,
        start=start,
        start_keys=keys,
        believed=thought,
        actuation=_actuation,
        panels=(
            Panel("tracked", "position_error", "position error"),
            Panel("tracked", "attitude_error", "attitude error"),
            Panel(
                "lines",
                "target_distance",
                "distance of centres",
                level=craft.keep_out_radius_m or None,
                level_label="keep-out sphere",
            ),
            Panel("effort", "force", "force"),
            Panel("effort", "torque", "torque"),
        ),
        target={name: [0.0] * 3 for name in RELATIVE.names},
        checks=lambda mission, scheme: _checks(mission, scheme, model.orbit),
        notes=_orbit_notes(model.orbit, plant, start, where),
    )


def _actuation(scheme: Scheme) -> Actuation:
    limits = [*scheme.force_limit_N, *scheme.torque_limit_N_m]
    return Actuation(
        effectiveness=ca.DM.eye(6),
        lower=[-limit for limit in limits],
        upper=limits,
        rate=float("inf"),
        limit_below=[-limit for limit in limits],
        limit_above=limits,
        allocator=Direct(),
        effort=EFFORT,
    )


def _shape(plant: ProximityPair, start: list[float], mu: float) -> tuple[float, float]:
    """Return eccentricity and perigee radius [m] of the target's orbit."""
    target = plant.target(ca.DM(start))
    r, v = (np.array(part).ravel() for part in (target.position, target.velocity))
    momentum = np.cross(r, v)
    eccentricity = float(np.linalg.norm(np.cross(v, momentum) / mu - r / np.linalg.norm(r)))
    return eccentricity, float(momentum @ momentum / mu / (1 + eccentricity))


def _orbit_notes(orbit: Orbit, plant: ProximityPair, start: list[float], where: Where) -> tuple[str, ...]:
    """Return what is wrong with the target's orbit; raise `ProblemError` where it must be circular and is not."""
    eccentricity, perigee = _shape(plant, start, orbit.gravitational_parameter_m3_per_s2)
    shape = f"eccentricity {eccentricity:.4g} and perigee radius {perigee / 1e3:.6g} km"
    if orbit.circular and eccentricity > CIRCULAR:
        raise ProblemError(
            f"the target's orbit has {shape}; circular asks for an eccentricity below {CIRCULAR:g}. Mend position_m "
            "and velocity_m_per_s, or leave circular out",
            where(("orbit", "circular")),
        )
    if perigee < orbit.body_radius_m:
        return (f"The target's orbit hits the body it is about ({orbit.body_radius_m / 1e3:.6g} km): {shape}.",)
    if eccentricity >= 1:
        return (f"The target is on no orbit but on a hyperbola: {shape}.",)
    return ()


def _checks(mission: Any, scheme: Any, orbit: Orbit) -> Iterator[Check]:
    """Yield the orbit, the theorem's condition that involves the target, and how near the chaser comes, simulated."""
    from casadi_gnc.checking import numbers
    from casadi_gnc.missions.flying import fly

    plant: ProximityPair = mission.truth
    yield from numbers.orbit(
        *_shape(plant, mission.start, orbit.gravitational_parameter_m3_per_s2), orbit.body_radius_m
    )
    rate = plant.target(ca.DM(mission.start)).rate
    yield coupling_condition(scheme.law, plant.motion, plant.target_inertia, rate)
    if plant.keep_out_radius:
        flight = fly(mission, scheme.name)
        yield Check(
            "proximity.keep_out",
            float("nan") if flight.diverged else float(flight["target_distance"].min()),
            plant.keep_out_radius,
            "m",
            "fail",
            "On its way to the point the chaser enters the keep-out sphere: the law knows nothing of it.",
            "Start from the side of the point, or lead the chaser there by way points.",
            "the path that the law and the limits of the mission give, simulated",
            at_least=True,
        )
