"""Proofs that an objective has no lower bound: a ray along which it falls and no constraint is left."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from casadi_gnc.synthesis.certificate import check
from casadi_gnc.synthesis.conic import Block, ConicData, Kind, triangle
from casadi_gnc.synthesis.scaling import Scaled


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
