"""Quadratic programs of CasADi that the on-board allocator solves: bounds alone, and a matrix that never changes.

    minimise x'Hx/2 + g'x   with   lower <= x <= upper,   H = diag(d) + B'B,   d > 0,   B with at most six rows

Gradient and bounds may be anything at run time. What is printed asks the allocator for the way from the minimum without
bounds to the answer, so that its certificate is relative to how far bounds keep the cost above that minimum.
"""

from __future__ import annotations

from itertools import chain

import casadi as ca
import numpy as np

from casadi_gnc.allocation.online import LARGEST
from casadi_gnc.embedded.pieces import Piece
from casadi_gnc.embedded.programs import Port
from casadi_gnc.embedded.scalars import Math, Real, c_constant
from casadi_gnc.errors import PrinterError
from casadi_gnc.mathematics.low_rank import inverse, least_eigenvalue, split
from casadi_gnc.system.templates import template

#: Ports of CasADi's conic: matrix, constraints, their cones.
_H, _A, _CONES = 0, 2, 10


def quadratic_piece(tape: ca.Function, k: int, place: str, maths: Math, real: Real, package: str) -> Piece:
    """Return the piece of a quadratic program, instruction `k` of a tape.

    Parameters
    ----------
    place : where it is called, for messages.
    package : prefix of the package's symbols.

    Raises
    ------
    PrinterError
        Where it has not the allocator's form: what it has instead, and what to do.
    """
    node = tape.instruction_MX(k)
    called = node.which_function()
    place = f"{place}, {called.name()}"
    count, most = node.dep(1).nnz(), LARGEST[0]
    if node.dep(_CONES).numel():
        raise PrinterError(f"{place} has cones, which the on-board solver does not take; solve it on the ground")
    if rows := node.dep(_A).size1():
        raise PrinterError(
            f"{place} is a quadratic program with {rows} linear constraints, expected bounds on x alone (lbx, ubx), "
            "which the on-board solver takes; put them into the cost as weighted squares, or pass what it gives"
        )
    if not 1 <= count <= most:
        raise PrinterError(f"{place} is a quadratic program of {count} unknowns, expected 1 to {most}")
    matrix = _constant(tape, node.dep(_H), place)
    found = split(matrix, LARGEST[1])
    if found is None:
        raise PrinterError(
            f"{place} is a quadratic program of {count} unknowns whose matrix is {_fault(matrix)}, expected a positive "
            f"diagonal and at most {LARGEST[1]} squares of sums, H = diag(d) + B'B, which the on-board solver takes; "
            "leave out the least of the squares, or pass what the program gives"
        )
    diagonal, rows_of_b = found
    rows_of_b = rows_of_b or [[0.0] * count]
    tables = {"d": diagonal, "b": list(chain(*rows_of_b)), "inverse": list(chain(*inverse(matrix)))}
    sizes = count, len(rows_of_b)
    text = template("quadratic_program.c.j2").render(
        tables={key: [c_constant(value, real) for value in values] for key, values in tables.items()},
        n=count,
        r=sizes[1],
        prefix=solver_name(package, sizes),
        NAME=package.upper(),
        zero=c_constant(0.0, real),
        half=c_constant(0.5, real),
        one=c_constant(1.0, real),
        margin=c_constant(1.001, real),
        least=c_constant(least_eigenvalue(matrix), real),
        sqrt=f"{'gnc_' if maths == 'gnc' else ''}sqrt{'f' if real == 'float' else ''}",
    )
    inputs = tuple(Port(f"x{i}", count) for i in range(3))
    outputs = (Port("y0", count), Port("y1", 1), Port("y2", 0), Port("y3", count))
    return Piece(called.name(), inputs, outputs, tuple(text.splitlines()), (), asks=True, solver=sizes)


def solver_name(package: str, sizes: tuple[int, int]) -> str:
    """Return the prefix of the solver of this many unknowns and squares."""
    return f"{package}_{sizes[0]}x{sizes[1]}"


def _constant(tape: ca.Function, matrix: ca.MX, place: str) -> list[list[float]]:
    """Return the numbers of a matrix of a tape that depends on no input."""
    alone = ca.Function("matrix", tape.mx_in(), [ca.densify(matrix)])
    symbols, known = tape.sx_in(), False
    try:
        found = alone.expand().call(symbols)[0]
        known = not ca.depends_on(found, ca.veccat(*symbols))
    except RuntimeError:  # something in it is no scalar
        pass
    if not known:
        raise PrinterError(
            f"{place} is a quadratic program whose matrix changes at run time, expected constants, which the on-board "
            "solver takes; let what varies enter its linear part and its bounds"
        )
    values = np.array(alone.call([np.zeros(one.shape) for one in symbols])[0], dtype=float)
    if not np.isfinite(values).all():
        raise PrinterError(f"{place} is a quadratic program whose matrix has entries that are no numbers")
    if not np.abs(values - values.T).max() <= 1e-14 * np.abs(values).max():
        raise PrinterError(f"{place} is a quadratic program whose matrix is not symmetric; give (H + H') / 2")
    return [[0.5 * (float(values[i, j]) + float(values[j, i])) for j in range(len(values))] for i in range(len(values))]


def _fault(matrix: list[list[float]]) -> str:
    return "of another form" if least_eigenvalue(matrix) > 0.0 else "not positive definite"
