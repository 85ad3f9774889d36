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
from casadi_gnc.synthesis.conic import Block, ConicData, Kind, triangle

_ORDER = {Kind.EQUAL: 0, Kind.NONNEGATIVE: 1, Kind.SEMIDEFINITE: 2}
_ROUNDING = 1e-11  # of the largest coefficient: how far mirrored entries may differ by rounding
_AT_ONCE = 64  # columns of the Jacobian that are evaluated together
_TEXT = 160  # characters of a term that a message prints


@dataclass(frozen=True, eq=False)
class Constraint:
    """Hold a constraint in symbols: the expression less the margin lies in the cone of the kind."""

    name: str
    kind: Kind
    expression: ca.SX
    margin: float


def extract(unknowns: ca.SX, labels: tuple[str, ...], constraints: Sequence[Constraint], objective: ca.SX) -> ConicData:
    """Return the conic data of constraints.

    Parameters
    ----------
    unknowns : (N,), SX, all scalar unknowns. labels : (N,), their names.
    constraints : in any order.
    objective : scalar SX, minimised.

    Raises
    ------
    SynthesisError
        For an expression that is not affine, not symmetric, not finite, or holds foreign symbols.
    """
    ordered = sorted(constraints, key=lambda constraint: _ORDER[constraint.kind])
    stacked = ca.vertcat(*[ca.vec(ca.densify(constraint.expression)) for constraint in ordered], objective)
    at_zero = ca.substitute(stacked, unknowns, ca.DM.zeros(*unknowns.shape))
    entries: Any = _slopes(stacked, unknowns)
    if entries is None or not at_zero.is_constant():
        jacobian = ca.jacobian(stacked, unknowns)
        if not (jacobian.is_constant() and at_zero.is_constant()):
            _refuse_foreign(unknowns, ordered, objective)
            _refuse_nonlinear(jacobian, unknowns, ordered, stacked)
        entries = ca.evalf(jacobian).sparse().tocoo()
    constants = np.array(ca.evalf(at_zero)).ravel()
    if not (np.all(np.isfinite(entries.data)) and np.all(np.isfinite(constants))):
        _refuse_infinite(entries, constants, ordered)
    blocks, chosen, mirrored, first, start = [], [], [], 0, 0
    for constraint in ordered:
        count = size = constraint.expression.numel()
        row = column = np.arange(count)
        if constraint.kind is Kind.SEMIDEFINITE:
            size = constraint.expression.shape[0]
            i, j = triangle(size)
            row, column = i + size * j, j + size * i  # column-major, as `vec` stacks
        block = Block(constraint.name, constraint.kind, size, start, constraint.margin)
        blocks.append(block)
        chosen.append(first + row)
        mirrored.append(first + column)
        first, start = first + count, start + block.count
    lower, upper = np.concatenate(chosen), np.concatenate(mirrored)
    matrix, mirror = _rows(entries, lower), _rows(entries, upper)
    _symmetric(blocks, matrix, mirror, constants[lower], constants[upper], labels)
    cost = _rows(entries, np.array([first])).toarray()[0]
    return ConicData(tuple(blocks), matrix, constants[lower], cost, float(constants[first]), labels)


def _slopes(stacked: ca.SX, unknowns: ca.SX) -> sp.coo_matrix | None:
    """Return the Jacobian of an affine map, column by column: the derivative along one unknown after another.

    None where it cannot be told from these that the map is affine, or where an entry is not finite. `ca.jacobian` would
    build an expression for each entry; this one is built once, and evaluated.
    """
    along = ca.SX.sym("along", *unknowns.shape)
    derivative = ca.jtimes(stacked, unknowns, along)
    known = {symbol.element_hash() for symbol in ca.symvar(along)}
    if any(symbol.element_hash() not in known for symbol in ca.symvar(derivative)):
        return None
    count = unknowns.numel()
    evaluated, parts = ca.Function("derivative", [along], [ca.densify(derivative)]), []
    for first in range(0, count, _AT_ONCE):
        chosen = np.arange(first, min(first + _AT_ONCE, count))
        units = np.zeros((count, len(chosen)))
        units[chosen, np.arange(len(chosen))] = 1.0
        columns = np.asarray(evaluated(units))
        if not np.all(np.isfinite(columns)):
            return None
        part = sp.coo_matrix(columns)
        parts.append((part.data, part.row, chosen[part.col]))
    data, row, column = (np.concatenate(each) for each in zip(*parts, strict=True))
    return sp.coo_matrix((data, (row, column)), shape=(stacked.numel(), count))


