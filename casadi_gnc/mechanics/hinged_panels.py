"""Rigid panels on hinges with springs: what bends of solar arrays, without linearisation.

==========  ====================================================================================
symbol      meaning
==========  ====================================================================================
a, h        unit vector along the hinge, and a point on it, (3,), [m], body axes from the origin
theta       angle of the panel about a from where the spring is at rest
R           turn by theta about a
m, J        mass [kg] and inertia about the panel's own centre of mass, (3, 3), [kg m^2], at theta = 0
rho         R times the way from h to that centre at theta = 0, (3,), [m]
==========  ====================================================================================

    centre r = h + rho,    inertia about it R J R',    per theta': momentum m a x rho, angular momentum about the
    origin R J a + m r x (a x rho), inertia a'J a + m |a x rho|^2,    force -k theta - c theta'

These are the equations of Allard, Schaub, Piggott, "General Hinged Rigid Body Dynamics Approximating First-Order
Spacecraft Solar Panel Flexing", Journal of Spacecraft and Rockets 55 (2018), 1291-1299, there for panels whose hinge is
a principal axis, here for any J.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.mathematics.exact import array
from casadi_gnc.mechanics.multibody import Action, Component, about_origin
from casadi_gnc.signals import Layout, Signal


@dataclass(frozen=True, eq=False)
class HingedPanels(Component):
    """N panels, each on a hinge of the body.

    Parameters
    ----------
    masses : m, (N,), [kg], beside the body's.
    inertias : J, N matrices (3, 3), [kg m^2], body axes at theta = 0.
    hinges : h, (3, N), [m].
    axes : a, (3, N), unit columns.
    arms : rho at theta = 0, (3, N), [m].
    stiffness, friction : k, c, (N,), [N m/rad] and [N m s/rad].
    angle, rate : theta, theta' at t = 0, (N,), [rad] and [rad/s].
    """

    masses: Any
    inertias: Sequence[Any]
    hinges: Any
    axes: Any
    arms: Any
    stiffness: Any
    friction: Any
    angle: Any
    rate: Any

    @property
    def count(self) -> int:
        """N."""
        return self.axes.shape[1]

    @property
    def state(self) -> Layout:
        """Angles and rates about the hinges."""
        return Layout((Signal("panel_angle", self.count, "rad"), Signal("panel_rate", self.count, "rad/s")))

    @property
    def moving(self) -> Mapping[str, str | None]:
        """The rates."""
        return {"panel_rate": "panel_angle"}

    def start(self) -> dict[str, Any]:
        """Return angles and rates."""
        return {"panel_angle": array(self.angle).elements(), "panel_rate": array(self.rate).elements()}

    def about_hinges(self) -> list[Any]:
        """Return the inertia of each about its hinge, [kg m^2]."""
        masses = array(self.masses)
        return [
            ca.dot(a, ca.mtimes(array(self.inertias[i]), a)) + masses[i] * ca.sumsqr(ca.cross(a, self.arms[:, i]))
            for i, a in enumerate(ca.horzsplit(self.axes))
        ]

    def _turned(self, own: Any) -> list[tuple[Any, Any, Any, Any]]:
        """Return mass, centre r, the way rho to it, and R, of each."""
        found, masses = [], array(self.masses)
        for i, a in enumerate(ca.horzsplit(self.axes)):
            along, angle = ca.mtimes(a, a.T), own.panel_angle[i]
            turn = along + ca.cos(angle) * (ca.DM.eye(3) - along) + ca.sin(angle) * ca.skew(a)
            rho = ca.mtimes(turn, self.arms[:, i])
            found.append((masses[i], self.hinges[:, i] + rho, rho, turn))
        return found

    def mass(self) -> Any:
        """Return their mass."""
        return sum(array(self.masses).elements())

    def moment(self, own: Any) -> Any:
        """Return the sum of m r."""
        return sum((mass * centre for mass, centre, _, _ in self._turned(own)), ca.DM.zeros(3))

    def inertia(self, own: Any) -> Any:
        """Return the sum of their inertias about the origin."""
        turned = enumerate(self._turned(own))
        each = (
            ca.mtimes([turn, array(self.inertias[i]), turn.T]) + about_origin(mass, centre)
            for i, (mass, centre, _, turn) in turned
        )
        return sum(each, ca.DM.zeros(3, 3))

    def couplings(self, own: Any) -> tuple[Any, Any, Any]:
        """Return momentum, angular momentum and inertia of the rates."""
        linear, angular = [], []
        for i, (mass, centre, rho, turn) in enumerate(self._turned(own)):
            a = self.axes[:, i]
            moved = mass * ca.cross(a, rho)
            linear.append(moved)
            angular.append(ca.mtimes([turn, array(self.inertias[i]), a]) + ca.cross(centre, moved))
        return ca.horzcat(*linear), ca.horzcat(*angular), ca.diag(ca.vertcat(*self.about_hinges()))

    def potential(self, own: Any) -> Any:
        """Return what the springs store."""
        return ca.dot(array(self.stiffness), own.panel_angle**2) / 2

    def act(self, t: Any, own: Any, told: Any, around: Any) -> Action:
        """Return what springs and dampers do."""
        return Action(internal=-array(self.stiffness) * own.panel_angle - array(self.friction) * own.panel_rate)
