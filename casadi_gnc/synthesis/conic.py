"""What a solver needs of a set of LMIs: an affine map into a product of cones, block by block.

    minimise  cost'x + constant   subject to   matrix x + offset - margin  in  K

K is a product of {0} (equalities), the non-negative half-lines and the cones of positive
semidefinite matrices, in this order. A symmetric matrix of size m is stored by its lower triangle,
row by row, m(m+1)/2 rows; `ConicData.weight` holds sqrt(2) for entries off the diagonal, so that
weight * triangle keeps the inner product of matrices.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property, lru_cache

import numpy as np
import scipy.sparse as sp


class Kind(Enum):
    """What a constraint asks of its expression."""

    EQUAL = "is zero"
    NONNEGATIVE = "is not negative, element by element"
    SEMIDEFINITE = "is positive semidefinite"


@dataclass(frozen=True)
class Block:
    """Hold where a constraint lies among the rows.

    Parameters
    ----------
    name : the constraint's, for the reader.
    kind : its cone.
    size : rows of the matrix (semidefinite), or number of elements.
    start : first row.
    margin : what is kept from the boundary of the cone, in the unit of the expression, at least 0.
    """

    name: str
    kind: Kind
    size: int
    start: int
    margin: float = 0.0

    @property
    def count(self) -> int:
        """Return the number of rows."""
        return triangle_count(self.size) if self.kind is Kind.SEMIDEFINITE else self.size

    @property
    def rows(self) -> slice:
        """Return the rows."""
        return slice(self.start, self.start + self.count)


@dataclass(frozen=True, eq=False)
class ConicData:
    """Hold an affine map into a product of cones; see the top of the module.

    Parameters
    ----------
    blocks : constraints, sorted by kind, without gaps.
    matrix : (M, N), sparse.
    offset : (M,).
    cost : (N,).
    constant : of the objective.
    labels : (N,), names of the scalar unknowns, such as ``X[1,0]``.
    """

    blocks: tuple[Block, ...]
    matrix: sp.csr_matrix
    offset: np.ndarray
    cost: np.ndarray
    constant: float
    labels: tuple[str, ...]

    @cached_property
    def weight(self) -> np.ndarray:
        """Return (M,): sqrt(2) for entries off the diagonal of a semidefinite block, else 1."""
        weight = np.ones(len(self.offset))
        for block in self.blocks:
            if block.kind is Kind.SEMIDEFINITE:
                row, column = triangle(block.size)
                weight[block.rows] = np.where(row == column, 1.0, np.sqrt(2.0))
        return weight

    @cached_property
    def right(self) -> np.ndarray:
        """Return (M,): the offset less the margins."""
        right = self.offset.copy()
        for block in self.blocks:
            if block.kind is Kind.SEMIDEFINITE:
                row, column = triangle(block.size)
                right[block.rows] -= block.margin * (row == column)
            else:
                right[block.rows] -= block.margin
        return right

    @property
    def names(self) -> list[str]:
        """Return the name of the unknown that each scalar unknown belongs to, (N,)."""
        return [label.split("[")[0] for label in self.labels]

    def towards(self, other: ConicData, share: float) -> ConicData:
        """Return these data plus a share of the way to others of the same constraints: what is affine in a number."""
        return replace(
            self,
            matrix=(self.matrix + share * (other.matrix - self.matrix)).tocsr(),
            offset=self.offset + share * (other.offset - self.offset),
        )

    def without(self, names: set[str]) -> ConicData:
        """Return the data without some constraints."""
        kept = [block for block in self.blocks if block.name not in names]
        rows = np.concatenate([np.arange(*block.rows.indices(len(self.offset))) for block in kept] or [[]]).astype(int)
        moved, start = [], 0
        for block in kept:
            moved.append(replace(block, start=start))
            start += block.count
        return replace(self, blocks=tuple(moved), matrix=self.matrix[rows], offset=self.offset[rows])


@lru_cache(maxsize=64)
def triangle(size: int) -> tuple[np.ndarray, np.ndarray]:
    """Return rows and columns of the entries of a lower triangle, row by row; do not write to them."""
    return np.tril_indices(size)


def triangle_count(size: int) -> int:
    """Return the number of entries of a triangle."""
    return size * (size + 1) // 2


def from_triangle(entries: np.ndarray, size: int) -> np.ndarray:
    """Return the symmetric matrix, (size, size), of a lower triangle row by row."""
    matrix = np.zeros((size, size))
    row, column = triangle(size)
    matrix[row, column] = matrix[column, row] = entries
    return matrix


def to_triangle(matrix: np.ndarray) -> np.ndarray:
    """Return the lower triangle, row by row, of a symmetric matrix."""
    return matrix[triangle(len(matrix))]


def into_cone(data: ConicData, dual: np.ndarray) -> np.ndarray:
    """Return the nearest point of the dual cone, (M,), in triangles without weights."""
    nearest = np.array(dual, dtype=float)
    for block in data.blocks:
        if block.kind is Kind.NONNEGATIVE:
            nearest[block.rows] = np.maximum(nearest[block.rows], 0.0)
        elif block.kind is Kind.SEMIDEFINITE:
            values, vectors = np.linalg.eigh(from_triangle(nearest[block.rows], block.size))
            nearest[block.rows] = to_triangle((vectors * np.maximum(values, 0.0)) @ vectors.T)
    return nearest