def _rows(entries: Any, rows: np.ndarray) -> sp.csr_matrix:
    """Return some rows of a matrix in triplets, each asked for once."""
    place = np.full(entries.shape[0], -1)
    place[rows] = np.arange(len(rows))
    moved = place[entries.row]
    kept = moved >= 0
    return sp.csr_matrix((entries.data[kept], (moved[kept], entries.col[kept])), shape=(len(rows), entries.shape[1]))


def _place(row: int, ordered: Sequence[Constraint]) -> tuple[str, str]:
    """Return the sentence's subject and the entry for a stacked row."""
    for constraint in ordered:
        count, height = constraint.expression.numel(), constraint.expression.shape[0]
        if row < count:
            return f"constraint {constraint.name!r}", f"entry ({row % height}, {row // height})"
        row -= count
    return "the objective", "it"


def _refuse_foreign(unknowns: ca.SX, ordered: Sequence[Constraint], objective: ca.SX) -> None:
    known = {symbol.element_hash() for symbol in ca.symvar(unknowns)}
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


def _refuse_nonlinear(jacobian: ca.SX, unknowns: ca.SX, ordered: Sequence[Constraint], stacked: ca.SX) -> None:
    rows, _ = jacobian.sparsity().get_triplet()
    entry = next(rows[k] for k in range(jacobian.nnz()) if not jacobian.nz[k].is_constant())
    where, what = _place(entry, ordered)
    for term in _terms(stacked[entry]):
        slope = ca.jacobian(term, unknowns)
        if slope.is_constant():
            continue
        k = next(k for k in range(slope.nnz()) if not slope.nz[k].is_constant())
        one = str(unknowns[slope.sparsity().get_triplet()[1][k]])
        others = " and ".join(str(symbol) for symbol in ca.symvar(slope.nz[k]))
        text = str(term) if len(str(term)) <= _TEXT else str(term)[: _TEXT - 3] + "..."
        raise SynthesisError(
            f"{where} is not affine: {what} holds the term {text}, whose slope by {one} depends on {others}; "
            "substitute a product of unknowns (W = K X) or fix one factor and bisect on it"
        )


def _terms(expression: ca.SX) -> list[ca.SX]:
    """Return the terms of a scalar sum, in order."""
    terms, waiting = [], [expression]
    while waiting:
        one = waiting.pop()
        if one.is_op(ca.OP_ADD) or one.is_op(ca.OP_SUB):
            waiting += [one.dep(1), one.dep(0)]
        elif one.is_op(ca.OP_NEG):
            waiting.append(one.dep(0))
        else:
            terms.append(one)
    return terms


def _refuse_infinite(entries: Any, constants: np.ndarray, ordered: Sequence[Constraint]) -> None:
    bad = np.concatenate([np.flatnonzero(~np.isfinite(constants)), entries.row[~np.isfinite(entries.data)]])
    where, what = _place(int(bad.min()), ordered)
    raise SynthesisError(f"{where}: {what} holds a number that is not finite; check the data it is built from")


def _symmetric(
    blocks: Sequence[Block],
    lower: sp.csr_matrix,
    upper: sp.csr_matrix,
    constant: np.ndarray,
    mirrored: np.ndarray,
    labels: tuple[str, ...],
) -> None:
    """Refuse a matrix whose mirrored entries differ by more than rounding."""
    offsets, difference = np.abs(constant - mirrored), abs(lower - upper)
    if not (np.any(offsets) or np.any(difference.data)):
        return
    for block in blocks:
        largest = max(abs(lower[block.rows]).max(), np.max(np.abs(constant[block.rows]), initial=0.0))
        slopes, offset = difference[block.rows].tocoo(), offsets[block.rows]
        if slopes.nnz and slopes.data.max() > _ROUNDING * largest:
            worst = int(np.argmax(slopes.data))
            entry, term = slopes.row[worst], f"in the coefficient of {labels[slopes.col[worst]]}"
        elif offset.max() > _ROUNDING * largest:
            entry, term = int(np.argmax(offset)), "in the constant term"
        else:
            continue
        row, column = (int(index[entry]) for index in triangle(block.size))
        raise SynthesisError(
            f"constraint {block.name!r} is not symmetric: entries ({row}, {column}) and ({column}, {row}) differ "
            f"{term}; write B @ W + (B @ W).T, or give blocks above the diagonal to block_matrix"
        )
