"""Crafts: one file each, with the tables of a mission file that describe it and how they are built.

A craft's module has

* `MissionFile`: a `MissionModel` with the tables of this craft, `spacecraft.model` naming it;
* `build(model, where)`: returns a `Craft`, or raises `ProblemError` with `where(key)` as its place.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

from casadi_gnc.checks import Check
from casadi_gnc.missions.mission import Actuation, Mission, Panel, Scheme
from casadi_gnc.missions.plant import Plant

#: Path of a key in the file -> "file, line n, key", for messages.
Where = Callable[[tuple[str | int, ...]], str]


@dataclass(frozen=True, eq=False)
class Craft:
    """Hold what a mission needs of a craft.

    Parameters
    ----------
    plant : the truth.
    start : its state at t = 0.
    start_keys : key of the file, in [initial], that gives each measured signal.
    believed : what the flight software believes; given to laws that have a `body`.
    actuation : makes the actuation of a scheme from the scheme's table.
    panels : what a flight's picture shows.
    target : states that the laws regulate -> values that they bring them to.
    checks : what only this craft can say of a mission before it flies.
    truths : effectivenesses, (R, N), that errors and faults may make true, by what they are.
    notes : sentences that a reader of every flight must see.
    """

    plant: Plant
    start: list[float]
    start_keys: dict[str, str]
    believed: Any
    actuation: Callable[[Any], Actuation]
    panels: tuple[Panel, ...] = ()
    target: Mapping[str, Sequence[float]] = field(default_factory=dict)
    checks: Callable[[Mission, Scheme], Iterable[Check]] = lambda mission, scheme: ()
    truths: Callable[[Mission, Scheme], Mapping[str, Any]] = lambda mission, scheme: {}
    notes: tuple[str, ...] = ()


#: Modules by the name that `spacecraft.model` gives.
_HOMES = {
    "combined_spacecraft": "combined_spacecraft",
    "docking_pair": "docking_pair",
    "wheel_spacecraft": "wheel_spacecraft",
    "proximity_pair": "proximity_pair",
    "drag_free_pair": "drag_free_pair",
}


def names() -> list[str]:
    """Return the names of all crafts."""
    return list(_HOMES)


def module(name: str) -> Any:
    """Return the module of a craft; raise `KeyError` if there is none of that name."""
    return import_module(f"{__name__}.{_HOMES[name]}.craft")
