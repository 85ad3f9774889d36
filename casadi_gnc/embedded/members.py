"""How the columns of a controller become members of C structs: declarations, comments, access."""

from __future__ import annotations

import math

from casadi_gnc.embedded.controller import Controller, Tunable
from casadi_gnc.signals import Layout, Signal


def access(layout: Layout, owner: str) -> list[str]:
    """Return the C expression of each element of a column whose signals are members of `owner`.

    Examples
    --------
    >>> access(Layout((Signal("mrp", 2), Signal("speed"))), "input->")
    ['input->mrp[0]', 'input->mrp[1]', 'input->speed']
    """
    places = []
    for signal in layout.signals:
        places += [f"{owner}{signal.name}"] if signal.size == 1 else [
            f"{owner}{signal.name}[{i}]" for i in range(signal.size)
        ]  # fmt: skip
    return places


def elements(array: str, count: int) -> list[str]:
    """Return the C expression of each element of an array."""
    return [f"{array}[{i}]" for i in range(count)]


def declaration(signal: Signal | Tunable) -> str:
    """Return the declarator of a member."""
    size = signal.size if isinstance(signal, Signal) else len(signal.default)
    return signal.name if size == 1 else f"{signal.name}[{size}]"


def members(layout: Layout, notes: dict[str, str] | None = None) -> list[dict[str, str]]:
    """Return declaration and comment of each signal: unit, frame, range."""
    rows = []
    for signal in layout.signals:
        parts = [signal.unit or "-"]
        if signal.frame:
            parts.append(f"{signal.frame} frame")
        if notes and signal.name in notes:
            parts.append(notes[signal.name])
        elif signal.limit < math.inf:
            parts.append(f"up to {signal.limit:g} in magnitude")
        rows.append({"declaration": declaration(signal), "note": ", ".join(parts)})
    return rows


def output_members(controller: Controller) -> list[dict[str, str]]:
    """Return the members of the output; actuators and limited efforts with their ranges."""
    ranges = _ranges(controller.actuators, controller.lower, controller.upper)
    ranges |= _ranges(controller.limited, controller.least, controller.most)
    ranges |= dict.fromkeys(controller.wanted.names, "the law's command, before its limit")
    meanings = {
        "duality_gap": "bound on cost less least cost",
        "allocation_cost": "cost of the allocation",
        "worst_vertex": "number of the worst case",
        "iterations": "of the allocation",
    }
    return members(controller.outputs, {**ranges, **meanings})


def tunable_members(controller: Controller) -> list[dict[str, str]]:
    """Return the members of the parameters."""
    rows = []
    for one in controller.tunables:
        bound = (
            f", > {one.above:g}"
            if one.above is not None
            else f", >= {one.minimum:g}"
            if one.minimum is not None
            else ""
        )
        rows.append({"declaration": declaration(one), "note": f"{one.unit or '-'}{bound}; {one.note}"})
    return rows


def _ranges(layout: Layout, lower: tuple[float, ...], upper: tuple[float, ...]) -> dict[str, str]:
    ranges = {}
    for signal in layout.signals:
        rows = layout.place(signal.name)
        low, high = lower[rows], upper[rows]
        if len(set(low)) == len(set(high)) == 1:
            ranges[signal.name] = f"{low[0]:g} to {high[0]:g}"
        else:
            ranges[signal.name] = "; ".join(f"{a:g} to {b:g}" for a, b in zip(low, high, strict=True))
    return ranges
