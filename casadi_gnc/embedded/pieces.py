"""The C functions of nodes that are no scalars and call nothing: tables, searches, picked elements, linear systems.

Each is a few lines that hand constants and arguments to a helper of codegen/templates/function_parts.c.j2.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import casadi as ca

from casadi_gnc.embedded.programs import Port
from casadi_gnc.embedded.scalars import Real, c_constant
from casadi_gnc.embedded.tables import Table, read_table, search_mode
from casadi_gnc.errors import PrinterError

#: Largest linear system that is solved on board.
MOST_UNKNOWNS = 32
#: Most inputs of a table, and most degree of a spline.
MOST_DIMENSIONS, MOST_DEGREE = 6, 7


@dataclass(frozen=True)
class Piece:
    """Hold the body of a C function; two with the same text are one.

    Parameters
    ----------
    name : wanted in C.
    inputs, outputs : its arguments, nonzeros only.
    lines : the body.
    helpers : what of the template it calls.
    asks : whether the last argument is the status.
    dimensions, degree : of the table, for which the helper has room.
    solver : unknowns and squares of the on-board solver that it calls.
    """

    name: str
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    lines: tuple[str, ...]
    helpers: tuple[str, ...]
    asks: bool = False
    dimensions: int = 1
    degree: int = 1
    solver: tuple[int, int] | None = None

    @property
    def text(self) -> tuple[object, ...]:
        """What makes it another piece than another one: all but the name."""
        return self.inputs, self.outputs, self.lines


def node_piece(node: ca.MX, place: str, real: Real) -> Piece:
    """Return the piece of a node of a tape that is no call: a spline, a search, picked elements, a linear system.

    Raises
    ------
    PrinterError
        For what is too large, and for tables that are no constants.
    """
    code = node.op()
    if code == ca.OP_BSPLINE:
        point = ca.MX.sym("x", node.dep(0).sparsity())
        alone = ca.Function("spline", [point], ca.graph_substitute([node], [node.dep(0)], [point]))
        return table_piece(read_table(alone, f"{place}, a spline"), "spline", place, real)
    if code == ca.OP_LOW:
        return _search(node)
    if code == ca.OP_GETNONZEROS_PARAM:
        return _pick(node, real)
    return _solve(node, place, real)


def table_piece(table: Table, name: str, place: str, real: Real) -> Piece:
    """Return the piece of an interpolant, of its slopes, or of a spline."""
    degree = max(table.degrees, default=1)
    if table.dimensions > MOST_DIMENSIONS or degree > MOST_DEGREE:
        raise PrinterError(
            f"{place}, {name} is a table of {table.dimensions} inputs and degree {degree}, expected at most "
            f"{MOST_DIMENSIONS} and {MOST_DEGREE}"
        )
    helper = "spline" if table.degrees else "interpolate_slopes" if table.slopes else "interpolate"
    lines = [_array("int32_t", "starts", map(str, table.starts))]
    lines += [_array("gnc_real", "grid", (c_constant(one, real) for one in table.grid))]
    lines += [_array("gnc_real", "values", (c_constant(one, real) for one in table.values))]
    lines += [_array("int32_t", "even", map(str, table.modes))]
    lines += [_array("int32_t", "degrees", map(str, table.degrees))] if table.degrees else []
    given = "starts, grid, values, even, degrees" if table.degrees else "starts, grid, values, even"
    inputs, results = [Port("x0", table.dimensions)], "y0"
    outputs = (Port("y0", table.outputs),)
    if table.slopes:  # CasADi hands the result of the table to what computes its slopes, which do not need it
        inputs.append(Port("x1", 0))
        outputs = (Port("y0", table.outputs * table.dimensions),)
        lines += [f"    gnc_real value[{table.outputs}];", "    (void)x1;"]
        results = "value, y0"
    lines += [f"    {helper}({table.dimensions}, {given}, {table.outputs}, x0, {results});"]
    helpers = ("find_interval", *(["find_cell"] if not table.degrees else []), helper)
    return Piece(name, tuple(inputs), outputs, tuple(lines), helpers, False, table.dimensions, degree)


def _array(kind: str, name: str, values: Iterable[str]) -> str:
    entries = list(values)
    rows = [", ".join(entries[i : i + 6]) for i in range(0, len(entries), 6)]
    body = (",\n" + " " * 8).join(rows)
    return f"    static const {kind} {name}[{len(entries)}] = {{\n{' ' * 8}{body}\n    }};"


def _search(node: ca.MX) -> Piece:
    """Return the search of the interval of a grid in which each of some numbers lies."""
    grid, points = node.dep(0).nnz(), node.dep(1).nnz()
    lines = ["    int32_t k;", f"    for (k = 0; k < {points}; ++k) {{"]
    lines += [f"        y0[k] = (gnc_real)find_interval(x1[k], x0, {grid}, {search_mode(node)});", "    }"]
    inputs = (Port("x0", grid), Port("x1", points))
    return Piece("search", inputs, (Port("y0", points),), tuple(lines), ("find_interval",))


def _pick(node: ca.MX, real: Real) -> Piece:
    """Return the copy of elements at computed places: each sum of one of the outer and one of the inner places."""
    about, sizes = node.info(), [node.dep(i).nnz() for i in range(node.n_dep())]
    inputs = tuple(Port(f"x{i}", size) for i, size in enumerate(sizes))
    zero = c_constant(0.0, real)

    def slice_of(which: str) -> tuple[int, str]:
        found = about[which]
        count = len(range(found["start"], found["stop"], found["step"]))
        return count, f"(gnc_real)({found['start']} + ({{}} * {found['step']}))"

    if "inner" in about:
        (inner, inside), outer, outside = slice_of("inner"), sizes[1], "x1[{}]"
    elif "outer" in about:
        (outer, outside), inner, inside = slice_of("outer"), sizes[1], "x1[{}]"
    elif node.n_dep() == 3:
        inner, inside, outer, outside = sizes[1], "x1[{}]", sizes[2], "x2[{}]"
    else:
        inner, inside, outer, outside = 1, zero, sizes[1], "x1[{}]"
    lines = ["    int32_t i;", "    int32_t j;", f"    for (j = 0; j < {outer}; ++j) {{"]
    lines += [f"        for (i = 0; i < {inner}; ++i) {{"]
    lines += [f"            y0[i + (j * {inner})] = pick(x0, {sizes[0]}, {outside.format('j')}, {inside.format('i')});"]
    lines += ["        }", "    }"]
    return Piece("pick", inputs, (Port("y0", inner * outer),), tuple(lines), ("pick",))


def _solve(node: ca.MX, place: str, real: Real) -> Piece:
    """Return the solution of a linear system of this size and with these zeros in its matrix."""
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
    lines = [f"    gnc_real matrix[{n * n}];", f"    gnc_real lu[{n * n}];", f"    int32_t row[{n}];"]
    lines += ["    int32_t i;", f"    for (i = 0; i < {n * n}; ++i) {{"]
    lines += [f"        matrix[i] = {c_constant(0.0, real)};", "    }"]
    for k, (i, j) in enumerate(zip(matrix.row(), matrix.get_col(), strict=True)):
        lines.append(f"    matrix[{j + i * n if transposed else i + j * n}] = x1[{k}];")
    lines += [f"    for (i = 0; i < {n * columns}; ++i) {{", "        y0[i] = x0[i];", "    }"]
    lines += [f"    solve_linear({n}, {columns}, matrix, lu, row, y0, status);"]
    inputs = (Port("x0", n * columns), Port("x1", matrix.nnz()))
    return Piece(f"solve_{n}", inputs, (Port("y0", n * columns),), tuple(lines), ("solve_linear",), asks=True)
