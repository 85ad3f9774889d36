"""Proofs that a set of LMIs has no point, from multipliers.

Multipliers z in the dual cone, r = matrix'z, h = -right'z > 0: for every point of the set
0 <= z'(matrix x + right) = r'x - h, so none has sum |r_i| |x_i| < h. With r = 0 that excludes everything.
In doubles r is seldom zero: then it excludes a range of the unknowns, and nothing is said beyond.

A solver's multipliers meet r = 0 to its tolerance. As factors (`casadi_gnc.synthesis.factors`), which lie in the cone
whatever they are, they are brought to r = 0 by Gauss and Newton's method; r is then summed with more digits than a
double has.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from casadi_gnc.synthesis.conic import ConicData, Kind, into_cone, triangle
from casadi_gnc.synthesis.factors import LONG, Factors, factored, multipliers, slopes_of
from casadi_gnc.synthesis.scaling import Scaled

#: r counts as zero where a change of each coefficient by this share of it makes it so: a double's last digits.
DATA_ROUNDING = 1e-13
_EPS = float(np.finfo(LONG).eps)
_FACES = (1e-2, 1e-3, 1e-4, 1e-6, 1e-9)  # shares of the largest eigenvalue below which one counts as zero
_ZEROS = (1e-3, 1e-5, 0.0)  # shares of the largest entry of the factors below which one counts as zero
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
        factors = factored(data, start, share, least).without(least)
        free = np.concatenate([part.ravel() for part in factors.parts]) != 0
        last, idle = np.inf, 0
        for _ in range(_STEPS):
            proof = _weigh(scaled, factors, dense)
            if proof is not None and (best is None or proof[0] > best[0]):
                best = proof
            elif best is not None and covers(best[1], within):  # one step more made it no better
                return best[1]
            z = np.asarray(multipliers(data, factors), dtype=float)
            residual, slopes = dense @ z, slopes_of(data, factors, dense)[:, free]
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


def _weigh(scaled: Scaled, factors: Factors, dense: np.ndarray) -> tuple[tuple[bool, float], Infeasibility] | None:
    """Return what factored multipliers in scaled units prove, after its rank: exact first, then how far it reaches."""
    data, parts = scaled.data, []
    for block, part in zip(data.blocks, factors.parts, strict=True):
        if block.kind is Kind.SEMIDEFINITE:  # Z in original units is (T L)(T L)'
            i, j = triangle(block.size)
            parts.append(np.sqrt(scaled.row[block.rows][i == j])[:, None] * part)
        else:
            row = scaled.row[block.rows]
            parts.append(part * (row if block.kind is Kind.EQUAL else np.sqrt(row)))
    z = multipliers(data, Factors(parts))
    weighted = z * (data.weight**2).round().astype(LONG)
    height = -np.sum(data.offset.astype(LONG) * weighted)
    tall = float(np.sum(np.abs(data.offset.astype(LONG) * weighted)))
    for block in data.blocks:
        plain = data.weight[block.rows] == 1
        height += LONG(block.margin) * np.sum(z[block.rows][plain])
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
    for name, unit in zip(data.names, scaled.unit.tolist(), strict=True):
        by_name[name] = min(by_name.get(name, np.inf), reach * unit)
    return (exact, reach), Infeasibility(_shares(data, factors), by_name, exact)


def _shares(data: ConicData, factors: Factors) -> dict[str, float]:
    z = np.asarray(multipliers(data, factors), dtype=float) * data.weight
    sizes = {block.name: float(np.linalg.norm(z[block.rows])) for block in data.blocks}
    together = sum(sizes.values())
    return dict(sorted(((name, size / together) for name, size in sizes.items()), key=lambda item: -item[1]))


def _columns(data: ConicData, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return matrix'z and the sums of its terms' sizes, (N,), in long doubles; z are triangles in original units."""
    weighted = z * (data.weight**2).round().astype(LONG)
    rows = np.repeat(np.arange(len(data.offset)), np.diff(data.matrix.indptr))
    terms = data.matrix.data.astype(LONG) * weighted[rows]
    total, size = np.zeros(len(data.cost), dtype=LONG), np.zeros(len(data.cost), dtype=LONG)
    np.add.at(total, data.matrix.indices, terms)
    np.add.at(size, data.matrix.indices, np.abs(terms))
    return total, size
