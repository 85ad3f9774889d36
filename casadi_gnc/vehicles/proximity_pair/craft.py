"""A chaser that approaches a tumbling target and holds a point fixed to it, in six degrees of freedom.

Tables of the file: [spacecraft], the chaser; [target]; [orbit]; [believed]; [sensors]; [environment];
[initial]. Source: Sun and Zheng (2018), doi:10.1109/TCST.2017.2669145.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import ClassVar, cast

import casadi as ca
import numpy as np
from pydantic import Field, model_validator

from casadi_gnc.checks import Check
from casadi_gnc.mathematics.exact import array
from casadi_gnc.mechanics.proximity_motion import ProximityMotion
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
from casadi_gnc.tables.part import MisfitError, NonNegative, Part, Positive, Vector, table

from .plant import EFFORT, RELATIVE, ProximityPair, RelativeSensor
from .tables import Believed, Initial, Orbit, Sensors, Target

#: Largest eccentricity of an orbit that a file may call circular: 0.5 m/s at 7.5 km/s make 1.4e-4.
CIRCULAR = 1e-3
_KEYS = {
    "position_error": "position_error_m",
    "attitude_error": "attitude_error",
    "velocity_error": "velocity_error_m_per_s",
    "rate_error": "rate_error_rad_per_s",
    "position": "position_m",
    "velocity": "velocity_m_per_s",
    "rate": "rate_rad_per_s",
}


class ProximityPairCraft(Craft):
    """A chaser beside a tumbling target: as it is, the point that it holds, the sphere that it must not enter."""

    scheme_keys: ClassVar[type[Part]] = ForceAndTorqueLimits
    example: ClassVar[str | None] = "sun2018/circular_orbit"

    mass_kg: Positive
    inertia_kg_m2: matrices.Inertia = Field(description="about the centre of mass, chaser frame")
    hold_point_m: Vector = Field(description="p_t, from the target's centre of mass, target frame")
    keep_out_radius_m: NonNegative = Field(default=0.0, description="about the target's centre of mass; 0: none")
    target: Target = table()
    orbit: Orbit = table(Orbit())
    believed: Believed = table(Believed())
    sensors: Sensors = table(Sensors())
    environment: OrbitalPush = table(OrbitalPush())
    initial: Initial = table()

    @model_validator(mode="after")
    def _point_is_outside(self) -> ProximityPairCraft:
        distance = float(np.linalg.norm(self.hold_point_m))
        if distance <= self.keep_out_radius_m:
            raise MisfitError(
                f"hold_point_m is {distance:g} m from the target's centre, inside the keep-out sphere of "
                f"{self.keep_out_radius_m:g} m; move the point out or make keep_out_radius_m smaller",
                "hold_point_m",
            )
        return self

    def plant(self) -> ProximityPair:
        """Return the truth."""
        sensors = self.sensors
        return ProximityPair(
            self._motion(1.0, 1.0, None),
            array(self.target.inertia_kg_m2),
            self.environment.disturbance(),
            RelativeSensor(
                position_error=sensors.position_deviation_m,
                attitude_error=sensors.attitude_deviation,
                velocity_error=sensors.velocity_deviation_m_per_s,
                rate_error=sensors.rate_deviation_rad_per_s,
            ),
            self.keep_out_radius_m,
        )

    def _motion(self, mass_factor: float, inertia_factor: float, orbit_radius: float | None) -> ProximityMotion:
        """Return the relative motion with a share of the true mass and inertia."""
        inertia, earth = array(self.inertia_kg_m2), self.orbit.gravitational_parameter_m3_per_s2
        body = RigidBody(inertia_factor * inertia)
        return ProximityMotion(body, mass_factor * self.mass_kg, self.hold_point_m, earth, orbit_radius)

    def start(self) -> dict[str, list[float]]:
        """Return the relative state, and the chaser's position, velocity and rate, at t = 0."""
        return {signal: getattr(self.initial, key) for signal, key in _KEYS.items()}

    def belief(self) -> ProximityMotion:
        """Return the relative motion that the flight software believes in."""
        told = self.believed
        return self._motion(told.mass_factor, told.inertia_factor, told.target_orbit_radius_m)

    def actuation(self, keys: Part | None = None) -> Actuation:
        """Return the actuation of a scheme: every channel is clipped by itself."""
        return Actuation.direct(EFFORT, cast(ForceAndTorqueLimits, keys).column())

    def regulated(self, mission: Mission) -> dict[str, list[float]]:
        """Return the relative state at zero."""
        return {name: [0.0] * 3 for name in RELATIVE.names}

    def panels(self, mission: Mission) -> tuple[Panel, ...]:
        """Return errors, distance, efforts."""
        return (
            Panel("tracked", "position_error", "position error"),
            Panel("tracked", "attitude_error", "attitude error"),
            Panel(
                "lines",
                "target_distance",
                "distance of centres",
                level=self.keep_out_radius_m or None,
                level_label="keep-out sphere",
            ),
            Panel("effort", "force", "force"),
            Panel("effort", "torque", "torque"),
        )

    def scene(self, mission: Mission) -> Scene:
        """Return the chaser about the target, seen in the target's frame."""
        return Scene(
            attitude="attitude_error",
            reference="target frame",
            position="position_error",
            position_frame="body",
            offset=self.hold_point_m,
            other="target",
            keep_out=self.keep_out_radius_m,
            arrows=(Arrow("achieved_force", "force"), Arrow("rate_error", "rate from the target")),
        )

    def checks(self, mission: Mission, scheme: Scheme) -> Iterator[Check]:
        """Yield what can be said of chaser and target only."""
        from .checks import checks

        return checks(self, mission, scheme)

    def rehearses(self, mission: Mission, scheme: Scheme) -> bool:
        """Return whether there is a sphere to keep out of."""
        return self.keep_out_radius_m > 0

    def orbit_shape(self, start: Sequence[float]) -> tuple[float, float]:
        """Return eccentricity and perigee radius [m] of the target's orbit from a start of the plant's state."""
        mu = self.orbit.gravitational_parameter_m3_per_s2
        target = self.plant().target(ca.DM(start))
        r, v = (np.array(part).ravel() for part in (target.position, target.velocity))
        momentum = np.cross(r, v)
        eccentricity = float(np.linalg.norm(np.cross(v, momentum) / mu - r / np.linalg.norm(r)))
        return eccentricity, float(momentum @ momentum / mu / (1 + eccentricity))

    def _begun(self) -> list[float]:
        start = self.start()
        return [number for name in self.plant().state.names for number in start[name]]

    def flaws(self) -> Iterator[MisfitError]:
        """Yield whether an orbit that must be circular is not."""
        eccentricity, perigee = self.orbit_shape(self._begun())
        if self.orbit.circular and eccentricity > CIRCULAR:
            yield MisfitError(
                f"the target's orbit has {_told(eccentricity, perigee)}; circular asks for an eccentricity below "
                f"{CIRCULAR:g}. Mend position_m and velocity_m_per_s, or leave circular out",
                "orbit",
                "circular",
            )

    def notes(self) -> tuple[str, ...]:
        """Return what is wrong with the target's orbit."""
        eccentricity, perigee = self.orbit_shape(self._begun())
        shape, radius = _told(eccentricity, perigee), self.orbit.body_radius_m
        if perigee < radius:
            return (f"The target's orbit hits the body it is about ({radius / 1e3:.6g} km): {shape}.",)
        if eccentricity >= 1:
            return (f"The target is on no orbit but on a hyperbola: {shape}.",)
        return ()

    def key_of(self, signal: str) -> tuple[str, ...]:
        """Return the key of [initial]."""
        return ("initial", _KEYS[signal])


def _told(eccentricity: float, perigee: float) -> str:
    return f"eccentricity {eccentricity:.4g} and perigee radius {perigee / 1e3:.6g} km"
