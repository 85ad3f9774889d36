"""A rigid body that carries parts, each with what moves in it: the sum of the parts moves as one.

==========  ================================================================================================
symbol      meaning
==========  ================================================================================================
B, C        origin of the body's frame, where positions are told from; the common centre of mass
w           rate of the body, (3,), [rad/s], body axes
s, q        speeds and coordinates inside the parts, (n,) and (k,); each q' is one of s (a wheel has no q)
m, S, J     whole mass [kg], first moment [kg m] and inertia [kg m^2] about B; S and J may depend on q
P, A        momentum per speed, (3, n), and angular momentum about B per speed, (3, n)
M           inertia of the speeds by themselves, (n, n)
F, T, Q     force [N], torque about B [N m], generalised force on each speed
==========  ================================================================================================

Of the momentum of the whole nothing is left in the frame of the centre of mass, which takes the body's own speed
out of the kinetic energy. With c = S/m,

    J_c = J - m (c'c I - c c'),    A_c = A - c x P,    M_c = M - P'P/m,
    H = J_c w + A_c s,    p = A_c' w + M_c s,    E = (w'H + s'p)/2,

and Lagrange's equations for w, which is no derivative of a coordinate, and s are

    H' + w x H = T - c x F,        p' = dE/dq + Q - P' F/m.

Angular momentum about C and, where Q is a spring's, energy are conserved by this form, whatever the parts.
H' and p' are linear in w' and s'; what is left of them is found by differentiation, so a part needs no
derivatives. Source: Boltzmann-Hamel equations, e.g. Meirovitch, Methods of Analytical Dynamics (1970), section 4.12.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import casadi as ca

from casadi_gnc.mathematics.exact import array, is_zero
from casadi_gnc.mathematics.linear import solve_symmetric
from casadi_gnc.signals import Layout


def about_origin(mass: Any, position: Any) -> Any:
    """Return m (r'r I - r r'), (3, 3): the inertia of a mass at r about the origin."""
    r = array(position)
    return mass * (ca.dot(r, r) * ca.DM.eye(3) - ca.mtimes(r, r.T))


@dataclass(frozen=True, eq=False)
class Action:
    """Hold what a part does at a time.

    Parameters
    ----------
    force : on the body from outside, (3,), [N], body axes.
    torque : with it, about the origin B, (3,), [N m].
    internal : generalised force on each speed of the part, (n,).
    """

    force: Any = field(default_factory=lambda: ca.DM.zeros(3))
    torque: Any = field(default_factory=lambda: ca.DM.zeros(3))
    internal: Any = field(default_factory=lambda: ca.DM.zeros(0, 1))


class Component:
    """Base of what a body carries; a subclass is a frozen dataclass of its numbers.

    What it does not say it does not have. `own` stands for the part's state by name.
    """

    #: Its state: coordinates, speeds, and what else it remembers.
    state: Any = Layout()
    #: What it is told.
    inputs: Any = Layout()
    #: Signals of its state that can be measured.
    measured: Any = Layout()

    @property
    def moving(self) -> Mapping[str, str | None]:
        """Its speeds, in order: name of the signal of `state` -> that of the coordinate whose derivative it is."""
        return {}

    def start(self) -> dict[str, Any]:
        """Return the state at t = 0 by signal."""
        return {}

    def mass(self) -> Any:
        """Return its mass, [kg], beside that of the body."""
        return 0.0

    def moment(self, own: Any) -> Any:
        """Return its first moment m r, (3,), [kg m]; of a part without mass it does not count."""
        return ca.DM.zeros(3)

    def inertia(self, own: Any) -> Any:
        """Return its inertia about the origin, (3, 3), [kg m^2], beside that of the body."""
        return ca.DM.zeros(3, 3)

    def couplings(self, own: Any) -> tuple[Any, Any, Any]:
        """Return its columns of P (3, n) and A (3, n), and its M (n, n)."""
        return ca.DM.zeros(3, 0), ca.DM.zeros(3, 0), ca.DM.zeros(0, 0)

    def potential(self, own: Any) -> Any:
        """Return the energy that it stores in springs, [J]."""
        return 0.0

    def act(self, t: Any, own: Any, told: Any, around: Any) -> Action:
        """Return what it does when it is told `told`; `around` has `rate` and, where there is one, `magnetic_field`."""
        return Action()

    def drift(self, t: Any, own: Any, told: Any, around: Any) -> dict[str, Any]:
        """Return the derivatives of states that are neither coordinates nor speeds."""
        return {}

    def timed(self, period: float, step: float) -> Component:
        """Return the part as told every `period` [s] and integrated by `step`; both 0 in continuous flight."""
        return self

    def averaged(self) -> Component:
        """Return the part as linear analysis takes it, with the same state: what it makes of a command at once."""
        return self

    def settle(self, own: Any) -> dict[str, Any]:
        """Return by signal what changes of its state between two samples."""
        return {}

    def flags(self, own: Any, told: Any) -> dict[Any, Any]:
        """Return flags by status bit: what truly happened."""
        return {}


@dataclass(frozen=True, eq=False)
class Assembly:
    """Sum a body and the parts that it carries.

    Parameters
    ----------
    body_mass, body_centre, body_inertia : of the body without the parts' own masses: [kg]; (3,), [m] from B;
        (3, 3), [kg m^2] about its own centre of mass, with wheels locked.
    components : the parts.
    """

    body_mass: Any
    body_centre: Any
    body_inertia: Any
    components: tuple[Component, ...] = ()

    @property
    def state(self) -> Layout:
        """The states of all parts."""
        return _sum(part.state for part in self.components)

    @property
    def inputs(self) -> Layout:
        """What all parts are told."""
        return _sum(part.inputs for part in self.components)

    @property
    def speeds(self) -> dict[str, str | None]:
        """All speeds, and their coordinates."""
        return {speed: place for part in self.components for speed, place in part.moving.items()}

    @property
    def mass(self) -> Any:
        """The whole mass, [kg]."""
        return self.body_mass + sum(part.mass() for part in self.components)

    @property
    def _is_all_of_body(self) -> bool:
        """Whether no part has mass of its own: then the centre of mass stays, without any rounding."""
        return all(is_zero(part.mass()) for part in self.components)

    def centre(self, own: Any) -> Any:
        """Return c, (3,), [m], at a state of the parts."""
        if self._is_all_of_body:
            return array(self.body_centre)
        moment = self.body_mass * array(self.body_centre)
        for part in self.components:
            moment = moment + part.moment(own)
        return moment / self.mass

    def inertia(self, own: Any) -> Any:
        """Return J_c, (3, 3), [kg m^2]."""
        total = array(self.body_inertia)
        for part in self.components:
            total = total + part.inertia(own)
        if self._is_all_of_body:
            return total
        return total + about_origin(self.body_mass, self.body_centre) - about_origin(self.mass, self.centre(own))

    def _inner(self, own: Any) -> tuple[Any, Any, Any]:
        """Return A_c, M_c and P."""
        columns = [part.couplings(own) for part in self.components if part.moving]
        linear = ca.horzcat(ca.SX(3, 0), *(each[0] for each in columns))
        angular = ca.horzcat(ca.SX(3, 0), *(each[1] for each in columns))
        apart = ca.diagcat(ca.SX(0, 0), *(each[2] for each in columns))
        moved = ca.mtimes(ca.skew(self.centre(own)), linear)
        return angular - moved, apart - ca.mtimes(linear.T, linear) / self.mass, linear

    def _column(self, own: Any) -> Any:
        """Return s."""
        return ca.vertcat(ca.SX(0, 1), *(getattr(own, name) for name in self.speeds))

    def momentum(self, rate: Any, own: Any) -> Any:
        """Return H, (3,), [N m s], body axes: the angular momentum about C."""
        turned, _, _ = self._inner(own)
        return ca.mtimes(self.inertia(own), rate) + ca.mtimes(turned, self._column(own))

    def energy(self, rate: Any, own: Any) -> Any:
        """Return the kinetic energy in the frame of C, and what springs store, [J]."""
        turned, apart, _ = self._inner(own)
        s = self._column(own)
        kinetic = ca.dot(rate, ca.mtimes(self.inertia(own), rate) + 2 * ca.mtimes(turned, s))
        kinetic = kinetic + ca.dot(s, ca.mtimes(apart, s))
        return kinetic / 2 + sum(part.potential(own) for part in self.components)

    def moved(self, t: Any, rate: Any, own: Any, told: Any, torque: Any, around: Any) -> tuple[Any, Any, Any]:
        """Return w', (3,), the derivative of the parts' state, and the force from outside, (3,), body axes.

        Parameters
        ----------
        own, told : the parts' state and what they are told, by name.
        torque : on the body from outside about C, (3,), [N m], besides what the parts do.
        """
        actions = [part.act(t, own, told, around) for part in self.components]
        force: Any = sum((each.force for each in actions), ca.SX.zeros(3))
        about = sum((each.torque for each in actions), ca.SX.zeros(3)) - ca.cross(self.centre(own), force)
        turned, apart, linear = self._inner(own)
        left = torque + about - ca.cross(rate, self.momentum(rate, own))
        inner = ca.vertcat(ca.SX(0, 1), *(each.internal for each in actions)) - ca.mtimes(linear.T, force) / self.mass
        turning, stirring = self._left_over(rate, own)
        matrix = ca.vertcat(ca.horzcat(apart, turned.T), ca.horzcat(turned, self.inertia(own)))
        found = solve_symmetric(matrix, ca.vertcat(inner - stirring, left - turning))
        n = apart.shape[0]
        return found[n:], self._derivative(t, own, told, around, found[:n]), force

    def _derivative(self, t: Any, own: Any, told: Any, around: Any, accelerations: Any) -> Any:
        """Return the derivative of the parts' state, in its order."""
        rates: dict[str, Any] = {}
        first = 0
        for part in self.components:
            for speed, place in part.moving.items():
                size = part.state.signal(speed).size
                rates[speed] = accelerations[first : first + size]
                first += size
                if place is not None:
                    rates[place] = getattr(own, speed)
            rates.update(part.drift(t, own, told, around))
        return self.state.pack(**rates)

    def _left_over(self, rate: Any, own: Any) -> tuple[Any, Any]:
        """Return what H' and p' - dE/dq have besides w' and s', (3,) and (n,)."""
        places = {speed: place for speed, place in self.speeds.items() if place is not None}
        free = {name: ca.SX.sym(name, self.state.signal(name).size) for name in (*places.values(), *self.speeds)}
        w, at = ca.SX.sym("w", 3), SimpleNamespace(**{**vars(own), **free})
        turned, apart, _ = self._inner(at)
        s, q = self._column(at), ca.vertcat(ca.SX(0, 1), *(free[place] for place in places.values()))
        q_rate = ca.vertcat(ca.SX(0, 1), *(free[speed] for speed in places))
        whole = ca.mtimes(self.inertia(at), w) + ca.mtimes(turned, s)
        each = ca.mtimes(turned.T, w) + ca.mtimes(apart, s)
        energy = (ca.dot(w, whole) + ca.dot(s, each)) / 2
        slope = ca.vertcat(
            ca.SX(0, 1),
            *(
                ca.SX.zeros(free[speed].numel()) if place is None else ca.gradient(energy, free[place])
                for speed, place in self.speeds.items()
            ),
        )
        turning, stirring = ca.jtimes(whole, q, q_rate), ca.jtimes(each, q, q_rate) - slope
        known = [rate, *(getattr(own, name) for name in free)]
        found = ca.substitute([turning, stirring], [w, *free.values()], [ca.SX(one) for one in known])
        return found[0], found[1]


def _sum(layouts: Any) -> Layout:
    total = Layout()
    for layout in layouts:
        total = total + layout
    return total
