"""Numbers of a mission that become columns: symbols of its tapes in the place of constants.

A parameter is one number of the craft or of a law's gains, by the path at which a problem file has it:
`truth.inertia_factor`, `initial.rate_rad_per_s.2`, `spacecraft.thrusters.positions_m.3.1`,
`scheme.observer_pinv.law.rate_gain`. A mission whose parameters are symbols has one text, and one compiled
library, for all their values; what follows from them alone is computed once a flight by the tape `configure`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from casadi_gnc import guests
from casadi_gnc.errors import AllocationError, FlightError, GncError, LawError
from casadi_gnc.mathematics.exact import array
from casadi_gnc.missions.actuation import SET_UP, Actuation
from casadi_gnc.missions.parts import Parts
from casadi_gnc.missions.paths import changed, number_at, numbers_of
from casadi_gnc.missions.scheme import Scheme
from casadi_gnc.missions.tapes import Tapes, tapes_of
from casadi_gnc.tables.part import MisfitError, Part

if TYPE_CHECKING:
    from casadi_gnc.missions.mission import Mission

#: Why a number stays a number, where Python decides by it.
_DECIDED = "a size, a limit or a choice that is made before the flight depends on it"


@dataclass(frozen=True, eq=False)
class Parameters:
    """Name the numbers that are columns.

    Parameters
    ----------
    keys : of each number, its whole path.
    symbols : (P,), in the place of the numbers.
    nominal : (P,), the numbers.
    """

    keys: tuple[str, ...]
    symbols: ca.SX
    nominal: np.ndarray

    @property
    def size(self) -> int:
        """P."""
        return len(self.keys)


@dataclass(frozen=True, eq=False)
class Varied:
    """Hold a mission of one scheme, the same with symbols in the place of some numbers, and these."""

    nominal: Mission
    mission: Mission
    parameters: Parameters

    def __repr__(self) -> str:
        return f"Varied({self.nominal.name}, {self.scheme.name}: {', '.join(self.parameters.keys) or 'nothing'})"

    @cached_property
    def tapes(self) -> Tapes:
        """The functions of which its flights are made, `configure` among them."""
        return tapes_of(self.mission, self.scheme, self.parameters)

    @property
    def scheme(self) -> Scheme:
        """The scheme, with symbols."""
        return self.mission.schemes[0]

    @cached_property
    def _believable(self) -> ca.Function:
        """The function from the parameters to true inertias, (9 k,), first perfect measurement, and its limits."""
        plant, p = self.mission.truth, self.parameters.symbols
        inertias = [ca.vec(ca.SX(array(inertia))) for inertia in plant.inertias().values()]
        seen = plant.measure(0.0, ca.vertcat(*self.mission.start), self.mission.quiet())
        told = [ca.vertcat(*inertias, ca.SX(0, 1)), ca.SX(seen), ca.SX(array(plant.measurement.limits()))]
        return ca.Function("believable", [p], list(map(ca.densify, told)))

    def refusals(self, values: np.ndarray) -> list[str]:
        """Return for each row of values why no such craft can fly, "" where it can.

        Looked at are the ranges and rules of the file's keys and of the gains, the true inertias (positive definite)
        and the first measurement (one that the sensors can tell).

        Parameters
        ----------
        values : (cases, P).
        """
        told = [self._refusal(row) for row in values]
        if not len(values):
            return told
        inertias, seen, limits = (np.array(each).T.reshape(len(values), -1) for each in self._believable(values.T))
        layout = self.mission.truth.measurement
        bodies = inertias.reshape(len(values), -1, 3, 3)
        sound = np.zeros(len(values), dtype=bool)
        finite = np.flatnonzero(np.isfinite(bodies).all(axis=(1, 2, 3)))
        sound[finite] = (np.linalg.eigvalsh(bodies[finite]) > 0).all(axis=(1, 2))
        credible = np.abs(seen) <= limits
        for i in np.flatnonzero(~(sound & credible.all(axis=1))):
            if told[i]:
                continue
            if not sound[i]:
                told[i] = "the true inertia is not positive definite"
            else:
                row = int(np.flatnonzero(~credible[i])[0])
                name = next(s.name for s in layout.signals if layout.place(s.name).stop > row)
                told[i] = f"{name} starts at {seen[i][row]:g}, beyond the largest credible, {limits[i][row]:g}"
        return told

    def _refusal(self, values: np.ndarray) -> str:
        try:
            changed(self.nominal, dict(zip(self.parameters.keys, map(float, values), strict=True)))
        except GncError as error:
            return str(error)
        return ""

    def at(self, values: Sequence[float] | np.ndarray) -> Mission:
        """Return the mission with these values of the parameters as numbers, checked as a file's would be.

        Raises
        ------
        GncError
            For values that no such craft or law can have.
        """
        given = dict(zip(self.parameters.keys, map(float, values), strict=True))
        return _with(self.nominal, given)


def vary(mission: Mission, keys: Sequence[str], scheme: str | None = None) -> Varied:
    """Return a mission of one scheme in which some numbers are symbols.

    Parameters
    ----------
    mission : whose numbers are the nominal ones.
    keys : paths; one that leads to several numbers (`initial.mrp`, `...*`) stands for all of them, in order.
    scheme : its name; the first one by default.

    Raises
    ------
    FlightError
        For a key that leads nowhere, or to what cannot be a column: the sentence says why.
    """
    chosen = mission.scheme(scheme)
    alone = mission if len(mission.schemes) == 1 else replace(mission, schemes=(chosen,))
    every = [key for one in keys for key in numbers_of(alone, one)]
    twice = next((key for i, key in enumerate(every) if key in every[:i]), None)
    if twice:
        raise FlightError(f"{twice!r} is given by two keys; each number can follow one law only")
    try:
        return _varied(alone, every)
    except GncError:
        for key in every:  # which one it is
            try:
                _varied(alone, [key])
            except GncError as error:
                raise FlightError(f"{key!r} cannot be a column: {error}") from error
        raise


def _varied(mission: Mission, keys: Sequence[str]) -> Varied:
    """Return a mission with symbols at whole paths, once its tapes could be built and printed."""
    symbols = [ca.SX.sym(key.replace(".", "_")) for key in keys]
    column = ca.vertcat(*symbols) if symbols else ca.SX(0, 1)
    nominal = np.array([number_at(mission, key) for key in keys])
    try:
        varied = _with(mission, dict(zip(keys, symbols, strict=True)))
        made = Varied(mission, varied, Parameters(tuple(keys), column, nominal))
        for tape in made.tapes.functions.values():
            _refuse_nan(tape)
    except LawError as error:
        raise _said(error) from error
    except (RuntimeError, TypeError, ValueError, NotImplementedError) as error:  # what CasADi and Python say of that
        told = str(error).splitlines()[-1].split(": ", 1)[-1]
        raise FlightError(f"{_DECIDED}: {told}") from error
    if _shape(made.mission, made.scheme) != _shape(mission, made.nominal.schemes[0]):
        raise FlightError("where it is not zero the flight has other signals or steps; write a nominal value above 0")
    return made


def _refuse_nan(tape: ca.Function) -> None:
    """Raise ValueError for a constant without a C form, not finite: a symbol that Python took for a number."""
    for k in range(tape.n_instructions()):
        if tape.instruction_id(k) == ca.OP_CONST and not math.isfinite(tape.instruction_constant(k)):
            raise ValueError("Python took a symbol for a number")


def _shape(mission: Mission, scheme: Scheme) -> list[tuple[Any, Any]]:
    """Return who shares the effort out, and name and size of all that a flight carries, draws and records."""
    plant, law, actuation = mission.truth, scheme.flown, scheme.actuation
    layouts = (plant.state, plant.noise, plant.inputs, plant.measurement, law.memory, law.outputs)
    signals = [(signal.name, signal.size) for layout in layouts for signal in layout.signals]
    return [(type(actuation.allocator), type(actuation.inverse)), *signals]


def _with(mission: Mission, values: dict[str, Any]) -> Mission:
    """Return a mission with other numbers, or symbols, at whole paths."""
    craft, laws, every_keys = changed(mission, values)
    parts = Parts(craft)
    schemes = []
    for each in mission.schemes:
        law, actuation, navigation = laws[each.name], each.actuation, each.navigation
        keys = every_keys[each.name]
        if keys is not None and (craft is not mission.craft or keys is not each.keys):  # made by the craft: again
            actuation = _actuation(keys, parts)
            law = law if law.belief_kind() is None else replace(law, body=parts.belief)
            navigation = parts.navigation
        schemes.append(replace(each, law=law, actuation=actuation, navigation=navigation, keys=keys))
    return replace(mission, craft=craft, schemes=schemes, parts=parts)


def _actuation(keys: Part, parts: Parts) -> Actuation:
    """Return how a scheme with these keys makes efforts: as its craft believes."""
    try:
        return parts.actuation(keys)
    except LawError as error:
        raise _said(error) from error
    except AllocationError as error:
        raise FlightError(SET_UP) from error
    except (GncError, MisfitError) as error:
        raise FlightError(f"the actuators as the flight software knows them follow from it ({error})") from error


def _said(error: LawError) -> GncError:
    """Return what to tell of a failure: that of code which could do with the number is Python deciding by it."""
    cause = error.__cause__
    return error if cause is None or isinstance(cause, GncError) else FlightError(_DECIDED + guests.own_lines(cause))
