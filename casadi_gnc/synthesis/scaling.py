"""Scale conic data so that first-order solvers converge, without changing what it says.

A semidefinite block F is replaced by T F T with T diagonal, which keeps its definiteness; rows of
other blocks by positive multiples; unknown x_i by unit_i y_i. T and unit make the largest entry in
each row and column near one (Ruiz' iteration: divide by roots of the largest entries, again and again).
Solvers scale too, but may not touch single rows of a matrix; the rows are what decides here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from casadi_gnc.errors import SynthesisError
from casadi_gnc.synthesis.conic import ConicData, Kind

_SWEEPS = 12
_SPREAD = 1e14  # coefficients of a row further apart than this vanish in rounding


@dataclass(frozen=True, eq=False)
class Scaled:
    """Hold scaled conic data: minimise cost'y subject to matrix y + right in K.

    Parameters
    ----------
    data : the data in original units.
    matrix, right : (M, N) and (M,); triangles carry the weight sqrt(2) off the diagonal.
    cost : (N,), largest entry 1, or zero.
    unit : (N,), unknown i in original units is unit_i y_i.
    row : (M,), a row of the scaled data is row_i times the original one, weights apart.
    price : the scaled cost is price times the original one.
    """

    data: ConicData
    matrix: sp.csr_matrix
    right: np.ndarray
    cost: np.ndarray
    unit: np.ndarray
    row: np.ndarray
    price: float

    def original(self, y: np.ndarray) -> np.ndarray:
        """Return unknowns in original units."""
        return self.unit * y

    def original_dual(self, z: np.ndarray) -> np.ndarray:
        """Return multipliers, (M,), as triangles without weights, for the original data."""
        return self.row * z / self.data.weight / self.price


def _largest(positions: np.ndarray, values: np.ndarray, count: int) -> np.ndarray:
    found = np.zeros(count)
    np.maximum.at(found, positions, values)
    return np.where(found > 0, found, 1.0)


def scale(data: ConicData, around: np.ndarray | None = None) -> Scaled:
    """Return scaled data.

    Parameters
    ----------
    data : in original units.
    around : (N,), a point: its entries become the units, so that a second look at a poor answer is
        scaled by what the unknowns are, not by what their coefficients suggest.

    Raises
    ------
    SynthesisError
        If rounding alone would decide: a margin lost in the size of its block, or coefficients of
        one block more than fourteen digits apart after scaling.
    """
    count, unknowns = len(data.offset), len(data.cost)
    entries = sp.coo_matrix(data.matrix)
    size, first, second = np.abs(entries.data), np.arange(count), np.arange(count)
    corners = count  # one factor for each row of each matrix, besides plain rows
    for block in data.blocks:
        if block.kind is Kind.SEMIDEFINITE:
            row, column = np.tril_indices(block.size)
            first[block.rows], second[block.rows] = corners + row, corners + column
            corners += block.size
    factor, unit = np.ones(corners), np.ones(unknowns)
    if around is not None and not np.any(around):
        around = None
    if around is not None:
        unit = np.maximum(np.abs(around), 1e-6 * float(np.max(np.abs(around))))
    offset = np.abs(data.offset)
    single = np.zeros(count, dtype=bool)
    for block in data.blocks:
        single[block.rows] = block.kind is not Kind.SEMIDEFINITE
    # Constants have no unit of their own: start from those on the diagonals, the sweeps keep what is near one.
    own = np.where(first == second, offset, 0.0)
    factor = 1 / _largest(first, np.where(single, own, np.sqrt(own)), corners)
    for _ in range(_SWEEPS):
        row = np.where(single, factor[first], factor[first] * factor[second])
        if around is None:
            unit = unit / np.sqrt(_largest(entries.col, size * row[entries.row] * unit[entries.col], unknowns))
        now, still = size * row[entries.row] * unit[entries.col], offset * row
        both = np.concatenate([now, now, still, still])
        places = np.concatenate([first[entries.row], second[entries.row], first, second])
        factor = factor / np.sqrt(_largest(places, both, corners))
    row = np.where(single, factor[first], factor[first] * factor[second])
    matrix = sp.csr_matrix(
        (entries.data * (row * data.weight)[entries.row] * unit[entries.col], (entries.row, entries.col)),
        shape=(count, unknowns),
    )
    cost = data.cost * unit
    largest = float(np.max(np.abs(cost), initial=0.0))
    price = 1 / largest if largest > 0 else 1.0
    scaled = Scaled(data, matrix, data.right * row * data.weight, price * cost, unit, row, price)
    if around is None:
        _refuse_hopeless(scaled)
    return scaled


def _refuse_hopeless(scaled: Scaled) -> None:
    data = scaled.data
    for block in data.blocks:
        rows = scaled.matrix[block.rows]
        sizes = np.abs(rows.data[rows.data != 0])
        if len(sizes) and sizes.max() > _SPREAD * sizes.min():
            raise SynthesisError(
                f"constraint {block.name!r} is hopelessly scaled: after equilibration its coefficients still "
                f"reach from {sizes.min():.1g} to {sizes.max():.1g}; choose units that bring the data nearer to one"
            )
        entries = max(
            np.max(np.abs(data.matrix[block.rows].data), initial=0.0),
            np.max(np.abs(data.offset[block.rows]), initial=0),
        )
        row = scaled.row[block.rows][scaled.data.weight[block.rows] == 1]
        if block.margin > 0 and block.margin * row.max(initial=0.0) < 1e-13:
            raise SynthesisError(
                f"constraint {block.name!r} is hopelessly scaled: its margin {block.margin:.1g} is lost in "
                f"coefficients of size {entries:.1g}; choose units nearer to the data, or a larger margin"
            )
