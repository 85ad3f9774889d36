"""Print a controller as C: header, source, and the allocator where the step needs it."""

from __future__ import annotations

import re
from itertools import accumulate
from typing import Any

from casadi_gnc.allocation import online
from casadi_gnc.allocation.problem import AllocationProblem
from casadi_gnc.embedded import fault_source
from casadi_gnc.embedded.controller import Controller, Options
from casadi_gnc.embedded.members import (
    access,
    elements,
    members,
    output_members,
    tunable_members,
)
from casadi_gnc.embedded.printer import print_function
from casadi_gnc.system import assets
from casadi_gnc.system.templates import template
from casadi_gnc.system.text import c_comment

#: Objects that a tape may read or write, with their C declarations ({name}: prefix of the package).
_OBJECTS = {
    "state": "const {name}_state *state",
    "params": "const {name}_params *params",
    "input": "const {name}_input *input",
    "now": "sample *now",
}
_CALLED = {"state": "state", "params": "params", "input": "input", "now": "&now"}
_SIZED = "/* The allocator of this package: sizes and names; what follows is the same for all. */\n"
_NOTES = {
    "derive": "What follows from the parameters.",
    "start": "The memory at the first measurement.",
    "before": "From the measurement to the limited effort and the bounds of the actuators.",
    "allocate": "From the limited effort to the actuators.",
    "judge": "What is known once the actuators are.",
    "modulate": "Pulses of what is asked of the actuators, and what they carry over.",
    "after": "The memory one sample later.",
}


def runtime_files(controller: Controller, options: Options) -> list[str]:
    """Return the files of `codegen/runtime` that the package carries."""
    maths = ["gnc_arithmetic.h"]
    if options.maths == "gnc":
        maths += ["gnc_mathf.h"] if options.real == "float" else ["gnc_math.h", "gnc_mathf.h"]
    if controller.allocation is None:
        return maths
    return [*maths, "gnc_allocate.h", "gnc_allocate_internal.h"]


def render_header(controller: Controller, options: Options, hashed: str) -> str:
    """Return the text of the header; `hashed` is the hash of the source, by which the running code is known."""
    sizes = {
        "MEASURED": controller.measured.size,
        "MEMORY": controller.memory.size,
        "EFFORTS": controller.limited.size,
        "ACTUATORS": controller.actuators.size,
    }
    state = {"memory": members(controller.memory), "good": members(controller.measured)}
    state["previous"] = members(controller.actuators)
    return template("package_header.h.j2").render(
        **_common(controller, options),
        identity=hashed[:16],
        period=options.constant(controller.period),
        sizes=[{"name": name, "value": value} for name, value in sizes.items()],
        statuses=[{"value": b, "name": n, "sentence": s} for b, (n, s) in controller.raised.items()],
        measured=members(controller.measured),
        outputs=output_members(controller),
        state=state,
        tunables=tunable_members(controller),
        derived=_derived(controller),
        allocation=_sizes(controller),
        faults=controller.faults,
        handled={**fault_source.header(controller), "image": fault_source.image(controller, options.real)},
    )  # fmt: skip


def render_source(controller: Controller, options: Options) -> str:
    """Return the text of the source file.

    Raises
    ------
    PrinterError
        For an operation or a constant that has no C form.
    """
    tapes, calls = [], {}
    for name in _NOTES:
        own = {"start": controller.memory.size, "after": controller.memory.size - controller.carry}
        if name not in controller.tapes or not own.get(name, True):
            continue
        text, call = _print(name, controller, options)
        tapes.append({"text": text, "note": _NOTES[name]})
        calls[name] = call
    faults = controller.faults
    reads = controller.allocation is not None or any("params" in call for call in calls.values())
    return template("package_source.c.j2").render(
        **_common(controller, options),
        maths=options.maths,
        numbers=numbers(options, controller.period),
        count={
            "measured": controller.measured.size,
            "memory": controller.memory.size,
            "carried": _carried(controller),
            "efforts": controller.limited.size,
            "actuators": controller.actuators.size,
        },
        tapes=tapes,
        calls=calls,
        reads_params=reads or bool(faults and faults.fade),
        faults=fault_source.source(controller, options),
        guards=faults is not None and faults.safe is not None,
        notes=faults is not None and (faults.count or faults.latch or faults.safe is not None),
        tunables=controller.tunables,
        tunable_places=[place for one in controller.tunables for place in access_tunable(one, "")],
        checks=_checks(controller, options),
        defaults=_defaults(controller, options),
        first=_copy(access(controller.measured, "state->good."), access(controller.measured, "input->")),
        copies=_copies(controller),
        allocation=problem_tables(controller.allocation, options) if controller.allocation is not None else None,
    )  # fmt: skip


