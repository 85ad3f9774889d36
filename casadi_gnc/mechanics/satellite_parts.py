"""What satellites carry: wheels, thrusters, magnetorquers, bending modes, sloshing masses; each group one part.

====================  ==========================================================================================
part                  equations beside those of `casadi_gnc.mechanics.multibody`
====================  ==========================================================================================
Wheels                J_s (Omega' + g.w') = u - c_v Omega - f_c tanh(Omega/Omega_c)
Thrusters             force F e at r: torque r x F e about the origin
Magnetorquers         torque m x B
FlexibleModes         eta'' + 2 zeta w_k eta' + w_k^2 eta = -(delta.w' + translation), eta in kg^0.5 m
SloshMasses           a mass on a spring along an axis: m (xi'' + ...) = -k xi - d xi', no linearisation
====================  ==========================================================================================

Columns of numbers are (N,) or (3, N); where a part has one entry each, in the order of the file.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.mathematics.bounds import any_of
from casadi_gnc.mathematics.exact import array, is_number
from casadi_gnc.mechanics.multibody import Action, Component, about_origin
from casadi_gnc.signals import Layout, Signal
from casadi_gnc.status import StepStatus

#: Speed [rad/s] beyond which no wheel turns, whatever it is said to withstand: a million turns a minute.
CREDIBLE_SPEED = 1e5


def endless(speed: Any) -> bool:
    """Return whether a largest speed is none; a symbol is one."""
    return is_number(speed) and float(speed) == math.inf


@dataclass(frozen=True, eq=False)
class Wheels(Component):
    """N wheels; the command u of each is its motor's torque, which the body feels as -u along the axis.

    Parameters
    ----------
    axes : g, (3, N), unit columns.
    spin_inertia : J_s, (N,), [kg m^2]; the body's inertia includes the wheels locked.
    max_speed : (N,), [rad/s]; a motor at its limit drives no further. `inf` for none.
    viscous, coulomb : c_v [N m s/rad] and f_c [N m], (N,).
    coulomb_speed : Omega_c, (N,), [rad/s]: beyond some of it Coulomb friction is whole.
    speed : at t = 0, (N,), [rad/s].
    """

    axes: Any
    spin_inertia: Any
    max_speed: Any
    viscous: Any
    coulomb: Any
    coulomb_speed: Any
    speed: Any

    @property
    def count(self) -> int:
        """N."""
        return self.axes.shape[1]

    @property
    def state(self) -> Layout:
        """The speeds."""
        return Layout((Signal("wheel_speed", self.count, "rad/s", kind="wheel_speed"),))

    @property
    def inputs(self) -> Layout:
        """The motors' torques."""
        return Layout((Signal("wheel_torque", self.count, "N m"),))

    @property
    def measured(self) -> Layout:
        """The speeds, with the largest that is credible."""
        fastest = max(
            CREDIBLE_SPEED if not is_number(v) else min(1.1 * float(v), CREDIBLE_SPEED) for v in self._fastest()
        )
        return Layout((Signal("wheel_speed", self.count, "rad/s", limit=fastest, kind="wheel_speed"),))

    def _fastest(self) -> list[Any]:
        return array(self.max_speed).elements()

    @property
    def moving(self) -> Mapping[str, str | None]:
        """The speeds; angles of wheels do not matter."""
        return {"wheel_speed": None}

    def start(self) -> dict[str, Any]:
        """Return the speeds."""
        return {"wheel_speed": array(self.speed).elements()}

    def couplings(self, own: Any) -> tuple[Any, Any, Any]:
        """Return nothing, g J_s, and J_s."""
        spin = ca.diag(array(self.spin_inertia))
        return ca.DM.zeros(3, self.count), ca.mtimes(self.axes, spin), spin

    def driven(self, own: Any, told: Any) -> Any:
        """Return the motors' torques as they are made, (N,)."""
        made = []
        for i, fastest in enumerate(self._fastest()):
            u, speed = told.wheel_torque[i], own.wheel_speed[i]
            if endless(fastest):
                made.append(u)
            else:
                made.append(ca.if_else(ca.logic_and(ca.fabs(speed) >= fastest, u * speed > 0), 0.0, u))
        return ca.vertcat(*made)

    def friction(self, speed: Any) -> Any:
        """Return what slows the wheels, (N,), [N m]."""
        return array(self.viscous) * speed + array(self.coulomb) * ca.tanh(speed / array(self.coulomb_speed))

    def act(self, t: Any, own: Any, told: Any, around: Any) -> Action:
        """Return the torques on the wheels."""
        return Action(internal=self.driven(own, told) - self.friction(own.wheel_speed))

    def flags(self, own: Any, told: Any) -> dict[Any, Any]:
        """Return whether a wheel is at its limit."""
        if all(map(endless, self._fastest())):
            return {}
        return {StepStatus.WHEEL_SATURATED: any_of(ca.fabs(own.wheel_speed) >= array(self.max_speed))}


@dataclass(frozen=True, eq=False)
class Thrusters(Component):
    """N thrusters; the command of each is its force.

    Parameters
    ----------
    positions : (3, N), [m], from the origin.
    directions : of the force on the body, (3, N), unit columns.
    """

    positions: Any
    directions: Any

    @property
    def inputs(self) -> Layout:
        """The forces."""
        return Layout((Signal("force", self.directions.shape[1], "N"),))

    def arms(self, centre: Any) -> Any:
        """Return the torque about a centre [m] per force, (3, N), [m]."""
        columns = range(self.directions.shape[1])
        return ca.horzcat(*(ca.cross(self.positions[:, i] - centre, self.directions[:, i]) for i in columns))

    def act(self, t: Any, own: Any, told: Any, around: Any) -> Action:
        """Return force, and torque about the origin."""
        return Action(ca.mtimes(self.directions, told.force), ca.mtimes(self.arms(ca.DM.zeros(3)), told.force))


