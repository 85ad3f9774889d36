"""What satellites are turned by: wheels, thrusters, magnetorquers; each group one part.

====================  ==========================================================================================
part                  equations beside those of `casadi_gnc.mechanics.multibody`
====================  ==========================================================================================
Wheels                J_s (Omega' + g.w') = u - c_v Omega - f_c tanh(Omega/Omega_c)
Thrusters             force F e at r: torque r x F e about the origin
Magnetorquers         torque m x B
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
from casadi_gnc.mechanics.multibody import Action, Component
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
