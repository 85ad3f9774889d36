"""What is outside a satellite: its orbit, gravity across its body, the magnetic field, the sun, air and sunlight."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import casadi as ca

from casadi_gnc.mechanics import attitude, earth, plates, quaternions
from casadi_gnc.mechanics.circular_orbit import EARTH_MU
from casadi_gnc.mechanics.earth import Epoch
from casadi_gnc.mechanics.plates import Atmosphere, Plate
from casadi_gnc.signals import Layout, Signal


@dataclass(frozen=True)
class SunDirection:
    """Give the unit vector to the sun, (3,), inertial, at a time [s] after an epoch."""

    epoch: Epoch

    def __call__(self, t: Any) -> Any:
        """Return the direction."""
        direction = self.epoch.sun(t)[0]
        return direction / ca.sqrt(ca.sumsqr(direction))


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Say what a satellite feels where it is.

    Parameters
    ----------
    gravity : acceleration (3,), [m/s^2], at a position (3,), [m], inertial; None where nothing needs an orbit.
    gradient : whether gravity turns the body.
    mu : of the central body, [m^3/s^2].
    field : magnetic field (3,), [T], inertial, at a time [s] and a position; None where nothing needs it.
    sun : unit vector to the sun, (3,), inertial, at a time [s]; None where nothing needs it.
    plates : what air and sunlight push.
    air : its density and wind; None for none.
    """

    gravity: Callable[[Any], Any] | None = None
    gradient: bool = True
    mu: float = EARTH_MU
    field: Callable[[Any, Any], Any] | None = None
    sun: Callable[[Any], Any] | None = None
    plates: tuple[Plate, ...] = ()
    air: Atmosphere | None = None

    @property
    def state(self) -> Layout:
        """Position and velocity, where there is an orbit."""
        if self.gravity is None:
            return Layout()
        return Layout((Signal("position", 3, "m"), Signal("velocity", 3, "m/s")))

    @property
    def has_field(self) -> bool:
        """Whether there is a magnetic field."""
        return self.field is not None

    def felt(self, t: Any, now: Any) -> SimpleNamespace:
        """Return the state and, in body axes, the magnetic field and the sun."""
        turn = attitude.dcm(now.mrp)
        more: dict[str, Any] = {"quaternion": quaternions.from_mrp(now.mrp)}
        if self.field is not None:
            more["magnetic_field"] = ca.mtimes(turn, self.field(t, now.position))
        if self.sun is not None:
            sun = self.sun(t)
            more["sun"], more["sunlight"] = ca.mtimes(turn, sun), earth.sunlight(now.position, sun)
        return SimpleNamespace(**vars(now), **more)

    def torque(self, now: Any, inertia: Any) -> Any:
        """Return 3 mu/|r|^3 e x J e, e = C r/|r|, (3,), [N m], body axes; nothing without an orbit."""
        if self.gravity is None or not self.gradient:
            return ca.DM.zeros(3)
        square = ca.sumsqr(now.position)
        distance = ca.sqrt(square)
        up = ca.mtimes(attitude.dcm(now.mrp), now.position / distance)
        return 3 * self.mu / (square * distance) * ca.cross(up, ca.mtimes(inertia, up))

    def pushed(self, now: Any, around: Any, centre: Any) -> tuple[Any, Any]:
        """Return force [N] and torque [N m] of air and sunlight, (3,) each, body axes; `around` is what is felt."""
        force, torque = ca.SX.zeros(3), ca.SX.zeros(3)
        if self.air is not None:
            density, flight = self.air.at(now.position, now.velocity)
            blown = plates.air(self.plates, centre, density, ca.mtimes(attitude.dcm(now.mrp), flight))
            force, torque = force + blown[0], torque + blown[1]
        if self.plates and self.sun is not None:
            lit = plates.light(self.plates, centre, around.sun, around.sunlight)
            force, torque = force + lit[0], torque + lit[1]
        return force, torque

    def moved(self, now: Any, push: Any) -> dict[str, Any]:
        """Return r' and v' under an acceleration from thrusters, (3,), [m/s^2], body axes."""
        if self.gravity is None:
            return {}
        pushed = ca.mtimes(attitude.dcm(now.mrp).T, push)
        return {"position": now.velocity, "velocity": self.gravity(now.position) + pushed}
