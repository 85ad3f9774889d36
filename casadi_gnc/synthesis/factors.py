"""Multipliers of a set of LMIs as factors, which lie in the dual cone whatever the factors are.

A matrix of multipliers is Z = L L', a plain one a square; those of equalities are free.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse.csgraph import connected_components

from casadi_gnc.synthesis.conic import ConicData, Kind, from_triangle, to_triangle, triangle

LONG = np.longdouble
_COUPLED = 1e-3  # times such a share: entries below it, beside the roots of their diagonals, couple nothing


@dataclass(frozen=True, eq=False)
class Factors:
    """Hold multipliers as factors: L of Z = L L', roots of plain multipliers, free ones of equalities."""

    parts: list[np.ndarray]

    def moved(self, step: np.ndarray) -> Factors:
        """Return them moved by a step of all their entries, (number of entries,)."""
        parts, start = [], 0
        for part in self.parts:
            parts.append(part + step[start : start + part.size].reshape(part.shape))
            start += part.size
        return Factors(parts)

    def without(self, least: float) -> Factors:
        """Return them with entries below a share of the largest at zero."""
        largest = max((float(np.max(np.abs(part), initial=0.0)) for part in self.parts), default=0.0)
        return Factors([np.where(np.abs(part) > least * largest, part, 0.0) for part in self.parts])


def factored(data: ConicData, z: np.ndarray, share: float, least: float) -> Factors:
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
    return Factors(parts)


def _eigenvectors(Z: np.ndarray, least: float) -> tuple[np.ndarray, np.ndarray]:
    """Return eigenvalues, in any order, and eigenvectors, part by part of what couples more than `least`."""
    size = np.sqrt(np.maximum(np.diag(Z), 0.0))
    count, part = connected_components(np.abs(Z) > least * np.outer(size, size), directed=False)
    values, vectors = np.zeros(len(Z)), np.zeros_like(Z)
    for k in range(count):
        here = np.flatnonzero(part == k)
        values[here], vectors[np.ix_(here, here)] = np.linalg.eigh(Z[np.ix_(here, here)])
    return values, vectors


def multipliers(data: ConicData, factors: Factors) -> np.ndarray:
    """Return triangles, (M,), in long doubles."""
    z = np.zeros(len(data.offset), dtype=LONG)
    for block, part in zip(data.blocks, factors.parts, strict=True):
        long = part.astype(LONG)
        if block.kind is Kind.SEMIDEFINITE:
            z[block.rows] = to_triangle(long @ long.T)
        else:
            z[block.rows] = long if block.kind is Kind.EQUAL else long * long
    return z


def slopes_of(data: ConicData, factors: Factors, dense: np.ndarray) -> np.ndarray:
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