def numbers(options: Options, period: float) -> dict[str, str]:
    """Return the numbers that checks of time are written with; `rounding` is of a time, 4 units in the last place."""
    values = {"zero": 0.0, "one": 1.0, "half": 0.5, "largest": 1e30, "period": period}
    values["rounding"] = 4.0 * 2.0 ** (-23 if options.real == "float" else -52)
    return {name: options.constant(value) for name, value in values.items()}


def allocator_files(controller: Controller, options: Options) -> dict[str, str]:
    """Return the units of the allocator where a controller has one."""
    return {} if controller.allocation is None else allocator_units(controller.allocation, options)


def allocator_units(problem: AllocationProblem, options: Options) -> dict[str, str]:
    """Return the units of the allocator under the package's own names, so that two of them link into one image."""
    return solver_units(allocation_sizes(problem), options, options.name, f"{options.name}_allocate")


def solver_units(sizes: dict[str, int], options: Options, prefix: str, stem: str) -> dict[str, str]:
    """Return the units of the on-board solver for sizes, its symbols and its files called after these names."""
    macros = template("package_sizes.j2").render(name=prefix, real=options.real, allocation=sizes)
    runtime, files = assets.folder("codegen") / "runtime", {}
    for unit in online.units():
        text = (runtime / unit).read_text(encoding="utf-8")
        files[unit.replace("gnc_allocate", stem, 1)] = f"{_SIZED}{macros}\n{text}"
    return files


def _common(controller: Controller, options: Options) -> dict[str, Any]:
    return {
        "name": options.name,
        "NAME": options.name.upper(),
        "title": controller.title,
        "scheme": controller.scheme,
        "real": options.real,
    }


def _sizes(controller: Controller) -> dict[str, int] | None:
    return None if controller.allocation is None else allocation_sizes(controller.allocation)


def allocation_sizes(problem: AllocationProblem) -> dict[str, int]:
    """Return the sizes that the allocator is compiled for."""
    return dict(zip(("N", "R", "P", "V"), online.sizes(problem), strict=True))


def _derived(controller: Controller) -> int:
    return controller.tapes["derive"].numel_out(0) if "derive" in controller.tapes else 0


def _carried(controller: Controller) -> int:
    return controller.tapes["before"].numel_out("carried")


def _places(name: str, controller: Controller) -> dict[str, list[str]]:
    """Return where the elements of each port of a tape lie."""
    y, n = controller.measured, controller.limited.size
    count, memory = controller.actuators.size, controller.memory.size
    return {
        "t": ["input->time"],
        "y": access(y, "input->"),
        "good": access(y, "state->good."),
        "m": access(controller.memory, "state->memory."),
        "actuators": elements("now->previous", count)
        if name == "allocate"
        else access(controller.actuators, "state->previous."),
        "told": elements("now->actuators", count),
        "carried": elements("now->carried", _carried(controller)),
        "p": [place for one in controller.tunables for place in access_tunable(one, "params->")],
        "e": elements("params->derived", _derived(controller)),
        "derived": elements("params->derived", _derived(controller)),
        "accepted": elements("now->accepted", y.size),
        "memory": elements("now->memory", memory)[: memory - controller.carry],
        "carry": elements("now->memory", memory)[memory - controller.carry :],
        "pulses": elements("now->actuators", count),
        "wanted": elements("now->wanted", n),
        "limited": elements("now->limited", n),
        "lower": elements("now->lower", count),
        "upper": elements("now->upper", count),
        "allocated": elements("now->actuators", count),
        "flags": ["now->flags"],
        "verdict": ["now->verdict"],
        "last": elements("state->fading.last", n) if n > 1 else ["state->fading.last"],
        "offset": elements("state->fading.offset", n) if n > 1 else ["state->fading.offset"],
        "share": ["now->share"],
        "changed": ["now->changed"],
        "shifted": elements("now->shifted", n),
    }


def access_tunable(tunable: Any, owner: str) -> list[str]:
    """Return the C expression of each element of a parameter."""
    count = len(tunable.default)
    return [f"{owner}{tunable.name}"] if count == 1 else elements(f"{owner}{tunable.name}", count)


