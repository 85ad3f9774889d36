"""Look at the classes that are not ours when a mission is made, so that their authors are told at once and by name.

Every method of a guest's plant and law is called with symbols, its answer is looked at, and printed as C. Ours were
looked at by the tests.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import casadi as ca

from casadi_gnc.embedded.printer import print_function
from casadi_gnc.errors import LawError, PrinterError
from casadi_gnc.missions.asking import ask, column, flags, shown
from casadi_gnc.missions.loop import Loop, Symbols

if TYPE_CHECKING:
    from casadi_gnc.missions.mission import Mission


def probe(mission: Mission) -> None:
    """Raise `LawError` for the first method of a foreign plant or law whose answer cannot fly.

    Symbols in the place of gains are for analysis; a law that has some is not printed.
    """
    if is_foreign(mission.truth):
        _probe_plant(Loop(mission, mission.scheme()))
    for scheme in mission.schemes:
        if is_foreign(scheme.law):
            try:
                _probe_law(Loop(mission, scheme))
            except LawError as error:
                error.scheme = scheme.name
                raise


def is_foreign(thing: Any) -> bool:
    """Return whether an object's class is not of this package."""
    return not type(thing).__module__.startswith("casadi_gnc.")


def _probe_plant(loop: Loop) -> None:
    s, plant = loop.symbols(), loop.plant
    answers: dict[str, Callable[[], Any]] = {
        "measure": lambda: loop.sensed(s.t, s.x, s.noise),
        "rate": lambda: loop.moved(s.t, s.x, s.actuators, s.noise),
        "settle": lambda: loop.settled(s.x),
        "show": lambda: _stacked(shown(plant, ask(plant, "show", s.t, s.x, s.actuators), plant.outputs)),
        "status": lambda: _stacked(flags(plant, "status", ask(plant, "status", s.t, s.x, s.actuators))),
    }
    for method, answer in answers.items():
        _print(plant, method, answer(), s)


def _probe_law(loop: Loop) -> None:
    s, law = loop.symbols(), loop.law
    seen = loop.seen(s.y)
    answers: dict[str, Callable[[], Any]] = {
        "start": lambda: loop.started(s.t, s.y),
        "jump": lambda: column(law, "jump", ask(law, "jump", s.t, seen, s.m), law.memory),
        "command": lambda: loop.commanded(s.t, seen, s.m)[1],
        "rate": lambda: loop.flowing(s.t, seen, s.m, s.wanted, s.limited),
        "status": lambda: _stacked(flags(law, "status", ask(law, "status", s.t, seen, s.m))),
        "show": lambda: _stacked(shown(law, ask(law, "show", s.t, seen, s.m), law.outputs)),
    }
    for method, answer in answers.items():
        _print(law, method, answer(), s)


def _stacked(parts: Any) -> Any:
    return ca.vertcat(*(ca.vec(ca.SX(part)) for part in parts.values()))


def _print(owner: Any, method: str, answer: Any, s: Symbols) -> None:
    """Print an answer as C; what has no C form is told with the method's name."""
    known = [getattr(s, name) for name in vars(s)]
    expression = ca.densify(ca.SX(answer))
    if any(not ca.depends_on(ca.vertcat(*known), free) for free in ca.symvar(expression)):
        return
    try:
        print_function(ca.Function(method, known, [expression]))
    except PrinterError as error:
        raise LawError(f"{type(owner).__name__}.{error}") from error
