"""Print what a package does with faults: what it adds to the state, and the words of its C."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from itertools import groupby
from typing import Any

from casadi_gnc.embedded.controller import Controller, Options
from casadi_gnc.embedded.dictionary import Entry, entries
from casadi_gnc.embedded.faults import Faults
from casadi_gnc.embedded.manifest import digest
from casadi_gnc.embedded.members import access, elements
from casadi_gnc.embedded.scalars import LARGEST_FLOAT, Real, c_constant
from casadi_gnc.signals import Layout

LARGEST_DOUBLE = sys.float_info.max
#: What every state ends with.
COUNTERS = (
    Entry("last_time", "last_time", 1, "real", "s", "of the last step"),
    Entry("started", "started", 1, "uint32", "", "0 until the first good measurement"),
    Entry("stepped", "stepped", 1, "uint32", "", "0 until the first step"),
    Entry("ready", "ready", 1, "uint32", "", "a pattern once it is reset"),
)


def state(controller: Controller) -> list[Entry]:
    """Return the members of the state but for the allocator's."""
    found = [*entries(controller.memory, "memory.")]
    found += entries(controller.measured, "good.", "last good measurement")
    found += entries(controller.actuators, "previous.", "last command")
    return [*found, *_added(controller), *COUNTERS]


def _added(controller: Controller) -> list[Entry]:
    if controller.faults is None:
        return []
    replaced = ("replaced", "of them with a measurement that was replaced")
    iterations, rows = controller.allocation is not None, controller.limited.size
    return list(added(controller.faults, _counted(controller).values(), replaced, iterations=iterations, rows=rows))


def added(
    faults: Faults, counted: Iterable[str], lost: tuple[str, str], *, iterations: bool = False, rows: int = 0
) -> Iterator[Entry]:
    """Yield what the options add to the state, by groups: the part of `place` before the dot.

    Parameters
    ----------
    counted : names of the bits whose steps in a row are counted.
    lost : the member that counts steps with bad inputs, and what it is.
    iterations : whether there is an allocator that counts them.
    rows : of the effort, 0 where there is none; then a failure has no time of its own either.
    """

    def number(place: str, note: str) -> Entry:
        return Entry(place.partition(".")[2], place, 1, "uint32", "", note)

    if faults.count or faults.latch:
        yield number("health.samples", "steps since the reset")
    if faults.count:
        yield number(f"health.{lost[0]}", lost[1])
        if iterations:
            yield number("health.worst_iterations", "most iterations of the allocator in a step")
        for name in counted:
            yield number(f"in_a_row.{name.lower()}", f"steps in a row with {name}")
    if faults.latch:
        if rows:
            yield Entry("failure_time", "failure.time", 1, "real", "s", "of the first failure")
        yield number("failure.sample", "step of the first failure, from 1 on; 0: none")
        yield number("failure.status", "its status")
    for name, most in faults.ages:
        yield number(f"held.{name}", f"steps in a row in which it was held; {most} at most are no fault")
    if faults.safe is not None:
        yield number("safe.on", "1: in safe mode")
        yield number("safe.failed", "failures in a row")
        yield number("safe.good", "steps without failure in a row")
    if faults.fade:
        yield Entry("last", "fading.last", rows, "real", "", "limited effort of the last step")
        yield Entry("offset", "fading.offset", rows, "real", "", "its difference where the gains were changed")
        yield number("fading.left", "steps until the new gains alone count")
        yield number("fading.seen", "change of the gains that this state knows")


def _counted(controller: Controller) -> dict[int, str]:
    """Return the bits that are counted, by value: those of steps that were taken, which options here do not raise."""
    also = ("TIME_SHIFTED", "MEASUREMENT_STALE")
    return {bit: name for bit, (name, _) in controller.raised.items() if bit in controller.statuses or name in also}


def header(controller: Controller) -> dict[str, Any]:
    """Return what the header says: the groups that are added to the state."""
    return {"groups": groups(_added(controller))}


def groups(entries: Iterable[Entry]) -> dict[str, list[Entry]]:
    """Return the members that are added to a state by the struct that they are in."""
    return {name: list(rows) for name, rows in groupby(entries, key=lambda one: one.place.partition(".")[0])}


def image(controller: Controller, real: Real) -> dict[str, Any] | None:
    """Return where the numbers of a controller's state lie in its image, None where there is none."""
    if controller.faults is None or not controller.faults.image:
        return None
    about = [controller.title, controller.scheme, str(controller.period), real]
    return image_of(state(controller), about, real, is_cold=controller.allocation is not None)


def image_of(state: list[Entry], about: list[str], real: Real, *, is_cold: bool = False) -> dict[str, Any]:
    """Return where the numbers of a state lie in its image.

    The identity says what numbers they are: it is that of every package with the same `about`, state and type.
    """
    width, at, places = {"double": 8, "float": 4}[real], 4, []
    for one in state:
        for place in one.elements:
            places.append({"place": place, "at": at, "is_real": one.type == "real"})
            at += width if one.type == "real" else 4
    told = [*about, *(f"{one.place} {one.size} {one.type} {one.unit}" for one in state)]
    return {
        "places": places,
        "octets": at + 4,
        "width": width,
        "identity": int(digest("\n".join(told))[:8], 16),
        "largest": c_constant(LARGEST_FLOAT if real == "float" else LARGEST_DOUBLE, real),
        "is_cold": is_cold,
    }


def source(controller: Controller, options: Options) -> dict[str, Any] | None:
    """Return what the source says, None where no option is on."""
    faults = controller.faults
    if faults is None:
        return None
    y = controller.measured
    place = dict(zip(access(y, "input->"), elements("now->accepted", y.size), strict=True))
    held = [
        {"name": name, "most": most, "same": [f"({given} == {place[given]})" for given in _of(y, name)]}
        for name, most in faults.ages
    ]
    name, count = options.name, controller.actuators.size
    safe = [options.constant(value) for value in faults.safe or ()] or elements("now->previous", count)
    return {
        "own": faults,
        "held": held,
        "looked_at": f"const {name}_input *input, const sample *now",
        "counted": list(_counted(controller).values()),
        "lost": {"member": "replaced", "bits": f"(uint32_t){name.upper()}_MEASUREMENT_REPLACED"},
        "told": "sample *now",
        "lines": [f"now->actuators[{i}] = inside({safe[i]}, now->lower[{i}], now->upper[{i}]);" for i in range(count)],
        "timed": True,
        "iterations": faults.count and controller.allocation is not None,
        "actuators": count,
        "efforts": controller.limited.size,
        "steps": options.constant(float(faults.fade)),
        "image": image(controller, options.real),
    }


def _of(measured: Layout, name: str) -> list[str]:
    return access(Layout((measured.signal(name),)), "input->")
