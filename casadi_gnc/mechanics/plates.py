"""Air and sunlight on the plates that a satellite is made of: force and torque.

==========  ==================================================================================
symbol      meaning
==========  ==================================================================================
A, n, c     area [m^2], outward normal and centre [m] of a plate, body axes; the centre from
            the centre of mass
v, s        unit vectors of the flight through the air, and to the sun, body axes
rho         density of the air, [kg/m^3]
V           speed through the air, [m/s]
P           pressure of sunlight, 4.5e-6 N/m^2 at one astronomical unit
eta, delta  shares of light that are mirrored and scattered evenly
==========  ==================================================================================

Air, whose molecules stick and leave slowly, for plates that face the flight (n.v > 0):

    F = -rho V^2/2 C_D A (n.v) v

Light, for plates that see the sun (n.s > 0):

    F = -P A (n.s) ((1 - eta) s + 2 (eta (n.s) + delta/3) n)

Plates do not shade each other. The air turns with the Earth. Its density falls exponentially from a known one, which a
few per cent of height change hold to some ten per cent; the sun's activity moves it by ten times and more.

Source: Markley and Crassidis (2014), section 3.3, doi:10.1007/978-1-4939-0802-8.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.mathematics.exact import array
from casadi_gnc.mechanics import earth

#: Pressure of sunlight on what swallows it, at one astronomical unit, [N/m^2]: 1361 W/m^2 over the speed of light.
PRESSURE = 1361.0 / 299792458.0


@dataclass(frozen=True)
class Plate:
    """Describe a plate, one side of which is outside.

    Parameters
    ----------
    area : A, [m^2].
    normal : n, (3,), unit vector, body axes.
    centre : c, (3,), [m], body axes, from the same origin as the centre of mass.
    drag : C_D, [-].
    mirrored, scattered : eta, delta, [-], together at most 1.
    """

    area: Any
    normal: Sequence[Any]
    centre: Sequence[Any]
    drag: Any = 2.2
    mirrored: Any = 0.0
    scattered: Any = 0.0


@dataclass(frozen=True)
class Atmosphere:
    """Model the density rho = density e^(-(height - altitude)/scale), and a wind that turns with the Earth.

    Parameters
    ----------
    density : at `altitude`, [kg/m^3].
    altitude : above the equatorial radius, [m].
    scale : height over which the density falls by e, [m].
    """

    density: Any
    altitude: Any
    scale: Any

    def at(self, position: Any, velocity: Any) -> tuple[Any, Any]:
        """Return rho, and the velocity through the air, (3,), [m/s], inertial axes."""
        height = ca.sqrt(ca.sumsqr(position)) - earth.MAJOR_AXIS
        wind = earth.RATE * ca.vertcat(-position[1], position[0], 0)
        return self.density * ca.exp((self.altitude - height) / self.scale), velocity - wind


def air(plates: Sequence[Plate], centre: Any, density: Any, velocity: Any) -> tuple[Any, Any]:
    """Return force [N] and torque [N m] of the air, (3,) each, body axes.

    Parameters
    ----------
    centre : of mass, (3,), [m].
    density : rho, [kg/m^3].
    velocity : through the air, (3,), [m/s], body axes.
    """
    # V^2 (n.v) v of unit vectors is (n.velocity) velocity.
    forces = [-density / 2 * plate.drag * plate.area * _facing(plate, velocity) * velocity for plate in plates]
    return _together(plates, centre, forces)


def light(plates: Sequence[Plate], centre: Any, sun: Any, share: Any = 1.0, distance: Any = None) -> tuple[Any, Any]:
    """Return force [N] and torque [N m] of sunlight, (3,) each, body axes.

    Parameters
    ----------
    centre : of mass, (3,), [m].
    sun : unit vector to the sun, (3,), body axes.
    share : of the sun that is seen, 0 to 1 (`casadi_gnc.mechanics.earth.sunlight`).
    distance : to the sun, [m]; one astronomical unit if left out.
    """
    pressure = PRESSURE * share
    if distance is not None:
        pressure = pressure * (earth.ASTRONOMICAL_UNIT / distance) ** 2
    forces = []
    for plate in plates:
        seen, normal = _facing(plate, sun), array(list(plate.normal))
        pushed = (1 - plate.mirrored) * sun + 2 * (plate.mirrored * seen + plate.scattered / 3) * normal
        forces.append(-pressure * plate.area * seen * pushed)
    return _together(plates, centre, forces)


def _facing(plate: Plate, direction: Any) -> Any:
    """Return n.direction where the plate faces it, else 0."""
    along = ca.dot(array(list(plate.normal)), direction)
    return ca.if_else(along > 0, along, 0.0)


def _together(plates: Sequence[Plate], centre: Any, forces: Sequence[Any]) -> tuple[Any, Any]:
    force, torque = ca.SX.zeros(3), ca.SX.zeros(3)
    for plate, each in zip(plates, forces, strict=True):
        force, torque = force + each, torque + ca.cross(array(list(plate.centre)) - centre, each)
    return force, torque
