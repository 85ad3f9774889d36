"""Scale conic data so that first-order solvers converge, without changing what it says.

A semidefinite block F is replaced by T F T with T diagonal, which keeps its definiteness; rows of
other blocks by positive multiples; unknown x_i by unit_i y_i. T and unit make the largest entry in
each row and column near one (Ruiz' iteration: divide by roots of the largest entries, again and again).
Solvers scale too, but may not touch single rows of a matrix; the rows are what decides here.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from casadi_gnc.errors import SynthesisError
from casadi_gnc.synthesis.conic import ConicData, Kind, from_triangle, triangle

_SWEEPS = 40
_SETTLED = 0.05  # change of a factor, in its logarithm, that ends the sweeps
#: Smallest share of a margin in the smallest row of its block, whose own entries are near one.
LEAST_MARGIN = 1e-13


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


def scale(data: ConicData, around: np.ndarray | None = None, *, middle: bool = False) -> Scaled:
    """Return scaled data.

    Parameters
    ----------
    data : in original units.
    around : (N,), a point: its entries become the units, so that a second look at a poor answer is
        scaled by what the unknowns are, not by what their coefficients suggest.
    middle : start from factors that bring all entries, not only the largest ones, as near to one as can be (in the
        mean square of their logarithms): where small coefficients decide, such as the rate of a slow mode.

    Raises
    ------
    SynthesisError
        If rounding alone would decide: a margin below the rounding of every row of its block.
    """
    count, unknowns = len(data.offset), len(data.cost)
    first, second, corners = np.arange(count), np.arange(count), count
    single = np.ones(count, dtype=bool)
    for block in data.blocks:  # one factor for each row of each matrix, besides plain rows
        if block.kind is Kind.SEMIDEFINITE:
            row, column = triangle(block.size)
            first[block.rows], second[block.rows] = corners + row, corners + column
            single[block.rows] = False
            corners += block.size
    rows, columns = np.repeat(np.arange(count), np.diff(data.matrix.indptr)), data.matrix.indices
    size, offset = np.abs(data.matrix.data), np.abs(data.offset)
    places = np.concatenate([first[rows], second[rows], first, second])
    unit = np.zeros(unknowns) if around is None else np.abs(around)
    given = bool(np.any(unit))
    unit = np.maximum(unit, 1e-6 * np.max(unit)) if given else np.ones(unknowns)
    # Constants have no unit of their own: start from those on the diagonals, the sweeps keep what is near one.
    own = np.where(first == second, offset, 0.0)
    factor = 1 / _largest(first, np.where(single, own, np.sqrt(own)), corners)
    if middle and not given:
        factor, unit = _middle(first, second, single, rows, columns, size, offset, factor, unit)
    for _ in range(_SWEEPS):
        row = factor[first] * np.where(single, 1.0, factor[second])
        now, change = size * row[rows], np.ones(1)
        if not given:
            change = np.sqrt(_largest(columns, now * unit[columns], unknowns))
            unit = unit / change
        now, still = now * unit[columns], offset * row
        root = np.sqrt(_largest(places, np.concatenate([now, now, still, still]), corners))
        factor = factor / root
        if max(np.max(np.abs(np.log(change))), np.max(np.abs(np.log(root)))) < _SETTLED:
            break
    row = factor[first] * np.where(single, 1.0, factor[second])
    if not given:
        _refuse_hopeless(data, row)
    entries = data.matrix.data * (row * data.weight)[rows] * unit[columns]
    cost = data.cost * unit
    largest = float(np.max(np.abs(cost), initial=0.0))
    price = 1 / largest if largest > 0 else 1.0
    matrix = sp.csr_matrix((entries, columns, data.matrix.indptr), shape=(count, unknowns))
    return Scaled(data, matrix, data.right * row * data.weight, price * cost, unit, row, price)


def _largest(positions: np.ndarray, values: np.ndarray, count: int) -> np.ndarray:
    found = np.zeros(count)
    np.maximum.at(found, positions, values)
    return np.where(found > 0, found, 1.0)


def _middle(
    first: np.ndarray,
    second: np.ndarray,
    single: np.ndarray,
    rows: np.ndarray,
    columns: np.ndarray,
    size: np.ndarray,
    offset: np.ndarray,
    factor: np.ndarray,
    unit: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Return factors and units with the least sum of squared logarithms of the scaled entries and constants.

    A. R. Curtis, J. K. Reid, 1972, doi:10.1093/imamat/10.1.118, for a matrix; here rows share factors.
    """
    some, still = size > 0, np.flatnonzero(offset > 0)
    row, column = rows[some], columns[some]
    places = np.concatenate([row, still])
    number, corners = np.arange(len(places)), len(factor)
    height, width = len(places), corners + len(unit)
    ones, twice = np.ones(len(places)), np.where(single[places], 0.0, 1.0)
    design = sp.csr_matrix((ones, (number, first[places])), shape=(height, width))
    design = design + sp.csr_matrix((twice, (number, second[places])), shape=(height, width))
    design = design + sp.csr_matrix((np.ones(len(row)), (number[: len(row)], corners + column)), shape=(height, width))
    wanted = -np.log(np.concatenate([size[some], offset[still]]))
    used = np.flatnonzero(np.diff(design.tocsc().indptr))
    design, found = sp.csr_matrix(design.tocsc()[:, used]), np.ones(width)
    gram = (design.T @ design).toarray() + 1e-9 * np.eye(len(used))
    found[used] = np.exp(np.clip(np.linalg.solve(gram, design.T @ wanted), -300.0, 300.0))
    return found[:corners], found[corners:]


def _refuse_hopeless(data: ConicData, row: np.ndarray) -> None:
    for block in data.blocks:
        kept = block.margin * float(np.max(row[block.rows][data.weight[block.rows] == 1]))
        if 0 < kept < LEAST_MARGIN:
            raise SynthesisError(
                f"constraint {block.name!r} is hopelessly scaled: its margin {block.margin:.1g} is {kept:.0e} of the "
                f"smallest of its rows, and below {LEAST_MARGIN:.0e} rounding decides; enlarge the margin, or choose "
                "units in which the rows are nearer to it"
            )


def tightened(scaled: Scaled, y: np.ndarray, factor: float) -> Scaled:
    """Return data that ask of each block more: factor times what it lacks, in scaled units, at a point, (N,).

    For the solver alone: its next answer then keeps what is asked, if its error is no larger than that.
    """
    right, values = scaled.right.copy(), scaled.matrix @ y + scaled.right
    for block in scaled.data.blocks:
        here, plain = values[block.rows] / scaled.data.weight[block.rows], scaled.data.weight[block.rows] == 1
        if block.kind is Kind.SEMIDEFINITE:
            least = float(np.linalg.eigvalsh(from_triangle(here, block.size))[0])
            right[block.rows] += factor * plain * min(least, 0.0)
        elif block.kind is Kind.NONNEGATIVE:
            right[block.rows] += factor * min(float(np.min(here)), 0.0)
    return replace(scaled, right=right)
