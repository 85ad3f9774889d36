"""Unknown matrices of a set of LMIs, as CasADi symbols with a structure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.errors import SynthesisError


@dataclass(frozen=True, eq=False)
class Unknown:
    """Hold one unknown matrix.

    Parameters
    ----------
    name : for the reader.
    expression : SX of the matrix.
    symbols : SX column of the scalar unknowns in it.
    labels : of the symbols, such as ``X[1,0]``.
    index : (rows, columns), which symbol stands in an entry; -1 for a zero.
    """

    name: str
    expression: ca.SX
    symbols: ca.SX
    labels: tuple[str, ...]
    index: np.ndarray

    def value(self, numbers: np.ndarray) -> np.ndarray:
        """Return the matrix for numbers in place of the symbols."""
        return np.where(self.index >= 0, numbers[np.maximum(self.index, 0)], 0.0)


def unknown(name: str, index: np.ndarray) -> Unknown:
    """Return an unknown whose entries are the symbols that an index names; negative is zero."""
    labels = [""] * (int(index.max()) + 1)
    for (row, column), number in np.ndenumerate(index):
        if number >= 0 and not labels[number]:
            labels[number] = f"{name}[{row},{column}]"
    symbols = ca.vertcat(*[ca.SX.sym(label) for label in labels])
    flat = index.ravel(order="F")
    if np.all(flat >= 0):
        expression = ca.reshape(symbols[flat.tolist()], *index.shape)
    else:
        expression = ca.SX(*index.shape)
        for row, column in zip(*np.nonzero(index >= 0), strict=True):
            expression[int(row), int(column)] = symbols[int(index[row, column])]
    return Unknown(name, expression, symbols, tuple(labels), index)


def symmetric_index(size: int) -> np.ndarray:
    """Return the index of a symmetric matrix, lower triangle row by row."""
    index = np.zeros((size, size), dtype=int)
    row, column = np.tril_indices(size)
    index[row, column] = index[column, row] = np.arange(len(row))
    return index


def diagonal_index(size: int, *, equal: bool) -> np.ndarray:
    """Return the index of a diagonal matrix, of a multiple of the identity if all are equal."""
    index = np.full((size, size), -1)
    np.fill_diagonal(index, 0 if equal else np.arange(size))
    return index


def block_matrix(rows: list[list[Any]]) -> ca.SX:
    """Return a symmetric matrix from the blocks on and above its diagonal.

    Parameters
    ----------
    rows : blocks, row by row. Those on the diagonal are square (a number is 1 by 1) and set the
        sizes; above it, 0 or None is a block of zeros. What lies below is None, or left out by
        giving shorter rows: it is the transpose of what lies above.

    Raises
    ------
    SynthesisError
        For a block whose size does not fit, or a block below the diagonal.

    Examples
    --------
    >>> import casadi as ca
    >>> X = ca.SX.sym("X", 2, 2)
    >>> block_matrix([[X + X.T, ca.DM([1, 2])], [-3]]).shape
    (3, 3)
    """
    count = len(rows)
    full = [[*[None] * (count - len(row)), *row] for row in rows]
    diagonal = [as_sx(full[i][i]) if full[i] and full[i][i] is not None else ca.SX(0, 1) for i in range(count)]
    for i, block in enumerate(diagonal):
        if block.shape[0] != block.shape[1]:
            raise SynthesisError(
                f"block ({i}, {i}) has shape {block.shape}, expected a square; blocks on the diagonal set the sizes"
            )
    sizes = [block.shape[0] for block in diagonal]
    grid = [[diagonal[i] if i == j else ca.SX(sizes[i], sizes[j]) for j in range(count)] for i in range(count)]
    for i in range(count):
        for j in range(count):
            given = full[i][j] if j < len(full[i]) else None
            if i == j or given is None or (isinstance(given, (int, float)) and given == 0):
                continue
            if j < i:
                raise SynthesisError(
                    f"block ({i}, {j}) lies below the diagonal; give its transpose as block ({j}, {i})"
                )
            block, expected = as_sx(given), (sizes[i], sizes[j])
            if block.shape != expected:
                raise SynthesisError(
                    f"block ({i}, {j}) has shape {block.shape}, expected {expected}; check its factors"
                )
            grid[i][j], grid[j][i] = block, block.T
    return ca.vertcat(*[ca.horzcat(*row) for row in grid])


def as_sx(block: Any) -> ca.SX:
    """Return a matrix as SX, without a copy if it is one."""
    return block if isinstance(block, ca.SX) else ca.SX(block)
