"""Numbers of a mission that become columns: symbols of its tapes in the place of constants.

A parameter is one number of the craft or of a law's gains, by the path at which a problem file has it:
`truth.inertia_factor`, `initial.rate_rad_per_s.2`, `spacecraft.thrusters.positions_m.3.1`,
`scheme.observer_pinv.law.rate_gain`. A mission whose parameters are symbols has one text, and one compiled
library, for all their values; what follows from them alone is computed once a flight by the tape `configure`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np
from pydantic import ValidationError

from casadi_gnc.embedded.printer import print_function
from casadi_gnc.errors import FlightError, GncError, ProblemError
from casadi_gnc.laws import Law, gains_of
from casadi_gnc.mathematics.exact import array, is_number
from casadi_gnc.missions.actuation import Actuation
from casadi_gnc.missions.parts import Parts
from casadi_gnc.missions.scheme import Scheme
from casadi_gnc.missions.tapes import Tapes, tapes_of
from casadi_gnc.tables.complaints import near_key, sentences
from casadi_gnc.tables.part import MisfitError, Part, own_tables

if TYPE_CHECKING:
    from casadi_gnc.missions.craft import Craft
    from casadi_gnc.missions.mission import Mission

Path = tuple[str | int, ...]

#: Tables of a file whose numbers shape the flight itself, and what to say of each.
_SHAPES = {
    "timing": "sizes and steps follow from it; fly a mission for each value",
    "noise": "every case draws noise of its own, from the campaign's seed and its number",
    "funnel": "walls are compiled; fly a mission for each",
    "metric": "it asks a question and changes no flight",
}


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
        """The function from the parameters to the true inertias, (9 k,), and the first perfect measurement."""
        plant, p = self.mission.truth, self.parameters.symbols
        inertias = [ca.vec(ca.SX(array(inertia))) for inertia in plant.inertias().values()]
        seen = plant.measure(0.0, ca.vertcat(*self.mission.start), self.mission.quiet())
        return ca.Function("believable", [p], [ca.densify(ca.vertcat(*inertias, ca.SX(0, 1))), ca.densify(ca.SX(seen))])

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
        inertias, seen = (np.array(each).T.reshape(len(values), -1) for each in self._believable(values.T))
        layout = self.mission.truth.measurement
        limits = np.concatenate([np.full(s.size, s.limit) for s in layout.signals] or [np.zeros(0)])
        bodies = inertias.reshape(len(values), -1, 3, 3)
        for i in range(len(values)):
            if told[i]:
                continue
            if not np.isfinite(bodies[i]).all() or not (np.linalg.eigvalsh(bodies[i]) > 0).all():
                told[i] = "the true inertia is not positive definite"
            elif not (np.abs(seen[i]) <= limits).all():
                row = int(np.flatnonzero(~(np.abs(seen[i]) <= limits))[0])
                name = next(s.name for s in layout.signals if layout.place(s.name).stop > row)
                told[i] = f"{name} starts at {seen[i][row]:g}, beyond the largest credible, {limits[row]:g}"
        return told

    def _refusal(self, values: np.ndarray) -> str:
        try:
            _changed(self.nominal, dict(zip(self.parameters.keys, map(float, values), strict=True)))
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
    nominal = np.array([_at(mission, key) for key in keys])
    try:
        varied = _with(mission, dict(zip(keys, symbols, strict=True)))
        made = Varied(mission, varied, Parameters(tuple(keys), column, nominal))
        for tape in made.tapes.functions.values():
            print_function(tape)  # a symbol that Python took for a number is NaN, which has no C form
    except (RuntimeError, TypeError, ValueError, NotImplementedError) as error:  # what CasADi and Python say of that
        told = str(error).splitlines()[-1].split(": ", 1)[-1]
        raise FlightError(
            f"a size, a limit or a choice that is made before the flight depends on it: {told}"
        ) from error
    return made


def numbers_of(mission: Mission, key: str) -> list[str]:
    """Return the whole path of every number that a key of a mission of one scheme stands for, in order."""
    root, *rest = key.split(".")
    if root in _SHAPES:
        raise FlightError(f"{key!r} cannot be a column: {_SHAPES[root]}")
    found = list(_leaves(_root(mission, root, key), rest, (root,), key))
    if not found:
        raise FlightError(f"{key!r} leads to no number")
    return found


def _root(mission: Mission, root: str, key: str) -> Any:
    craft = mission.craft
    own = own_tables(type(craft))
    if root == "scheme":
        return {each.name: {"law": each.law} for each in mission.schemes}
    if root == "spacecraft":
        return {name: getattr(craft, name) for name in type(craft).model_fields if name not in own}
    if root in own:
        return getattr(craft, root)
    raise FlightError(f"{key!r} leads nowhere: the mission has no {root!r}{near_key(root, [*own, *_ROOTS])}")


_ROOTS = ("spacecraft", "scheme")


def _leaves(at: Any, rest: list[str], done: tuple[str, ...], key: str) -> Iterator[str]:
    """Yield the paths of the numbers below a place; a `*` stands for every item there."""
    if rest:
        parts = _parts(at)
        if rest[0] == "*":
            if not parts:
                raise FlightError(f"{key!r} leads nowhere: {'.'.join(done)} has no parts")
            for name, part in parts.items():
                yield from _leaves(part, rest[1:], (*done, name), key)
            return
        if rest[0] not in parts:
            known = near_key(rest[0], list(parts)) or (f"; there is {', '.join(parts)}" if parts else "")
            raise FlightError(f"{key!r} leads nowhere: {'.'.join(done)} has no {rest[0]!r}{known}")
        yield from _leaves(parts[rest[0]], rest[1:], (*done, rest[0]), key)
    elif isinstance(at, (int, float)) and not isinstance(at, bool):
        yield ".".join(done)
    elif at is None:
        raise FlightError(f"{key!r} has no value to start from: {'.'.join(done)} is left out; write its nominal value")
    elif isinstance(at, (list, tuple, ca.DM)):
        for name, part in _parts(at).items():
            yield from _leaves(part, [], (*done, name), key)
    else:
        raise FlightError(f"{key!r} leads to {'.'.join(done)}, which is no number and no list of numbers")


def _parts(at: Any) -> dict[str, Any]:
    """Return what a path may go on to: fields, gains, and items by their number from 1."""
    if isinstance(at, Part):
        return {name: getattr(at, name) for name in type(at).model_fields}
    if isinstance(at, dict):
        return at
    if isinstance(at, (list, tuple)):
        return {str(i): item for i, item in enumerate(at, 1)}
    if isinstance(at, ca.DM) and at.shape[1] == 1:
        return {str(i): float(item) for i, item in enumerate(at.elements(), 1)}
    return {name: getattr(at, name) for name in gains_of(type(at))} if isinstance(at, Law) else {}


def _at(mission: Mission, key: str) -> float:
    """Return the number at a whole path."""
    root, *rest = key.split(".")
    place = _root(mission, root, key)
    for name in rest:
        place = _parts(place)[name]
    return float(place)


def _with(mission: Mission, values: dict[str, Any]) -> Mission:
    """Return a mission with other numbers, or symbols, at whole paths."""
    craft, laws = _changed(mission, values)
    parts = Parts(craft)
    schemes = []
    for each in mission.schemes:
        law, actuation = laws[each.name], each.actuation
        if craft is not mission.craft and each.keys is not None:  # made by the craft, so made again
            actuation = _actuation(each.keys, parts)
            law = law if law.belief_kind() is None else replace(law, body=parts.belief)
        schemes.append(replace(each, law=law, actuation=actuation))
    return replace(mission, craft=craft, schemes=schemes, parts=parts)


def _changed(mission: Mission, values: dict[str, Any]) -> tuple[Craft, dict[str, Law]]:
    """Return craft and laws with other numbers, which are validated, or with symbols, which nothing validates."""
    of_craft = {_of_craft(key): value for key, value in values.items() if not key.startswith("scheme.")}
    craft = _put(mission.craft, of_craft) if of_craft else mission.craft
    laws = {}
    for each in mission.schemes:
        start = f"scheme.{each.name}."
        own = {tuple(key.split(".")[3:]): value for key, value in values.items() if key.startswith(start)}
        gains = {
            name: _put(getattr(each.law, name), {path[1:]: value for path, value in own.items() if path[0] == name})
            for name in dict.fromkeys(path[0] for path in own)
        }
        laws[each.name] = replace(each.law, **gains) if gains else each.law
    return craft, laws


def _of_craft(key: str) -> Path:
    path = tuple(int(part) - 1 if part.isdecimal() else part for part in key.split("."))
    return path[1:] if path[0] == "spacecraft" else path


def _actuation(keys: Part, parts: Parts) -> Actuation:
    """Return how a scheme with these keys makes efforts: as its craft believes."""
    try:
        return parts.actuation(keys)
    except (GncError, MisfitError) as error:
        raise FlightError(f"the actuators as the flight software knows them follow from it ({error})") from error


def _put(at: Any, values: dict[Path, Any]) -> Any:
    """Return a part, a list or a column with what the paths lead to replaced."""
    if () in values:
        return values[()]
    below: dict[str | int, dict[Path, Any]] = {}
    for path, value in values.items():
        below.setdefault(path[0], {})[path[1:]] = value
    if isinstance(at, Part):
        new = {str(name): _put(getattr(at, str(name)), inner) for name, inner in below.items()}
        if all(is_number(value) for value in values.values()):
            given = {**{name: getattr(at, name) for name in type(at).model_fields}, **new}
            try:
                return type(at)(**given)
            except ValidationError as error:
                told = (f"{'.'.join(map(str, path))} {text}" for path, text in sentences(error, type(at), given))
                raise ProblemError("; ".join(told)) from error
        return at.model_copy(update=new)
    if isinstance(at, ca.DM):
        items = [float(item) for item in at.elements()]
        return array(_put(items, {(int(path[0]) - 1, *path[1:]): value for path, value in values.items()}))
    return [_put(item, below[i]) if i in below else item for i, item in enumerate(at)]
