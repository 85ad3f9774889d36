"""Constraints in CasADi symbols to conic data: affine, symmetric, finite, or a sentence why not.

The coefficients are the Jacobian by the scalar unknowns, which must be constant, and the constant
term is the value at zero. Nothing else is needed: an affine map is its Jacobian and its value at 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
import scipy.sparse as sp

from casadi_gnc.errors import SynthesisError
from casadi_gnc.synthesis.conic import Block, ConicData, Kind

_ORDER = {Kind.EQUAL: 0, Kind.NONNEGATIVE: 1, Kind.SEMIDEFINITE: 2}
_ROUNDING = 1e-11  # of the largest coefficient: how far mirrored entries may differ by rounding


@dataclass(frozen=True, eq=False)
class Constraint:
    """Hold a constraint in symbols: the expression less the margin lies in the cone of the kind."""

    name: str
    kind: Kind
    expression: ca.SX
    margin: float


def extract(unknowns: ca.SX, constraints: Sequence[Constraint], objective: ca.SX) -> ConicData:
    """Return the conic data of constraints.

    Parameters
    ----------
    unknowns : (N,), SX, all scalar unknowns.
    constraints : in any order.
    objective : scalar SX, minimised.

    Raises
    ------
    SynthesisError
        For an expression that is not affine, not symmetric, not finite, or holds foreign symbols.
    """
    ordered = sorted(constraints, key=lambda constraint: _ORDER[constraint.kind])
    parts = [ca.densify(constraint.expression) for constraint in ordered]
    stacked = ca.vertcat(*[ca.vec(part) for part in parts], objective)
    jacobian = ca.jacobian(stacked, unknowns)
    _no_foreign(stacked, unknowns, ordered, objective)
    if not jacobian.is_constant():
        _refuse_nonlinear(jacobian, unknowns, ordered, stacked)
    coefficients: Any = sp.csr_matrix(ca.evalf(jacobian).sparse())
    constants = np.array(ca.evalf(ca.substitute(stacked, unknowns, ca.SX.zeros(*unknowns.shape)))).ravel()
    labels = tuple(str(unknowns[i]) for i in range(unknowns.numel()))
    blocks, picked, first, start = [], [], 0, 0
    for constraint, part in zip(ordered, parts, strict=True):
        rows = np.arange(first, first + part.numel())
        _finite(constraint.name, coefficients[rows], constants[rows])
        size = part.numel()
        if constraint.kind is Kind.SEMIDEFINITE:
            size = part.shape[0]
            lower, upper = _triangles(rows, size)
            _symmetric(constraint.name, coefficients, constants, lower, upper, size, labels)
            rows = lower
        block = Block(constraint.name, constraint.kind, size, start, constraint.margin)
        blocks.append(block)
        picked.append(rows)
        first, start = first + part.numel(), start + block.count
    _finite("objective", coefficients[[first]], constants[[first]])
    chosen = np.concatenate(picked).astype(int)
    cost = np.asarray(coefficients[[first]].todense()).ravel()
    return ConicData(tuple(blocks), coefficients[chosen], constants[chosen], cost, float(constants[first]), labels)


def _triangles(rows: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows of the lower triangle, row by row, and of its mirror image (column-major)."""
    row, column = np.tril_indices(size)
    return rows[row + size * column], rows[column + size * row]


def _place(row: int, ordered: Sequence[Constraint]) -> tuple[str, str]:
    """Return the sentence's subject and the entry for a stacked row."""
    for constraint in ordered:
        count = constraint.expression.numel()
        if row < count:
            return f"constraint {constraint.name!r}", f"entry ({row % constraint.expression.shape[0]}, " + (
                f"{row // constraint.expression.shape[0]})"
            )
        row -= count
    return "the objective", "it"


def _refuse_nonlinear(jacobian: ca.SX, unknowns: ca.SX, ordered: Sequence[Constraint], stacked: ca.SX) -> None:
    rows, columns = jacobian.sparsity().get_triplet()
    for k in range(jacobian.nnz()):
        entry = jacobian.nz[k]
        if entry.is_constant():
            continue
        where, what = _place(rows[k], ordered)
        one, others = str(unknowns[columns[k]]), [str(symbol) for symbol in ca.symvar(entry)]
        text = str(stacked[rows[k]])
        text = text if len(text) <= 120 else text[:117] + "..."
        raise SynthesisError(
            f"{where} is not affine: {what} multiplies {one} by {' and '.join(others)}, in {text}; "
            "substitute a product of unknowns (W = K X) or fix one factor and bisect on it"
        )


def _no_foreign(stacked: ca.SX, unknowns: ca.SX, ordered: Sequence[Constraint], objective: ca.SX) -> None:
    known = {symbol.element_hash() for symbol in ca.symvar(unknowns)}
    if all(symbol.element_hash() in known for symbol in ca.symvar(stacked)):
        return
    for name, expression in [
        *[(f"constraint {c.name!r}", c.expression) for c in ordered],
        ("the objective", objective),
    ]:
        foreign = [str(s) for s in ca.symvar(expression) if s.element_hash() not in known]
        if foreign:
            raise SynthesisError(
                f"{name} holds {', '.join(foreign)}, which no unknown of this set declares; "
                "declare it as an unknown, or put a number in its place"
            )


def _finite(name: str, coefficients: Any, constants: np.ndarray) -> None:
    if not (np.all(np.isfinite(coefficients.data)) and np.all(np.isfinite(constants))):
        raise SynthesisError(f"constraint {name!r} holds a number that is not finite; check the data it is built from")


def _symmetric(
    name: str,
    coefficients: Any,
    constants: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    size: int,
    labels: tuple[str, ...],
) -> None:
    """Refuse a matrix whose mirrored entries differ by more than rounding."""
    largest = max(abs(coefficients[lower]).max(), np.max(np.abs(constants[lower]), initial=0.0))
    difference = abs(coefficients[lower] - coefficients[upper]).tocoo()
    offsets = np.abs(constants[lower] - constants[upper])
    row, column = np.tril_indices(size)
    if difference.nnz and difference.data.max() > _ROUNDING * largest:
        worst = int(np.argmax(difference.data))
        entry, term = difference.row[worst], f"in the coefficient of {labels[difference.col[worst]]}"
    elif offsets.max(initial=0.0) > _ROUNDING * largest:
        entry, term = int(np.argmax(offsets)), "in the constant term"
    else:
        return
    raise SynthesisError(
        f"constraint {name!r} is not symmetric: entries ({row[entry]}, {column[entry]}) and "
        f"({column[entry]}, {row[entry]}) differ {term}; write B @ W + (B @ W).T, "
        "or give blocks above the diagonal to block_matrix"
    )
