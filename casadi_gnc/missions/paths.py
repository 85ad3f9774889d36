"""The numbers of a mission by the paths at which a problem file has them: found, read, and put in the place of others.

A path is `truth.inertia_factor`, `initial.rate_rad_per_s.2`, `spacecraft.thrusters.positions_m.3.1` or
`scheme.observer_pinv.law.rate_gain`; items of lists have their number from 1, and a `*` stands for every item, of a
table for every key that has numbers. An entry of a symmetric matrix and its mirror image are one number, which has the
path of the upper triangle: `spacecraft.inertia_kg_m2.2.1` is `spacecraft.inertia_kg_m2.1.2`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import casadi as ca
from pydantic import ValidationError

from casadi_gnc.errors import FlightError, ProblemError
from casadi_gnc.laws import Law, gains_of
from casadi_gnc.mathematics.exact import array, is_number
from casadi_gnc.tables.complaints import near_key, sentences
from casadi_gnc.tables.matrices import symmetric_keys
from casadi_gnc.tables.part import Part, own_tables

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


def numbers_of(mission: Mission, key: str) -> list[str]:
    """Return the whole path of every number that a key of a mission of one scheme stands for, each once, in order."""
    return list(dict.fromkeys(entries_of(mission, key)))


def entries_of(mission: Mission, key: str) -> list[str]:
    """Return the same with the path of a number as often as it stands there: in a symmetric matrix twice."""
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
        return {each.name: {"law": each.law, **_limits(each.keys)} for each in mission.schemes}
    if root == "spacecraft":
        return {name: part for name, part in _fields(craft).items() if name not in own}
    if root in own:
        return _fields(craft)[root]
    raise FlightError(f"{key!r} leads nowhere: the mission has no {root!r}{near_key(root, [*own, *_ROOTS])}")


_ROOTS = ("spacecraft", "scheme")


def _limits(keys: Part | None) -> dict[str, Any]:
    """Return the limits among the keys of a scheme."""
    return {} if keys is None else {name: part for name, part in _parts(keys).items() if name != "allocation"}


def _leaves(at: Any, rest: list[str], done: tuple[str, ...], key: str) -> Iterator[str]:
    """Yield the paths of the numbers below a place; a `*` stands for every item there."""
    if isinstance(at, _Mirrored):
        yield from map(_upper, _leaves(list(at), rest, done, key))
    elif rest:
        parts = _parts(at)
        if rest[0] == "*":
            if not parts:
                raise FlightError(f"{key!r} leads nowhere: {'.'.join(done)} has no parts")
            for name, part in parts.items():
                if len(rest) > 1 or not isinstance(at, Part) or _holds_numbers(part):
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


class _Mirrored(list):
    """Rows of a symmetric matrix."""


def _upper(path: str) -> str:
    """Return the path of an entry of a symmetric matrix, or of its mirror image, in the upper triangle."""
    *above, row, column = path.split(".")
    return ".".join([*above, *sorted((row, column), key=int)])


def _fields(part: Part) -> dict[str, Any]:
    """Return the keys of a table, symmetric matrices as such."""
    mirrored = symmetric_keys(type(part))
    own = {name: getattr(part, name) for name in type(part).model_fields}
    return {
        name: _Mirrored(each) if name in mirrored and isinstance(each, list) else each for name, each in own.items()
    }


def _holds_numbers(at: Any) -> bool:
    """Return whether a key of a table has a number or numbers: words, choices and what is left out have none."""
    if isinstance(at, (list, tuple)):
        return any(map(_holds_numbers, at))
    return isinstance(at, (int, float, ca.DM)) and not isinstance(at, bool)


def _parts(at: Any) -> dict[str, Any]:
    """Return what a path may go on to: fields, gains, and items by their number from 1."""
    if isinstance(at, Part):
        return _fields(at)
    if isinstance(at, dict):
        return at
    if isinstance(at, (list, tuple)):
        return {str(i): item for i, item in enumerate(at, 1)}
    if isinstance(at, ca.DM) and at.shape[1] == 1:
        return {str(i): float(item) for i, item in enumerate(at.elements(), 1)}
    return {name: getattr(at, name) for name in gains_of(type(at))} if isinstance(at, Law) else {}


def number_at(mission: Mission, key: str) -> float:
    """Return the number at a whole path."""
    root, *rest = key.split(".")
    place = _root(mission, root, key)
    for name in rest:
        place = _parts(place)[name]
    return float(place)


def changed(mission: Mission, values: dict[str, Any]) -> tuple[Craft, dict[str, Law], dict[str, Part | None]]:
    """Return craft, laws and keys of schemes with other numbers, which are validated, or symbols, which are not."""
    of_craft = {_of_craft(key): value for key, value in values.items() if not key.startswith("scheme.")}
    craft = _put(mission.craft, of_craft) if of_craft else mission.craft
    laws, keys = {}, {}
    for each in mission.schemes:
        start = f"scheme.{each.name}."
        told = {
            tuple(key.removeprefix(start).split(".")): value for key, value in values.items() if key.startswith(start)
        }
        own = {path[1:]: value for path, value in told.items() if path[0] == "law"}
        gains = {
            name: _put(getattr(each.law, name), {path[1:]: value for path, value in own.items() if path[0] == name})
            for name in dict.fromkeys(path[0] for path in own)
        }
        laws[each.name] = replace(each.law, **gains) if gains else each.law
        limits = {(path[0], *(int(part) - 1 for part in path[1:])): told[path] for path in told if path[0] != "law"}
        keys[each.name] = _put(each.keys, limits) if limits else each.keys
    return craft, laws, keys


def _of_craft(key: str) -> Path:
    path = tuple(int(part) - 1 if part.isdecimal() else part for part in key.split("."))
    return path[1:] if path[0] == "spacecraft" else path


def _put(at: Any, values: dict[Path, Any]) -> Any:
    """Return a part, a list or a column with what the paths lead to replaced."""
    if () in values:
        return values[()]
    below: dict[str | int, dict[Path, Any]] = {}
    for path, value in values.items():
        below.setdefault(path[0], {})[path[1:]] = value
    if isinstance(at, Part):
        for name in symmetric_keys(type(at)) & below.keys():
            mirrors = {(*path[:-2], path[-1], path[-2]): each for path, each in below[name].items() if len(path) == 2}
            below[name] = {**mirrors, **below[name]}
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
