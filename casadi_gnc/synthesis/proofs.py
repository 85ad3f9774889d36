"""Proofs that a set of LMIs has no point, or no minimum, and bounds on the objective, from multipliers and rays.

* No point: multipliers z in the dual cone, r = matrix'z, h = -right'z > 0. For every point of the set
  0 <= z'(matrix x + right) = r'x - h, so none has sum |r_i| |x_i| < h. With r = 0 that excludes everything.
  In doubles r is seldom zero: then it excludes a range of the unknowns, and nothing is said beyond.
* No minimum: a ray along which the objective falls and no constraint is left.

A solver's multipliers meet r = 0 to its tolerance. Written as Z = L L', which is semidefinite whatever L is, they
are brought to r = 0 by Gauss and Newton's method; r is then summed with more digits than a double has.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse.csgraph import connected_components

from casadi_gnc.synthesis.certificate import check
from casadi_gnc.synthesis.conic import Block, ConicData, Kind, from_triangle, into_cone, to_triangle, triangle
from casadi_gnc.synthesis.scaling import Scaled

#: r counts as zero where a change of each coefficient by this share of it makes it so: a double's last digits.
DATA_ROUNDING = 1e-13
_LONG = np.longdouble
_EPS = float(np.finfo(_LONG).eps)
_FACES = (1e-2, 1e-3, 1e-4, 1e-6, 1e-9)  # shares of the largest eigenvalue below which one counts as zero
_ZEROS = (1e-3, 1e-5, 0.0)  # shares of the largest entry of the factors below which one counts as zero
_COUPLED = 1e-3  # times such a share: entries below it, beside the roots of their diagonals, couple nothing
_STEPS = 12  # of Gauss and Newton's method, which doubles the digits
Reach = float | Mapping[str, float]


@dataclass(frozen=True)
class Infeasibility:
    """Hold a proof that no point with unknowns in a range meets all constraints.

    Parameters
    ----------
    shares : of the multipliers, by constraint, largest first, in scaled units; they add up to one.
    reach : by name of unknown, in its unit: no point has all entries of all unknowns below these.
    exact : whether, besides, data that differ from the given ones by less than `DATA_ROUNDING` of each
        coefficient have no point at all.
    """

    shares: dict[str, float]
    reach: dict[str, float]
    exact: bool

    def sentence(self) -> str:
        """Return the range of the unknowns that the proof covers."""
        return ", ".join(f"{name} up to {reach:.2g}" for name, reach in self.reach.items())


@dataclass(frozen=True)
class Ray:
    """Hold a proof that the objective has no lower bound wherever the constraints can be met.

    Parameters
    ----------
    direction : by label, of the scalar unknowns that run away, in original units.
    loss : largest loss of a constraint along it, in its unit; no more than rounding of the evaluation explains.
    """

    direction: dict[str, float]
    loss: float


def names_of(data: ConicData) -> list[str]:
    """Return the name of the unknown that each scalar unknown belongs to, (N,)."""
    return [label.split("[")[0] for label in data.labels]


@dataclass(frozen=True, eq=False)
class _Factors:
    """Hold multipliers as factors: L of Z = L L', roots of plain multipliers, free ones of equalities."""

    parts: list[np.ndarray]

    def moved(self, step: np.ndarray) -> _Factors:
        parts, start = [], 0
        for part in self.parts:
            parts.append(part + step[start : start + part.size].reshape(part.shape))
            start += part.size
        return _Factors(parts)

    def without(self, least: float) -> _Factors:
        """Return them with entries below a share of the largest at zero."""
        largest = max((float(np.max(np.abs(part), initial=0.0)) for part in self.parts), default=0.0)
        return _Factors([np.where(np.abs(part) > least * largest, part, 0.0) for part in self.parts])


def _factors(data: ConicData, z: np.ndarray, share: float, least: float) -> _Factors:
    """Return factors of triangles z, (M,), without what is below a share of the largest eigenvalue.

    Parts of a matrix whose coupling is below `least` times `_COUPLED` are factored apart: like eigenvalues would mix
    their vectors, and what the data keep apart would be zero to rounding only.
    """
    values, vectors, largest = [], [], 0.0
    for block in data.blocks:
        if block.kind is Kind.SEMIDEFINITE:
            found, basis = _eigenvectors(from_triangle(z[block.rows], block.size), _COUPLED * least)
        else:
            found, basis = z[block.rows], np.zeros(0)
        values.append(found)
        vectors.append(basis)
        largest = max(largest, float(np.max(np.abs(found), initial=0.0)))
    parts = []
    for block, found, basis in zip(data.blocks, values, vectors, strict=True):
        if block.kind is Kind.EQUAL:
            parts.append(found)
            continue
        kept = found > share * largest
        if block.kind is Kind.SEMIDEFINITE:
            parts.append(basis[:, kept] * np.sqrt(found[kept]))
        else:
            parts.append(np.sqrt(np.where(kept, found, 0.0)))
    return _Factors(parts)


