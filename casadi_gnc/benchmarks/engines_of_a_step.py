"""Ways to run one CasADi function: CasADi's machine, CasADi's C, our C, and a program in Python.

Each is made from the same SX function, so that no equation is written twice. A way takes the columns of
all inputs as one array and returns those of all outputs.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from functools import cache
from itertools import pairwise
from typing import Any, Literal

import casadi as ca
import numpy as np

from casadi_gnc.embedded.printer import Math, Real, print_function
from casadi_gnc.system import assets, compilers
from casadi_gnc.system.templates import template

Way = Callable[[np.ndarray], np.ndarray]
#: Flags as for flights.
_FLAGS = ("-O2",)
#: Python for what a tape may hold; {0} and {1} are operands, {m} the module of elementary functions.
_PYTHON = {
    ca.OP_ASSIGN: "{0}",
    ca.OP_ADD: "{0} + {1}",
    ca.OP_SUB: "{0} - {1}",
    ca.OP_MUL: "{0} * {1}",
    ca.OP_DIV: "{0} / {1}",
    ca.OP_NEG: "-{0}",
    ca.OP_SQ: "{0} * {0}",
    ca.OP_TWICE: "{0} + {0}",
    ca.OP_INV: "1.0 / {0}",
    ca.OP_LT: "float({0} < {1})",
    ca.OP_LE: "float({0} <= {1})",
    ca.OP_EQ: "float({0} == {1})",
    ca.OP_NE: "float({0} != {1})",
    ca.OP_NOT: "float(not {0})",
    ca.OP_AND: "float(bool({0}) and bool({1}))",
    ca.OP_OR: "float(bool({0}) or bool({1}))",
    ca.OP_IF_ELSE_ZERO: "{1} if {0} else 0.0",
    ca.OP_POW: "{m}.pow({0}, {1})",
    ca.OP_CONSTPOW: "{m}.pow({0}, {1})",
    ca.OP_FABS: "abs({0})",
}
_PYTHON |= {
    getattr(ca, f"OP_{name.upper()}"): f"{{m}}.{name}({{0}})"
    for name in ("exp", "log", "expm1", "log1p", "sqrt", "sin", "cos", "tan", "sinh", "cosh", "tanh")
}
#: Those that numpy names otherwise.
_ARCS = {ca.OP_ASIN: "asin", ca.OP_ACOS: "acos", ca.OP_ATAN: "atan", ca.OP_ATAN2: "atan2"}


def python_way(function: ca.Function, module: Literal["math", "np"] = "math") -> Way:
    """Return the function as a program in Python, one assignment an operation.

    Parameters
    ----------
    module : "math" computes with Python's own floats, "np" with numpy's numbers and functions.
    """
    lines, starts = ["def step(given):"], _starts(function, "in")
    if module == "math":
        lines.append("    given = given.tolist()")
    arc = "arc" if module == "np" else "a"
    results: dict[int, str] = {}
    ends = _starts(function, "out")
    for k in range(function.n_instructions()):
        code, into = function.instruction_id(k), function.instruction_output(k)
        operands = function.instruction_input(k)
        if code == ca.OP_OUTPUT:
            results[ends[into[0]] + into[1]] = f"r{operands[0]}"
            # What is stored may be overwritten before the end, so it gets a name of its own.
            lines.append(f"    o{ends[into[0]] + into[1]} = r{operands[0]}")
        elif code == ca.OP_INPUT:
            lines.append(f"    r{into[0]} = given[{starts[operands[0]] + operands[1]}]")
        elif code == ca.OP_CONST:
            lines.append(f"    r{into[0]} = {float(function.instruction_constant(k))!r}")
        else:
            called = (
                f"{{m}}.{arc}{_ARCS[code][1:]}({', '.join(f'{{{i}}}' for i in range(len(operands)))})"
                if code in _ARCS
                else ""
            )
            text = (called or _PYTHON[code]).format(*(f"r{i}" for i in operands), m=module)
            lines.append(f"    r{into[0]} = {text}")
    outputs = [f"o{i}" if i in results else "0.0" for i in range(ends[-1])]
    lines.append(f"    return array([{', '.join(outputs)}])")
    names: dict[str, Any] = {"math": math, "np": np, "array": np.array, "inf": math.inf, "nan": math.nan}
    exec(compile("\n".join(lines), "step", "exec"), names)
    return names["step"]


def call_way(function: ca.Function) -> Way:
    """Return CasADi's machine by its general call, with columns made for it and joined after."""
    starts = _starts(function, "in")
    pairs = list(pairwise(starts))

    def run(given: np.ndarray) -> np.ndarray:
        said = function.call([ca.DM(given[a:b]) for a, b in pairs])
        return np.concatenate([np.array(one).ravel(order="F") for one in said])

    return run


