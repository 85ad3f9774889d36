"""What swings in satellites: bending modes of appendages, masses of liquid; each group one part.

====================  ==========================================================================================
part                  equations beside those of `casadi_gnc.mechanics.multibody`
====================  ==========================================================================================
FlexibleModes         eta'' + 2 zeta w_k eta' + w_k^2 eta = -(delta.w' + translation), eta in kg^0.5 m
SloshMasses           a mass on a spring along an axis: m (xi'' + ...) = -k xi - d xi', no linearisation
====================  ==========================================================================================

Columns of numbers are (N,) or (3, N), in the order of the file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.mathematics.exact import array
from casadi_gnc.mechanics.multibody import Action, Component, about_origin
from casadi_gnc.signals import Layout, Signal


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