def _eigenvectors(Z: np.ndarray, least: float) -> tuple[np.ndarray, np.ndarray]:
    """Return eigenvalues, in any order, and eigenvectors, part by part of what couples more than `least`."""
    size = np.sqrt(np.maximum(np.diag(Z), 0.0))
    count, part = connected_components(np.abs(Z) > least * np.outer(size, size), directed=False)
    values, vectors = np.zeros(len(Z)), np.zeros_like(Z)
    for k in range(count):
        here = np.flatnonzero(part == k)
        values[here], vectors[np.ix_(here, here)] = np.linalg.eigh(Z[np.ix_(here, here)])
    return values, vectors


def _multipliers(data: ConicData, factors: _Factors) -> np.ndarray:
    """Return triangles, (M,), in long doubles."""
    z = np.zeros(len(data.offset), dtype=_LONG)
    for block, part in zip(data.blocks, factors.parts, strict=True):
        long = part.astype(_LONG)
        if block.kind is Kind.SEMIDEFINITE:
            z[block.rows] = to_triangle(long @ long.T)
        else:
            z[block.rows] = long if block.kind is Kind.EQUAL else long * long
    return z


def _slopes(data: ConicData, factors: _Factors, dense: np.ndarray) -> np.ndarray:
    """Return the derivative of matrix'z, (N, number of factors' entries); `dense` is (N, M), weights included."""
    columns = [np.zeros((dense.shape[0], 0))]
    for block, part in zip(data.blocks, factors.parts, strict=True):
        rows = dense[:, block.rows]
        if block.kind is Kind.SEMIDEFINITE:
            full = np.zeros((dense.shape[0], block.size, block.size))
            i, j = triangle(block.size)
            full[:, i, j] = rows / np.where(i == j, 1.0, 2.0)
            full[:, j, i] = full[:, i, j]
            columns.append((2 * full @ part).reshape(dense.shape[0], -1))
        elif block.kind is Kind.NONNEGATIVE:
            columns.append(2 * rows * part)
        else:
            columns.append(rows)
    return np.hstack(columns)


