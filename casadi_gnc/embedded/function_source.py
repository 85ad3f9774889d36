"""Print a flight function as C: header and source, and the files that replay it."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from casadi_gnc.embedded import function_faults
from casadi_gnc.embedded.controller import Options
from casadi_gnc.embedded.flight_function import FlightFunction, to_text
from casadi_gnc.embedded.manifest import digest
from casadi_gnc.embedded.members import access, declaration
from casadi_gnc.embedded.parts import Parts
from casadi_gnc.embedded.quadratic import solver_name
from casadi_gnc.embedded.source import numbers, solver_units
from casadi_gnc.signals import Layout
from casadi_gnc.system import assets
from casadi_gnc.system.templates import template
from casadi_gnc.system.text import c_comment

#: Up to so many numbers are tested one by one, more by a loop.
_SHORT = 4


def function_files(own: FlightFunction, options: Options) -> dict[str, str]:
    """Return the files that fly: path inside the package -> text.

    Raises
    ------
    PrinterError
        For what has no C form: the node, where it comes from, and what to do.
    """
    return dict(_files(own, options))


@lru_cache(maxsize=1)
def _files(own: FlightFunction, options: Options) -> dict[str, str]:
    parts = Parts(options.maths, options.real, options.name.upper())
    callee = parts.function(own.function, titles=_titles(own))
    about = common(own, options)
    solvers = _solvers(parts, options)
    source = template("function_source.c.j2").render(
        **about,
        maths=options.maths,
        parts=parts.text(),
        solvers=[template("package_sizes.j2").render(**one, real=options.real) for one in solvers],
        call=f"{callee.name}({', '.join(_arguments(own) + (['&now.outputs.status'] if callee.asks else []))});",
        given=_finite(own.inputs, "input->"),
        found=_finite(own.outputs, "now->outputs.") + _finite(own.state, "now->after."),
        long=any(one.size > _SHORT for one in (*own.inputs.signals, *own.outputs.signals, *own.state.signals)),
        initial=list(zip(access(own.state, "state->memory."), map(options.constant, own.initial), strict=True)),
        largest="FLT_MAX" if options.real == "float" else "DBL_MAX",
        fabs=f"{'gnc_' if options.maths == 'gnc' else ''}fabs{'f' if options.real == 'float' else ''}",
    )
    runtime = assets.folder("codegen") / "runtime"
    maths = ["gnc_arithmetic.h"]
    if options.maths == "gnc":
        maths += ["gnc_mathf.h"] if options.real == "float" else ["gnc_math.h", "gnc_mathf.h"]
    files = {f"{options.name}.h": template("function_header.h.j2").render(**about), f"{options.name}.c": source}
    if solvers:
        maths = ["gnc_arithmetic.h", "gnc_mathf.h", *(["gnc_math.h"] if options.real == "double" else [])]
        maths += ["gnc_allocate.h", "gnc_allocate_internal.h"]
    files |= {name: (runtime / name).read_text(encoding="utf-8") for name in maths}
    for one in solvers:
        stem = one["name"].replace(options.name, f"{options.name}_allocate", 1)
        files |= solver_units(one["allocation"], options, one["name"], stem)
    return {**files, "LICENSE": (assets.folder("codegen") / "LICENSE").read_text(encoding="utf-8")}


def _solvers(parts: Parts, options: Options) -> list[dict[str, Any]]:
    """Return prefix and sizes of each on-board solver that is called."""
    return [
        {"name": solver_name(options.name, (n, r)), "allocation": {"N": n, "R": r, "P": 0, "V": 1}}
        for n, r in sorted(parts.solvers)
    ]


def common(own: FlightFunction, options: Options) -> dict[str, Any]:
    """Return what header, source and README say of the ports."""
    return {
        "name": options.name,
        "NAME": options.name.upper(),
        "title": own.title,
        "identity": digest(to_text(own))[:16],
        "real": options.real,
        "period": options.constant(own.period) if own.period else "",
        "inputs": _members(own, own.inputs),
        "state": _members(own, own.state),
        "outputs": _members(own, own.outputs),
        "clocked": own.is_clocked,
        "numbers": numbers(options, own.period),
        **function_faults.header(own, options),
        "statuses": [{"value": b, "name": n, "sentence": s} for b, (n, s) in own.statuses.items()],
    }


def _members(own: FlightFunction, layout: Layout) -> list[dict[str, str]]:
    rows = []
    for signal in layout.signals:
        note = [signal.unit or "-", own.shape(signal.name), own.notes.get(signal.name, "")]
        rows.append({"declaration": declaration(signal), "note": ", ".join(part for part in note if part)})
    return rows


def _titles(own: FlightFunction) -> dict[str, str]:
    """Return of each result what it is, as the step's comments say it."""
    after = {output: name for name, output in own.pairs.items()}
    found = {}
    for name in own.function.name_out():
        port = after.get(name, name)
        rows, columns = own.function.size_out(name)
        about = [f"the next {port}" if name in after else own.notes.get(name, ""), f"({rows}, {columns})"]
        about += [f"[{unit}]"] if (unit := own.units.get(port, "")) else []
        found[name] = c_comment(f"{name}: {', '.join(part for part in about if part)}")
    return found


def _finite(layout: Layout, owner: str) -> list[str]:
    """Return C that tests whether the numbers of a struct are finite."""
    tests = []
    for signal in layout.signals:
        if signal.size > _SHORT:
            tests.append(f"all_finite({signal.size}, {owner}{signal.name})")
        else:
            tests += [f"is_finite({place})" for place in access(Layout((signal,)), owner)]
    return tests


def _arguments(own: FlightFunction) -> list[str]:
    """Return the arguments of the printed function, port by port."""
    function, after = own.function, {output: name for name, output in own.pairs.items()}
    places = []
    for name in function.name_in():
        owner = "state->memory." if name in own.pairs else "input->"
        places.append((f"{owner}{name}", function.numel_in(name)))
    for name in function.name_out():
        owner = f"now.after.{after[name]}" if name in after else f"now.outputs.{name}"
        places.append((owner, function.numel_out(name)))
    return [place if size > 1 else f"&{place}" if size else "0" for place, size in places]


def replay_header(own: FlightFunction, options: Options, steps: int) -> str:
    """Return `test/replay.h`, which names the words of inputs and outputs."""
    return template("function_replay.h.j2").render(
        name=options.name,
        bits=64 if options.real == "double" else 32,
        steps=steps,
        inputs=access(own.inputs, "input->"),
        outputs=[*access(own.outputs, "output->step."), *access(own.state, "output->state->memory.")],
        status="output->step.status",
    )
