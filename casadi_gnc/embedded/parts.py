"""The C functions that a function is printed as: itself, what it calls, its branches, loops, tables and linear systems.

Each is printed once, however often it is called, under a name of its own.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import casadi as ca
import numpy as np

from casadi_gnc.embedded import programs
from casadi_gnc.embedded.program_text import declare, print_program
from casadi_gnc.embedded.programs import Callee, Port
from casadi_gnc.embedded.scalars import Math, Real, c_constant
from casadi_gnc.embedded.tables import Table, read_table
from casadi_gnc.errors import PrinterError
from casadi_gnc.system.templates import template

#: Largest linear system that is solved on board.
MOST_UNKNOWNS = 32
#: Most inputs of a table, and most degree of a spline.
MOST_DIMENSIONS, MOST_DEGREE = 6, 7


@dataclass
class Parts:
    """Print functions, each once.

    Parameters
    ----------
    maths, real : as for `print_program`.
    status : macro prefix of the package, whose bit SINGULAR a linear system raises.
    """

    maths: Math = "gnc"
    real: Real = "double"
    status: str = "GNC"
    texts: list[str] = field(default_factory=list)
    _known: dict[str, Callee] = field(default_factory=dict)
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
            epsilon=c_constant(float(np.finfo(np.float64 if wide else np.float32).eps), self.real),
            dimensions=self._dimensions,
            degree=self._degree,
        )
        return "\n".join([helpers, *self.texts])

    def function(self, function: ca.Function, place: str = "") -> Callee:
        """Print a function, unless it was, and all that it calls; return its name in C.

        Raises
        ------
        PrinterError
            For what has no C form: the node, where it is called, and what to do.
        """
        for known, callee in self._functions:
            if known.__hash__() == function.__hash__():
                return callee
        place = f"{place}, {function.name()}" if place else function.name()
        callee = self._made(function, place)
        self._functions.append((function, callee))
        return callee

    def _made(self, function: ca.Function, place: str) -> Callee:
        kind = function.class_name()
        if kind == "Switch":
            return self._branches(function, place)
        if kind in ("Map", "ThreadMap", "OmpMap"):
            return self._loop(function, place)
        if kind in ("LinearInterpolant", "BSplineInterpolant"):
            return self._table(read_table(function, place), function.name(), place)
        if function.is_a("MXFunction"):
            self._count(function)
        made = programs.program(function, place, self._is_kept, self._printed)
        name = self._name(function.name())
        self.texts.append(print_program(name, made, maths=self.maths, real=self.real))
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
        size = programs.expanded(called, called.name()).n_instructions()
        return size > programs.SMALL and max(again, 2 * calls) * size > programs.WRITTEN_OUT

    def _printed(self, function: ca.Function, k: int, place: str) -> Callee:
        code, node = function.instruction_id(k), function.instruction_MX(k)
        if code == ca.OP_CALL:
            return self.function(node.which_function(), place)
        if code == ca.OP_BSPLINE:
            point = ca.MX.sym("x", node.dep(0).sparsity())
            alone = ca.Function("spline", [point], ca.graph_substitute([node], [node.dep(0)], [point]))
            return self._table(read_table(alone, f"{place}, a spline"), "spline", place)
        return self._solve(node, place)

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

    def _table(self, table: Table, name: str, place: str) -> Callee:
        """Print an interpolant; the same table is one function, however often it is made."""
        key = repr((table.starts, table.grid, table.values, table.modes, table.outputs, table.degrees))
        if key in self._known:
            return self._known[key]
        degree = max(table.degrees, default=1)
        if table.dimensions > MOST_DIMENSIONS or degree > MOST_DEGREE:
            raise PrinterError(
                f"{place}, {name} is a table of {table.dimensions} inputs and degree {degree}, expected at most "
                f"{MOST_DIMENSIONS} and {MOST_DEGREE}"
            )
        self._dimensions, self._degree = max(self._dimensions, table.dimensions), max(self._degree, degree)
        which = "spline" if table.degrees else "interpolate"
        self._used |= {which, "find_interval"}
        lines = [self._array("int32_t", "starts", map(str, table.starts))]
        lines += [self._array("gnc_real", "grid", (c_constant(one, self.real) for one in table.grid))]
        lines += [self._array("gnc_real", "values", (c_constant(one, self.real) for one in table.values))]
        lines += [self._array("int32_t", "even", map(str, table.modes))]
        lines += [self._array("int32_t", "degrees", map(str, table.degrees))] if table.degrees else []
        given = "starts, grid, values, even, " + ("degrees, " if table.degrees else "")
        lines += [f"    {which}({table.dimensions}, {given}{table.outputs}, x0, y0);"]
        inputs, outputs = (Port("x0", table.dimensions),), (Port("y0", table.outputs),)
        self._known[key] = self._add(name, inputs, outputs, False, lines)
        return self._known[key]

    def _array(self, kind: str, name: str, values: object) -> str:
        entries = list(values)  # type: ignore[call-overload]
        rows = [", ".join(entries[i : i + 6]) for i in range(0, len(entries), 6)]
        body = (",\n" + " " * 8).join(rows)
        return f"    static const {kind} {name}[{len(entries)}] = {{\n{' ' * 8}{body}\n    }};"

    def _solve(self, node: ca.MX, place: str) -> Callee:
        """Print the solution of a linear system of this size and with these zeros in its matrix."""
        right, matrix = node.dep(0).sparsity(), node.dep(1).sparsity()
        n, columns = right.shape
        if n > MOST_UNKNOWNS:
            kind = "dense" if matrix.is_dense() else f"sparse ({matrix.nnz()} entries)"
            raise PrinterError(
                f"{place} solves a {kind} linear system of {n} unknowns, expected at most {MOST_UNKNOWNS}; solve it in "
                "blocks, or write its elimination in CasADi symbols"
            )
        if not right.is_dense():
            raise PrinterError(f"{place} solves a linear system with a sparse right-hand side; densify it")
        transposed = bool(node.info().get("tr", False))
        key = f"solve {n} {columns} {transposed} {matrix.row()} {matrix.colind()}"
        if key in self._known:
            return self._known[key]
        self._used.add("solve_linear")
        lines = [f"    gnc_real matrix[{n * n}];", f"    gnc_real lu[{n * n}];", f"    int32_t row[{n}];"]
        lines += ["    int32_t i;", f"    for (i = 0; i < {n * n}; ++i) {{"]
        lines += [f"        matrix[i] = {c_constant(0.0, self.real)};", "    }"]
        for k, (i, j) in enumerate(zip(matrix.row(), matrix.get_col(), strict=True)):
            lines.append(f"    matrix[{j + i * n if transposed else i + j * n}] = x1[{k}];")
        lines += [f"    for (i = 0; i < {n * columns}; ++i) {{", "        y0[i] = x0[i];", "    }"]
        lines += [f"    solve_linear({n}, {columns}, matrix, lu, row, y0, status);"]
        inputs = (Port("x0", n * columns), Port("x1", matrix.nnz()))
        self._known[key] = self._add(f"solve_{n}", inputs, (Port("y0", n * columns),), True, lines)
        return self._known[key]

    def _add(
        self, name: str, inputs: tuple[Port, ...], outputs: tuple[Port, ...], asks: bool, lines: list[str]
    ) -> Callee:
        callee = Callee(self._name(name), asks)
        self.texts.append("\n".join([declare(callee.name, inputs, outputs, asks), "{", *lines, "}", ""]))
        return callee
