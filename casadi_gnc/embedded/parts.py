"""The C functions that a function is printed as: itself, what it calls, its branches, loops, tables and linear systems.

Each is printed once, however often it is called, under a name of its own.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

import casadi as ca
import numpy as np

from casadi_gnc.embedded import programs
from casadi_gnc.embedded.pieces import Piece, node_piece, table_piece
from casadi_gnc.embedded.printer import comment
from casadi_gnc.embedded.program_text import declare, print_program
from casadi_gnc.embedded.programs import Callee, Port, Program
from casadi_gnc.embedded.quadratic import quadratic_piece
from casadi_gnc.embedded.scalars import Math, Real, c_constant
from casadi_gnc.embedded.tables import read_table
from casadi_gnc.errors import PrinterError
from casadi_gnc.system.templates import template


@dataclass
class Parts:
    """Print functions, each once.

    Parameters
    ----------
    maths, real : as for `print_program`.
    status : macro prefix of the package, whose bit SINGULAR a linear system raises.

    Attributes
    ----------
    solvers : unknowns and squares of the on-board solvers that are called.
    """

    maths: Math = "gnc"
    real: Real = "double"
    status: str = "GNC"
    texts: list[str] = field(default_factory=list)
    solvers: set[tuple[int, int]] = field(default_factory=set)
    _known: dict[tuple[object, ...], Callee] = field(default_factory=dict)
    _names: set[str] = field(default_factory=set)
    _functions: list[tuple[ca.Function, Callee]] = field(default_factory=list)
    _called: dict[int, int] = field(default_factory=dict)
    _used: set[str] = field(default_factory=set)
    _dimensions: int = 1
    _degree: int = 1

    def text(self) -> str:
        """Return the C of all, helpers first."""
        if any("copy_numbers(" in text for text in self.texts):
            self._used.add("copy_numbers")
        wide = self.real == "double"
        suffix = "" if wide else "f"
        helpers = template("function_parts.c.j2").render(
            parts=self._used,
            NAME=self.status,
            zero=c_constant(0.0, self.real),
            one=c_constant(1.0, self.real),
            fabs=f"{'gnc_' if self.maths == 'gnc' else ''}fabs{suffix}",
            nan=f"gnc_nan{suffix}_()" if self.maths == "gnc" else "(gnc_real)NAN",
            epsilon=c_constant(float(np.finfo(np.float64 if wide else np.float32).eps), self.real),
            dimensions=self._dimensions,
            degree=self._degree,
        )
        return "\n".join([helpers, *self.texts])

    def function(self, function: ca.Function, place: str = "", titles: Mapping[str, str] | None = None) -> Callee:
        """Print a function, unless it was, and all that it calls; return its name in C.

        `titles` say of its results what they are; by default their names do.

        Raises
        ------
        PrinterError
            For what has no C form: the node, where it is called, and what to do.
        """
        for known, callee in self._functions:
            if known.__hash__() == function.__hash__():
                return callee
        place = f"{place}, {function.name()}" if place else function.name()
        callee = self._made(function, place, titles)
        self._functions.append((function, callee))
        return callee

    def _made(self, function: ca.Function, place: str, titles: Mapping[str, str] | None) -> Callee:
        kind = function.class_name()
        if kind == "Switch":
            return self._branches(function, place)
        if kind in ("Map", "ThreadMap", "OmpMap"):
            return self._loop(function, place)
        if kind in ("LinearInterpolant", "LinearInterpolantJac", "BSplineInterpolant"):
            return self._piece(table_piece(read_table(function, place), function.name(), place, self.real))
        if programs.wraps_quadratic(function) and "lam_p" in function.name_out():
            raise PrinterError(
                f"{place} is a quadratic program itself, whose result lam_p is no number; make a function of what is "
                f"wanted, casadi.Function(..., [p, ...], [{function.name()}(p=p, lbx=..., ubx=...)['x']])"
            )
        if function.is_a("MXFunction"):
            self._count(function)
        made = programs.program(function, place, self._is_kept, self._printed)
        name = self._name(function.name())
        said = titles or {one: one for one in function.name_out()}
        results = {port.name: said.get(one, one) for port, one in zip(made.outputs, function.name_out(), strict=True)}
        text = print_program(name, made, maths=self.maths, real=self.real, titles=results)
        self.texts.append("\n".join([*comment(_ports(function, made), again=False), text]))
        return Callee(name, made.asks)

    def _count(self, function: ca.Function) -> None:
        """Count how often each function is called in this one."""
        for k in range(function.n_instructions()):
            if function.instruction_id(k) == ca.OP_CALL:
                called = function.instruction_MX(k).which_function().__hash__()
                self._called[called] = self._called.get(called, 0) + 1

    def _is_kept(self, called: ca.Function) -> bool:
        """Tell whether a plain function stays one: it is no small one, and is called again or calls others."""
        calls = called.is_a("MXFunction") and any(
            called.instruction_id(k) == ca.OP_CALL for k in range(called.n_instructions())
        )
        again = self._called.get(called.__hash__(), 0) - 1
        size = programs.operations(called)
        return size > programs.SMALL and max(again, 2 * calls) * size > programs.WRITTEN_OUT

    def _printed(self, function: ca.Function, k: int, place: str) -> Callee:
        node = function.instruction_MX(k)
        if programs.is_quadratic(function, k):
            return self._piece(quadratic_piece(function, k, place, self.maths, self.real, self.status.lower()))
        if function.instruction_id(k) == ca.OP_CALL:
            return self.function(node.which_function(), place)
        return self._piece(node_piece(node, place, self.real))

    def _name(self, wanted: str) -> str:
        """Return a name in C that nothing of the package has."""
        base = "f_" + re.sub(r"\W", "_", wanted)[:40]
        name, number = base, 1
        while name in self._names:
            number += 1
            name = f"{base}_{number}"
        self._names.add(name)
        return name

    def _branches(self, function: ca.Function, place: str) -> Callee:
        """Print a function that calls one of several others, by its first argument."""
        about = function.info()
        if about["project_in"] or about["project_out"]:
            raise PrinterError(f"{place} has branches whose results differ in their zeros; densify them")
        cases = [self.function(each, place) for each in about["f"]]
        default = self.function(about["f_def"], place)
        inputs, outputs = programs.ports(function)
        asks = any(each.asks for each in (*cases, default))
        given = ", ".join([*(port.name for port in (*inputs[1:], *outputs))])
        lines = [f"    const gnc_real which = {inputs[0].name}[0];"]

        def call(callee: Callee) -> str:
            return f"        {callee.name}({given}{', status' if callee.asks else ''});"

        for i, case in enumerate(cases):
            low, high = c_constant(float(i - (i == 0)), self.real), c_constant(float(i + 1), self.real)
            test = f"(which {'>' if i == 0 else '>='} {low}) && (which < {high})"
            lines += [f"    {'} else ' if i else ''}if ({test}) {{", call(case)]
        lines += ["    } else {", call(default), "    }"]
        return self._add(function.name(), inputs, outputs, asks, lines)

    def _loop(self, function: ca.Function, place: str) -> Callee:
        """Print a function that calls another one for each column of its arguments."""
        about = function.info()
        each, count = self.function(about["f"], place), int(about["n"])
        inputs, outputs = programs.ports(function)
        given = [f"&{port.name}[k * {port.size // count}]" if port.size else "0" for port in (*inputs, *outputs)]
        given += ["status"] if each.asks else []
        lines = ["    int32_t k;", f"    for (k = 0; k < {count}; ++k) {{"]
        lines += [f"        {each.name}({', '.join(given)});", "    }"]
        lines = [*(f"    (void){port.name};" for port in (*inputs, *outputs) if not port.size), *lines]
        return self._add(function.name(), inputs, outputs, each.asks, lines)

    def _piece(self, piece: Piece) -> Callee:
        """Print a piece; the same text is one function, however often it is made."""
        if piece.text not in self._known:
            self._dimensions = max(self._dimensions, piece.dimensions)
            self._degree = max(self._degree, piece.degree)
            self._used.update(piece.helpers)
            self.solvers.update([piece.solver] if piece.solver else [])
            self._known[piece.text] = self._add(piece.name, piece.inputs, piece.outputs, piece.asks, list(piece.lines))
        return self._known[piece.text]

    def _add(
        self, name: str, inputs: tuple[Port, ...], outputs: tuple[Port, ...], asks: bool, lines: list[str]
    ) -> Callee:
        callee = Callee(self._name(name), asks)
        self.texts.append("\n".join([declare(callee.name, inputs, outputs, asks), "{", *lines, "}", ""]))
        return callee


def _ports(function: ca.Function, made: Program) -> str:
    """Return which port of a function is which argument of its C."""
    ports = [*zip(made.inputs, function.name_in(), strict=True), *zip(made.outputs, function.name_out(), strict=True)]
    return f"{function.name()}: " + ", ".join(f"{port.name} is {name}" for port, name in ports)
