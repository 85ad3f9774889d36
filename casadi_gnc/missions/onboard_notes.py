"""What the blocks of a printed controller compute, and where the formula stands: for those who read the C."""

from __future__ import annotations

import inspect
import sys
from pathlib import Path
from typing import Any

from casadi_gnc.laws import Law
from casadi_gnc.missions.loop import Loop
from casadi_gnc.signals import Layout

#: Result of a tape -> its blocks: how many elements, what they are.
Blocks = dict[str, tuple[tuple[int, str], ...]]


def notes(loop: Loop) -> dict[str, Blocks]:
    """Return the blocks of each tape of a controller (`casadi_gnc.missions.onboard`), by the names of its signals."""
    law, actuation, plant = loop.scheme.law, loop.actuation, loop.plant
    memory, efforts = loop.scheme.flown.memory, actuation.named("wanted")
    good = "the measurement, or the last good one where it is not finite or out of range"
    found: dict[str, Blocks] = {
        "start": {"m": _each(memory, "at the first measurement", told_of(law, "start"))},
        "before": {
            "accepted": _each(plant.measurement, good),
            "wanted": _each(efforts, "what the law asks for", told_of(law, "command")),
            "limited": _each(actuation.named("limited"), "the same inside the limits of the effort"),
            "lower": _each(plant.inputs, "its lower bound in this sample"),
            "upper": _each(plant.inputs, "its upper bound in this sample"),
            "flags": _one("status: bits known before the allocation", told_of(law, "status")),
        },
        "allocate": {
            "allocated": _each(plant.inputs, "for the limited effort", told_of(actuation.allocator, "expression"))
        },
        "judge": {"verdict": _one("status: bits known once the actuators are")},
        "after": {"memory": _each(memory, "one sample later", told_of(law, "rate"))},
    }
    if actuation.modulation is not None:
        pulses = told_of(actuation.modulation, "__call__")
        found["modulate"] = {
            "pulses": _each(plant.inputs, "as pulses", pulses),
            "carry": _each(actuation.modulation.memory, "carried over", pulses),
        }
    return found


def _one(*what: str) -> tuple[tuple[int, str], ...]:
    return ((1, "; ".join(part for part in what if part)),)


def _each(layout: Layout, *what: str) -> tuple[tuple[int, str], ...]:
    told = "; ".join(part for part in what if part)
    return tuple((signal.size, f"{signal.name}: {told}") for signal in layout.signals)


def told_of(thing: Any, method: str) -> str:
    """Return where a method of an object is written, and the first line of its docstring.

    Examples
    --------
    >>> from casadi_gnc.laws.bdot import BDot
    >>> told_of(BDot, "rate")
    'BDot.rate in casadi_gnc/laws/bdot.py: (B - x)/tau'
    """
    kind = thing if isinstance(thing, type) else type(thing)
    owner = next((one for one in kind.__mro__ if method in vars(one)), None)
    if owner in (None, Law):  # nothing of its own
        return ""
    module = owner.__module__
    if module.startswith("casadi_gnc."):
        file = f"{module.replace('.', '/')}.py"
    else:  # the name alone: where a file of one's own lies is nobody else's concern
        file = Path(getattr(sys.modules.get(module), "__file__", None) or module).name
    first = (inspect.getdoc(getattr(owner, method)) or "").partition("\n")[0].removeprefix("Return ").rstrip(".")
    return f"{owner.__name__}.{method} in {file}" + (f": {first}" if first else "")