def _columns(data: ConicData, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return matrix'z and the sums of its terms' sizes, (N,), in long doubles; z are triangles in original units."""
    weighted = z * (data.weight**2).round().astype(_LONG)
    rows = np.repeat(np.arange(len(data.offset)), np.diff(data.matrix.indptr))
    terms = data.matrix.data.astype(_LONG) * weighted[rows]
    total, size = np.zeros(len(data.cost), dtype=_LONG), np.zeros(len(data.cost), dtype=_LONG)
    np.add.at(total, data.matrix.indices, terms)
    np.add.at(size, data.matrix.indices, np.abs(terms))
    return total, size


def promising(scaled: Scaled, dual: np.ndarray) -> bool:
    """Return whether scaled multipliers exclude, as they are, all points up to 1e4 times their natural size.

    Those of a point exclude what costs less than it: far fewer.
    """
    if np.shape(dual) != np.shape(scaled.right) or not np.all(np.isfinite(dual)):
        return False
    return bool(-float(scaled.right @ dual) > 1e4 * float(np.max(np.abs(scaled.matrix.T @ dual), initial=0.0)))


def prove_infeasible(scaled: Scaled, dual: np.ndarray, within: Reach | None = None) -> Infeasibility | None:
    """Return the best proof that scaled multipliers, (M,), lead to, or None if they exclude nothing.

    Parameters
    ----------
    within : bounds on the entries of the unknowns, in their units, that it is to cover: it is searched for until then.
    """
    if np.shape(dual) != np.shape(scaled.right) or not np.all(np.isfinite(dual)) or not np.any(dual):
        return None
    data = scaled.data
    start = into_cone(data, dual / scaled.data.weight / np.max(np.abs(dual)))
    dense = np.asarray((scaled.matrix.multiply(data.weight[:, None])).T.todense())  # acts on triangles without weights
    best: tuple[tuple[bool, float], Infeasibility] | None = None
    for share, least in ((share, least) for share in _FACES for least in _ZEROS):
        factors = _factors(data, start, share, least).without(least)
        free = np.concatenate([part.ravel() for part in factors.parts]) != 0
        last, idle = np.inf, 0
        for _ in range(_STEPS):
            proof = _weigh(scaled, factors, dense)
            if proof is not None and (best is None or proof[0] > best[0]):
                best = proof
            elif best is not None and covers(best[1], within):  # one step more made it no better
                return best[1]
            z = np.asarray(_multipliers(data, factors), dtype=float)
            residual, slopes = dense @ z, _slopes(data, factors, dense)[:, free]
            if not slopes.shape[1] or not np.all(np.isfinite(residual)):
                break
            size = float(np.linalg.norm(residual))
            idle = idle + 1 if size > last / 2 else 0
            if idle > 1:  # there is nothing to be found near these
                break
            last, step = size, np.zeros(len(free))
            step[free] = -np.linalg.lstsq(slopes, residual, rcond=1e-12)[0]
            factors = factors.moved(step)
            if np.linalg.norm(step) <= 1e-15 * sum(float(np.linalg.norm(part)) for part in factors.parts):
                break
        if best is not None and covers(best[1], within):
            break
    return None if best is None else best[1]


def covers(proof: Infeasibility, within: Reach | None) -> bool:
    """Return whether a proof covers a stated range, or, without one, all that the digits of the data can tell."""
    if within is None:
        return proof.exact
    wanted = dict.fromkeys(proof.reach, within) if not isinstance(within, Mapping) else within
    return proof.exact or all(reach >= wanted.get(name, np.inf) for name, reach in proof.reach.items())


def _weigh(scaled: Scaled, factors: _Factors, dense: np.ndarray) -> tuple[tuple[bool, float], Infeasibility] | None:
    """Return what factored multipliers in scaled units prove, after its rank: exact first, then how far it reaches."""
    data, parts = scaled.data, []
    for block, part in zip(data.blocks, factors.parts, strict=True):
        if block.kind is Kind.SEMIDEFINITE:  # Z in original units is (T L)(T L)'
            i, j = triangle(block.size)
            parts.append(np.sqrt(scaled.row[block.rows][i == j])[:, None] * part)
        else:
            row = scaled.row[block.rows]
            parts.append(part * (row if block.kind is Kind.EQUAL else np.sqrt(row)))
    z = _multipliers(data, _Factors(parts))
    weighted = z * (data.weight**2).round().astype(_LONG)
    height = -np.sum(data.offset.astype(_LONG) * weighted)
    tall = float(np.sum(np.abs(data.offset.astype(_LONG) * weighted)))
    for block in data.blocks:
        plain = data.weight[block.rows] == 1
        height += _LONG(block.margin) * np.sum(z[block.rows][plain])
    terms = len(data.offset) + max((block.size for block in data.blocks), default=0)
    lowest = float(height) - terms * _EPS * 4 * tall
    if not lowest > 0:
        return None
    total, size = _columns(data, z)
    largest = np.abs(total) + terms * _EPS * 4 * size
    if not np.all(np.isfinite(largest)):
        return None
    exact = bool(np.all(np.abs(total) <= DATA_ROUNDING * size))
    spent = float(np.sum(largest * scaled.unit))
    reach = lowest / spent if spent > 0 else np.inf
    by_name: dict[str, float] = {}
    for name, unit in zip(names_of(data), scaled.unit.tolist(), strict=True):
        by_name[name] = min(by_name.get(name, np.inf), reach * unit)
    return (exact, reach), Infeasibility(_shares(data, factors), by_name, exact)


def _shares(data: ConicData, factors: _Factors) -> dict[str, float]:
    z = np.asarray(_multipliers(data, factors), dtype=float) * data.weight
    sizes = {block.name: float(np.linalg.norm(z[block.rows])) for block in data.blocks}
    together = sum(sizes.values())
    return dict(sorted(((name, size / together) for name, size in sizes.items()), key=lambda item: -item[1]))


def prove_unbounded(scaled: Scaled, ray: np.ndarray) -> Ray | None:
    """Return the proof that a scaled direction, (N,), makes, or None if it makes none.

    Entries that are small beside the largest are tried as zeros: a solver's ray has its tolerance in them.
    """
    if np.shape(ray) != np.shape(scaled.cost) or not np.all(np.isfinite(ray)) or not np.any(ray):
        return None
    y, data = ray / np.max(np.abs(ray)), scaled.data
    still = replace(
        data, offset=np.zeros_like(data.offset), blocks=tuple(replace(block, margin=0.0) for block in data.blocks)
    )
    for smallest in (0.0, 1e-9, 1e-7, 1e-5, 1e-3):
        direction = scaled.original(np.where(np.abs(y) > smallest, y, 0.0))
        terms = data.cost * direction
        if not -float(np.sum(terms)) > 1e-6 * float(np.sum(np.abs(terms))):
            continue
        checks = check(still, direction)
        if all(one.holds for one in checks):
            running = {
                label: float(value)
                for label, value, share in zip(data.labels, direction, y, strict=True)
                if abs(share) > 0.05
            }
            return Ray(running, max(0.0, *(-one.smallest for one in checks)))
    return None


def ray_data(scaled: Scaled) -> Scaled:
    """Return conic data, one unknown more, whose best point is the ray deepest inside all constraints.

    Maximise s subject to matrix y - s in K, equalities kept, cost'y = -1, s <= 1 and the entries of y bounded; rows
    without a coefficient are left as they are. Inside the cones a solver's tolerance does no harm.
    """
    data, count = scaled.data, len(scaled.cost)
    deep = np.zeros(len(scaled.right))
    for block in data.blocks:
        if block.kind is Kind.EQUAL:
            continue
        used = np.diff(scaled.matrix[block.rows].tocsr().indptr) > 0
        if block.kind is Kind.SEMIDEFINITE:
            i, j = triangle(block.size)
            touched = np.zeros(block.size, dtype=bool)
            np.logical_or.at(touched, i, used)
            np.logical_or.at(touched, j, used)
            deep[block.rows] = np.where((i == j) & touched[i], -1.0, 0.0)
        else:
            deep[block.rows] = np.where(used, -1.0, 0.0)
    fall = sp.csr_matrix(np.append(scaled.cost, 0.0))
    box = sp.vstack([sp.eye(count + 1), -sp.eye(count + 1)]).tocsr()
    limits = np.full(2 * (count + 1), 1e4)
    limits[count] = limits[-1] = 1.0
    widened = sp.hstack([scaled.matrix, sp.csr_matrix(deep[:, None])]).tocsr()
    first = sum(block.count for block in data.blocks if block.kind is Kind.EQUAL)
    matrix = sp.csr_matrix(sp.vstack([fall, widened[:first], -box, widened[first:]]))
    right = np.concatenate([[1.0], np.zeros(first), limits, np.zeros(len(deep) - first)])
    blocks = [Block("fall", Kind.EQUAL, 1, 0)]
    equal = [block for block in data.blocks if block.kind is Kind.EQUAL]
    others = [block for block in data.blocks if block.kind is not Kind.EQUAL]
    for block in [*equal, Block("box", Kind.NONNEGATIVE, len(limits), 0), *others]:
        blocks.append(replace(block, start=blocks[-1].start + blocks[-1].count, margin=0.0))
    cost = np.append(np.zeros(count), -1.0)
    own = ConicData(tuple(blocks), matrix, right, cost, 0.0, (*data.labels, "depth"))
    ones = np.ones(len(right))
    return Scaled(own, matrix, right, cost, np.ones(count + 1), ones, 1.0)


def bound(scaled: Scaled, dual: np.ndarray, y: np.ndarray, *, margins: bool = True) -> float:
    """Return a lower bound on the objective, in original units, from scaled multipliers (weights included).

    It holds for every point whose scaled unknowns are within ten times the largest at hand (or ten).

    Parameters
    ----------
    margins : whether the margins are asked for; without them the bound is one on what any margins cost.
    """
    if np.shape(dual) != np.shape(scaled.right) or not np.all(np.isfinite(dual)):
        return -np.inf
    right = scaled.right if margins else scaled.data.offset * scaled.row * scaled.data.weight
    reach, matrix, best = 10 * max(1.0, float(np.max(np.abs(y), initial=0.0))), scaled.matrix, -np.inf
    gram = (matrix.T @ matrix).toarray()
    gram[np.diag_indices_from(gram)] += 1e-13 * (1.0 + np.max(np.diag(gram), initial=0.0))
    factor = cho_factor(gram)
    for _ in range(4):  # towards matrix'z = cost and back into the cone
        dual = into_cone(scaled.data, dual / scaled.data.weight) * scaled.data.weight
        residual = scaled.cost - matrix.T @ dual
        value, doubt = -float(right @ dual), reach * float(np.sum(np.abs(residual)))
        best = max(best, value - doubt)
        if doubt <= 1e-6 * abs(value):
            break
        dual = dual + matrix @ cho_solve(factor, residual)
    return best / scaled.price + scaled.data.constant