@dataclass(frozen=True, eq=False)
class Magnetorquers(Component):
    """N coils; the command of each is its dipole.

    Parameters
    ----------
    axes : (3, N), unit columns.
    """

    axes: Any

    @property
    def inputs(self) -> Layout:
        """The dipoles."""
        return Layout((Signal("dipole", self.axes.shape[1], "A m^2"),))

    def act(self, t: Any, own: Any, told: Any, around: Any) -> Action:
        """Return m x B."""
        return Action(torque=ca.cross(ca.mtimes(self.axes, told.dipole), around.magnetic_field))


@dataclass(frozen=True, eq=False)
class FlexibleModes(Component):
    """K modes of appendages, clamped to the body; coordinates are normalised by mass.

    Parameters
    ----------
    frequency : w_k, (K,), [rad/s], of the clamped mode.
    damping : zeta, (K,).
    rotation : delta, (3, K), [kg^0.5 m]: angular momentum about the origin per speed of the mode.
    translation : (3, K), [kg^0.5]: momentum per speed of the mode.
    deflection : at t = 0, (K,), [kg^0.5 m].
    """

    frequency: Any
    damping: Any
    rotation: Any
    translation: Any
    deflection: Any

    @property
    def count(self) -> int:
        """K."""
        return self.rotation.shape[1]

    @property
    def state(self) -> Layout:
        """Deflections and their speeds."""
        return Layout(
            (Signal("deflection", self.count, "kg^0.5 m"), Signal("deflection_rate", self.count, "kg^0.5 m/s"))
        )

    @property
    def moving(self) -> Mapping[str, str | None]:
        """The speeds."""
        return {"deflection_rate": "deflection"}

    def start(self) -> dict[str, Any]:
        """Return the deflections, at rest."""
        return {"deflection": array(self.deflection).elements(), "deflection_rate": [0.0] * self.count}

    def couplings(self, own: Any) -> tuple[Any, Any, Any]:
        """Return the couplings, and one."""
        return self.translation, self.rotation, ca.DM.eye(self.count)

    def potential(self, own: Any) -> Any:
        """Return the elastic energy."""
        return ca.sumsqr(array(self.frequency) * own.deflection) / 2

    def act(self, t: Any, own: Any, told: Any, around: Any) -> Action:
        """Return what stiffness and damping do."""
        stiff, frequency = array(self.frequency) ** 2, array(self.frequency)
        return Action(internal=-stiff * own.deflection - 2 * array(self.damping) * frequency * own.deflection_rate)


@dataclass(frozen=True, eq=False)
class SloshMasses(Component):
    """N masses, each on a spring along a line of the body: what moves of a liquid.

    Parameters
    ----------
    masses : (N,), [kg], beside the body's.
    positions : at rest, (3, N), [m], from the origin.
    axes : of the lines, (3, N), unit columns.
    stiffness, friction : (N,), [N/m] and [N s/m].
    offset : from rest at t = 0, (N,), [m].
    """

    masses: Any
    positions: Any
    axes: Any
    stiffness: Any
    friction: Any
    offset: Any

    @property
    def count(self) -> int:
        """N."""
        return self.axes.shape[1]

    @property
    def state(self) -> Layout:
        """Offsets and their speeds."""
        return Layout((Signal("slosh", self.count, "m"), Signal("slosh_rate", self.count, "m/s")))

    @property
    def moving(self) -> Mapping[str, str | None]:
        """The speeds."""
        return {"slosh_rate": "slosh"}

    def start(self) -> dict[str, Any]:
        """Return the offsets, at rest."""
        return {"slosh": array(self.offset).elements(), "slosh_rate": [0.0] * self.count}

    def _places(self, own: Any) -> list[tuple[Any, Any]]:
        """Return mass and place of each."""
        masses = array(self.masses)
        return [(masses[i], self.positions[:, i] + self.axes[:, i] * own.slosh[i]) for i in range(self.count)]

    def mass(self) -> Any:
        """Return their mass."""
        return sum(array(self.masses).elements())

    def moment(self, own: Any) -> Any:
        """Return the sum of m r."""
        return sum((mass * place for mass, place in self._places(own)), ca.DM.zeros(3))

    def inertia(self, own: Any) -> Any:
        """Return the sum of their inertias as points."""
        return sum((about_origin(mass, place) for mass, place in self._places(own)), ca.DM.zeros(3, 3))

    def couplings(self, own: Any) -> tuple[Any, Any, Any]:
        """Return m a, m r x a, m."""
        moved = [(mass, place, self.axes[:, i]) for i, (mass, place) in enumerate(self._places(own))]
        linear = ca.horzcat(*(mass * axis for mass, _, axis in moved))
        angular = ca.horzcat(*(mass * ca.cross(place, axis) for mass, place, axis in moved))
        return linear, angular, ca.diag(array(self.masses))

    def potential(self, own: Any) -> Any:
        """Return what the springs store."""
        return ca.dot(array(self.stiffness), own.slosh**2) / 2

    def act(self, t: Any, own: Any, told: Any, around: Any) -> Action:
        """Return what springs and dampers do."""
        return Action(internal=-array(self.stiffness) * own.slosh - array(self.friction) * own.slosh_rate)
