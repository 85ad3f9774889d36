"""What an answer is worth, from the data in original units and from nothing the solver says.

* A point: eigenvalues of every block at the point, less an allowance for rounding.
* No point: multipliers z in the dual cone with matrix'z = r near 0 and right'z = -1. For any point of
  the set, 0 <= z'(matrix x + right) = r'x - 1; so none has |x_i| < radius unit_i, radius = 1/sum |r_i| unit_i.
* No minimum: a ray along which the objective falls and no constraint is left.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from casadi_gnc.synthesis.conic import ConicData, Kind, from_triangle, into_cone
from casadi_gnc.synthesis.scaling import Scaled

#: Share of a margin that must be left at a certified point; the rest is for the solver's tolerance.
MARGIN_KEPT = 0.5
#: Smallest radius, in scaled units, around zero free of points, that counts as infeasible.
SMALLEST_RADIUS = 1e5
#: Largest loss of a constraint, per fall of the objective, along a certified ray (scaled units).
LARGEST_LOSS = 1e-4
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


@dataclass(frozen=True)
class Infeasibility:
    """Hold a proof that no point meets all constraints.

    Parameters
    ----------
    shares : of the multipliers, by constraint, largest first, in scaled units; they add up to one.
    radius : no point has all unknowns within radius times `units`.
    units : natural size of each scalar unknown, by label.
    """

    shares: dict[str, float]
    radius: float
    units: dict[str, float]


@dataclass(frozen=True)
class Ray:
    """Hold a proof that the objective has no lower bound wherever the constraints can be met.

    Parameters
    ----------
    direction : by label, of the scalar unknowns that run away, in original units.
    loss : of the worst constraint per fall of the objective, scaled; zero for an exact ray.
    """

    direction: dict[str, float]
    loss: float


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


def bound(scaled: Scaled, dual: np.ndarray, y: np.ndarray) -> float:
    """Return a lower bound on the objective, in original units, from scaled multipliers (weights included).

    It holds for every point whose scaled unknowns are within ten times the largest at hand (or ten).
    """
    if np.shape(dual) != np.shape(scaled.right) or not np.all(np.isfinite(dual)):
        return -np.inf
    reach, matrix, best = 10 * max(1.0, float(np.max(np.abs(y), initial=0.0))), scaled.matrix.toarray(), -np.inf
    for _ in range(3):  # towards matrix'z = cost and back into the cone
        dual = into_cone(scaled.data, dual / scaled.data.weight) * scaled.data.weight
        residual = scaled.cost - matrix.T @ dual
        value, doubt = -float(scaled.right @ dual), reach * float(np.sum(np.abs(residual)))
        best = max(best, value - doubt)
        if doubt <= 1e-6 * abs(value):
            break
        dual = dual + np.linalg.lstsq(matrix.T, residual, rcond=None)[0]
    return best / scaled.price + scaled.data.constant


def prove_infeasible(scaled: Scaled, dual: np.ndarray) -> Infeasibility | None:
    """Return the proof that scaled multipliers, (M,), make, or None if they make none."""
    if np.shape(dual) != np.shape(scaled.right) or not np.all(np.isfinite(dual)) or not np.any(dual):
        return None
    data, matrix = scaled.data, scaled.matrix.toarray()
    z = dual / np.max(np.abs(dual))
    best, radius = None, 0.0
    for _ in range(4):  # towards matrix'z = 0 and back into the cone, as long as it helps
        z = into_cone(data, z / data.weight) * data.weight
        height = -float(scaled.right @ z)
        if height <= 0:
            break
        residual = float(np.sum(np.abs(matrix.T @ z)))
        rounding = _EPS * float(np.sum(np.abs(matrix).T @ np.abs(z))) * 4
        reach = height / (residual + rounding)
        if reach > radius:
            best, radius = z.copy(), reach
        if radius > 1e4 * SMALLEST_RADIUS:
            break
        z = z - np.linalg.lstsq(matrix.T, matrix.T @ z, rcond=None)[0]
    if best is None or radius < SMALLEST_RADIUS:
        return None
    weights = {block.name: float(np.linalg.norm(best[block.rows])) for block in data.blocks}
    total = sum(weights.values())
    shares = dict(sorted(((name, w / total) for name, w in weights.items()), key=lambda item: -item[1]))
    return Infeasibility(shares, radius, dict(zip(data.labels, scaled.unit.tolist(), strict=True)))


def prove_unbounded(scaled: Scaled, ray: np.ndarray) -> Ray | None:
    """Return the proof that a scaled direction, (N,), makes, or None if it makes none."""
    if np.shape(ray) != np.shape(scaled.cost) or not np.all(np.isfinite(ray)) or not np.any(ray):
        return None
    y = ray / np.max(np.abs(ray))
    fall = -float(scaled.cost @ y)
    rows, loss = scaled.matrix @ y, 0.0
    for block in scaled.data.blocks:
        part = rows[block.rows] / scaled.data.weight[block.rows]
        if block.kind is Kind.SEMIDEFINITE:
            loss = max(loss, -float(np.linalg.eigvalsh(from_triangle(part, block.size))[0]))
        else:
            loss = max(loss, float(np.max(-part if block.kind is Kind.NONNEGATIVE else np.abs(part))))
    if not (fall > 1e-6 and loss <= LARGEST_LOSS * fall):
        return None
    running = {
        label: float(value * unit)
        for label, value, unit in zip(scaled.data.labels, y, scaled.unit, strict=True)
        if abs(value) > 0.05
    }
    return Ray(running, loss / fall)