def buffer_way(function: ca.Function) -> Way:
    """Return CasADi's machine by its buffers: no objects are made for a call."""
    buffer: Any
    buffer, trigger = function.buffer()
    given, found = np.zeros(_starts(function, "in")[-1]), np.zeros(_starts(function, "out")[-1])
    for side, column, put in (("in", given, buffer.set_arg), ("out", found, buffer.set_res)):
        starts = _starts(function, side)  # type: ignore[arg-type]
        for i, (a, b) in enumerate(pairwise(starts)):
            if b > a:
                put(i, memoryview(column[a:b].data))

    def run(columns: np.ndarray) -> np.ndarray:
        given[:] = columns
        trigger()
        return found.copy()

    run.kept = buffer  # type: ignore[attr-defined]  # the trigger points into it
    return run


def casadi_c_way(function: ca.Function) -> Way:
    """Return CasADi's own C, compiled with the same flags and called through CasADi's buffers."""
    generator = ca.CodeGenerator(function.name())
    generator.add(function)
    path = compilers.compiled(generator.dump(), include=assets.folder("codegen") / "runtime", flags=_FLAGS)
    return buffer_way(ca.external(function.name(), str(path)))


def c_way(function: ca.Function, real: Real, maths: Math, times: int = 1, entry: str = "step") -> Way:
    """Return our C, called through ctypes; a call makes the step so many times (`entry` "nothing": not at all)."""
    library = _library(function, real, maths)
    call = library[f"benchmark_{entry}"]
    call.argtypes, call.restype = (ctypes.c_void_p, ctypes.c_void_p, ctypes.c_long), None
    given, found = np.zeros(_starts(function, "in")[-1]), np.zeros(_starts(function, "out")[-1])
    arguments = given.ctypes.data, found.ctypes.data, times

    def run(columns: np.ndarray) -> np.ndarray:
        given[:] = columns
        call(*arguments)
        return found.copy()

    return run


def _library(function: ca.Function, real: Real, maths: Math) -> ctypes.CDLL:
    folder = assets.folder("codegen")
    inputs, outputs = _starts(function, "in"), _starts(function, "out")
    source = template("benchmark_step.c.j2").render(
        title=function.name(),
        name=function.name(),
        real=real,
        maths=maths,
        function=print_function(function, real=real, maths=maths),
        inputs=inputs[-1],
        outputs=outputs[-1],
        arguments=", ".join([f"a + {i}" for i in inputs[:-1]] + [f"b + {i}" for i in outputs[:-1]]),
    )
    flags = (*_FLAGS, "-fno-builtin") if maths == "libm" else _FLAGS
    return compilers.load(source, include=folder / "runtime", flags=flags)


@cache
def _starts(function: ca.Function, side: Literal["in", "out"]) -> list[int]:
    """Return where each port begins in the column of all, and the column's length."""
    count = function.n_in() if side == "in" else function.n_out()
    sizes = [function.numel_in(i) if side == "in" else function.numel_out(i) for i in range(count)]
    return [0, *np.cumsum(sizes).tolist()]