def _print(name: str, controller: Controller, options: Options) -> tuple[str, str]:
    """Return the C of a tape and the arguments of its call; it takes those objects that it touches."""
    tape = controller.tapes[name]
    places = _places(name, controller)
    arguments: dict[str, Any] = {"maths": options.maths, "real": options.real, "places": places, "flag": "gnc_flag"}
    arguments["titles"] = {
        places[port][first + i]: f"{c_comment(what)}"
        for port, blocks in controller.notes.get(name, {}).items()
        for first, (count, what) in zip(accumulate((n for n, _ in blocks), initial=0), blocks, strict=False)
        for i in range(count)
        if first + i < len(places[port])
    }
    if name == "before":
        arguments["titles"] |= dict.fromkeys(
            places["carried"], "carried: what the steps after the allocation take over"
        )
    arguments["marks"] = [(c_comment(title), nodes) for title, nodes in controller.marks.get(name, ())]
    draft = print_function(tape, arguments=[], **arguments)
    touched = [thing for thing in _OBJECTS if re.search(rf"\b{thing}->", draft)]
    declared = [_OBJECTS[thing].format(name=options.name) for thing in touched]
    if name in ("start", "derive"):  # the only ones that write to what the caller owns
        declared = [text.removeprefix("const ") if thing in ("state", "params") else text
                    for thing, text in zip(touched, declared, strict=True)]  # fmt: skip
    if name == "start":
        declared = [text if "params" not in text else f"const {text}" for text in declared]
    return print_function(tape, arguments=declared, **arguments), ", ".join(_CALLED[thing] for thing in touched)


def _copy(targets: list[str], sources: list[str]) -> list[str]:
    return [f"{target} = {source};" for target, source in zip(targets, sources, strict=True)]


def _copies(controller: Controller) -> dict[str, list[str]]:
    """Return the statements that move columns between the caller's structs and the sample."""
    count, efforts = controller.actuators.size, controller.limited.size
    told = elements("now.actuators", count)
    results = _copy(access(controller.measured, "state->good."), elements("now.accepted", controller.measured.size))
    results += _copy(access(controller.memory, "state->memory."), elements("now.memory", controller.memory.size))
    asked = _copy(access(controller.actuators, "state->previous."), told)
    results += [] if controller.carry else asked
    results += _copy(access(controller.actuators, "output->"), told)
    results += _copy(access(controller.wanted, "output->"), elements("now.wanted", efforts))
    results += _copy(access(controller.limited, "output->"), elements("now.limited", efforts))
    if controller.faults is not None and controller.faults.fade:
        places = _places("before", controller)
        results += _copy(places["last"], elements("now.limited", efforts))
        results += _copy(places["offset"], elements("now.shifted", efforts))
    previous = _copy(elements("now.previous", count), access(controller.actuators, "state->previous."))
    return {"results": results, "previous": previous, "asked": asked if controller.carry else []}


def _checks(controller: Controller, options: Options) -> list[str]:
    """Return a C condition for each element of each parameter; false for NaN."""
    largest = options.constant(1e30)
    conditions = []
    for one in controller.tunables:
        for place in access_tunable(one, "params->"):
            low = f"{place} > {options.constant(one.above)}" if one.above is not None else (
                f"{place} >= {options.constant(one.minimum if one.minimum is not None else -1e30)}"
            )  # fmt: skip
            conditions += [f"({low})", f"({place} <= {largest})"]
    return conditions


def _defaults(controller: Controller, options: Options) -> list[str]:
    return [
        f"{place} = {options.constant(value)};"
        for one in controller.tunables
        for place, value in zip(access_tunable(one, "params->"), one.default, strict=True)
    ]


def problem_tables(problem: AllocationProblem, options: Options) -> dict[str, Any]:
    """Return the constant tables of the allocation problem, row by row."""
    arrays = {"A0": problem.effectiveness}
    if online.sizes(problem)[2]:
        arrays |= {"E": problem.coupling, "D": problem.errors}
    arrays |= {"m1": problem.effort_weight, "m2": problem.change_weight, "preferred": problem.preferred}
    tables = [
        {"name": name, "values": [options.constant(float(value)) for value in array.ravel()]}
        for name, array in arrays.items()
    ]
    return {"tables": tables, "h": options.constant(float(problem.accuracy_weight))}
