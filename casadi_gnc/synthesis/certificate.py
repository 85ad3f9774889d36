"""What a point is worth, from the data in original units and from nothing the solver says.

Eigenvalues of every block at the point, less an allowance for rounding. What there is instead of a point is proved
in `casadi_gnc.synthesis.proofs`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from casadi_gnc.synthesis.conic import ConicData, Kind, from_triangle
from casadi_gnc.synthesis.scaling import Scaled

#: Share of a margin that must be left at a certified point; the rest is for the solver's tolerance.
MARGIN_KEPT = 0.5
_EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Check:
    """Hold what a constraint is worth at a point.

    Parameters
    ----------
    name, kind : the constraint's.
    smallest : smallest eigenvalue or element of its expression; for an equality minus the largest residual.
    margin : asked for.
    allowance : bound on what rounding has done to `smallest`.
    """

    name: str
    kind: Kind
    smallest: float
    margin: float
    allowance: float

    @property
    def holds(self) -> bool:
        """Whether the constraint holds: strictly, with half its margin left, if it has one."""
        if self.margin > 0:
            return self.smallest - self.allowance >= MARGIN_KEPT * self.margin
        return self.smallest + self.allowance >= 0

    @property
    def lacking(self) -> float:
        """Return how much is missing, in units of the margin or, without one, of the allowance."""
        return (self.margin - self.smallest) / max(self.margin, self.allowance, 1e-300)


def values(data: ConicData, point: np.ndarray) -> dict[str, np.ndarray]:
    """Return the expression of every constraint at a point: matrices, or columns of elements."""
    rows = data.matrix @ point + data.offset
    return {
        block.name: from_triangle(rows[block.rows], block.size) if block.kind is Kind.SEMIDEFINITE else rows[block.rows]
        for block in data.blocks
    }


def check(data: ConicData, point: np.ndarray) -> tuple[Check, ...]:
    """Return what every constraint is worth at a point, (N,), in original units."""
    here = values(data, point)
    rounding = _EPS * (abs(data.matrix) @ np.abs(point) + np.abs(data.offset))
    terms = int(np.max(np.diff(data.matrix.indptr), initial=0)) + 2
    found = []
    for block in data.blocks:
        value, doubt = here[block.name], terms * rounding[block.rows]
        if block.kind is Kind.SEMIDEFINITE:
            smallest, allowance = _smallest_eigenvalue(value, from_triangle(doubt, block.size), terms)
        elif block.kind is Kind.NONNEGATIVE:
            worst = int(np.argmin(value - doubt if block.margin > 0 else value + doubt))
            smallest, allowance = float(value[worst]), float(doubt[worst])
        else:  # the answer was projected on the equalities by least squares
            smallest, allowance = -float(np.max(np.abs(value))), 100 * float(np.max(doubt))
        found.append(Check(block.name, block.kind, smallest, block.margin, allowance))
    return tuple(found)


def _smallest_eigenvalue(matrix: np.ndarray, doubt: np.ndarray, terms: int) -> tuple[float, float]:
    """Return the smallest eigenvalue, or a Rayleigh quotient that is not positive, and its allowance.

    Parameters
    ----------
    matrix : (m, m), symmetric. doubt : (m, m), bound on the rounding of its entries.
    terms : of the sum in an entry.

    Notes
    -----
    Rows may be many decades apart: S = D N D, D diagonal of powers of two, has the size of one, so its
    eigenvalues are known to e = |D doubt D|, a few roundings. If its smallest, s, exceeds e, the true
    matrix is above (1 - e/s) N, and the smallest eigenvalue of N is 1/|L^-1 D|^2 with S = L L'.
    Else v with v'S v <= e gives the direction D v in which N is not positive beyond doubt.
    """
    size = np.diag(doubt) / (_EPS * terms)
    D = np.exp2(-np.round(np.log2(np.where(size > 0, size, 1.0)) / 2))
    S = matrix * np.outer(D, D)
    scaled = doubt * np.outer(D, D)
    e = float((scaled + 4 * len(D) / terms * scaled).sum(axis=1).max())  # bounds the 2-norm; eigh rounds as much
    found, vectors = np.linalg.eigh(S)
    if found[0] > e:
        smallest = 1 / float(np.linalg.norm(np.linalg.inv(np.linalg.cholesky(S)) * D, 2)) ** 2
        return smallest, smallest * e / float(found[0])
    length = float(np.sum((D * vectors[:, 0]) ** 2))
    return float(found[0]) / length, e / length


def onto_equalities(scaled: Scaled, y: np.ndarray) -> np.ndarray:
    """Return the nearest scaled point, (N,), that meets the equalities."""
    rows = np.concatenate(
        [np.arange(len(scaled.right))[b.rows] for b in scaled.data.blocks if b.kind is Kind.EQUAL] or [[]]
    )
    if not len(rows):
        return y
    matrix = scaled.matrix[rows.astype(int)].toarray()
    for _ in range(2):  # the second time for rounding
        y = y - np.linalg.lstsq(matrix, matrix @ y + scaled.right[rows.astype(int)], rcond=None)[0]
    return y
