"""Zonotopes: what a box of forces makes through a matrix; their faces, and how far they reach.

=============  ==========================================================  ==============
symbol         meaning                                                     name here
=============  ==========================================================  ==============
c, g_i         centre (R,) and generators (R, N): u = c + sum g_i t_i      centre, generators
K, k           slice (P, N), (P,): K t + k = 0                             tie, tie_centre
n, b           half-spaces n.u <= b, |n| = 1                               normals, offsets
=============  ==========================================================  ==============

The set is {c + G t : |t_i| <= 1, K t + k = 0}; without a slice it is a zonotope, with one it is the
cut at zero of the zonotope of [G; K] in R + P dimensions.

**Faces.** A facet of a zonotope of dimension r is spanned by r - 1 independent generators, so every
facet normal is orthogonal to some r - 1 of them; its offset is the support function
h(n) = n.c + sum |n.g_i|. Every such half-space holds the set and all of them together are the set, so
spheres and boxes about an origin inside are exact whatever superfluous members the list has, and the cut
at K t + k = 0 is had by reading the lifted normals (n_u, n_k) as n_u.u <= b. With the origin outside,
the deepest violated half-space is a lower bound of the distance. Where generators do not span the
space (or a stuck actuator moves the set off the origin) the missing dimensions enter as pairs of
opposite half-spaces.

**Lines.** The largest s with s u in the set is a linear program; its dual multipliers are a normal, so
h(n)/(n.u) bounds s from above, whatever the solver says of itself.

Source: McMullen (1971), On zonotopes, Trans. AMS 159, doi:10.1090/S0002-9947-1971-0279689-2.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from math import comb
from typing import Any

import numpy as np

from casadi_gnc.errors import AllocationError

#: Largest number of generator subsets that are tried as facets; some seconds of work.
MOST_SUBSETS = 100_000
#: Of the linear programs, the tightest HiGHS takes; their data are scaled to one.
TOLERANCES = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
#: Relative size below which a number is rounding: a rank, an offset, a direction.
_TINY = 1e-10
#: Largest relative distance between a linear program's answer and its own dual bound.
_LP_TOLERANCE = 1e-7


@dataclass(frozen=True, eq=False)
class Halfspaces:
    """Hold a convex set as {u : normals u <= offsets}.

    Parameters
    ----------
    normals : (M, R), unit vectors.
    offsets : (M,), in the unit of u; negative where the origin is outside.
    is_empty : whether no u at all qualifies (found while slicing).
    """

    normals: np.ndarray
    offsets: np.ndarray
    is_empty: bool = False

    def sphere(self, rows: Any = slice(None)) -> float:
        """Return the radius of the largest sphere about the origin inside the set, in the plane of some rows.

        Negative: the origin is outside, and at least that far from the set. NaN: the set is empty.
        """
        if self.is_empty:
            return float("nan")
        reach = np.linalg.norm(self.normals[:, rows], axis=1)
        return float(_ratios(self.offsets, np.where(reach > _TINY, reach, 0.0), self.offsets).min(initial=np.inf))

    def box(self, proportions: np.ndarray) -> float:
        """Return the largest s for which the box |u_i| <= s p_i is inside, negative or NaN as for `sphere`."""
        if self.is_empty:
            return float("nan")
        widths = np.abs(self.normals) @ proportions
        return float(_ratios(self.offsets, widths, self.offsets).min(initial=np.inf))

    def line(self, direction: np.ndarray) -> tuple[float, float]:
        """Return the least and the largest s with s times direction in the set; NaN where the line misses it."""
        along = self.normals @ direction
        size = np.linalg.norm(direction)
        above, below = along > _TINY * size, along < -_TINY * size
        least = float(np.max(self.offsets[below] / along[below], initial=-np.inf))
        largest = float(np.min(self.offsets[above] / along[above], initial=np.inf))
        slack = 1e-9 * max(abs(least), abs(largest))  # a flat set off the origin has opposite faces
        misses = self.is_empty or not least <= largest + slack or np.any(self.offsets[~above & ~below] < 0)
        return (float("nan"), float("nan")) if misses else (min(least, largest), max(least, largest))


@dataclass(frozen=True, eq=False)
class Zonotope:
    """Hold {c + G t : |t_i| <= 1, K t + k = 0}.

    Parameters
    ----------
    generators : G, (R, N), in the unit of the effort.
    centre : c, (R,).
    tie : K, (P, N), rows of any rank; P = 0 for a plain zonotope.
    tie_centre : k, (P,).

    Examples
    --------
    >>> import numpy as np
    >>> square = Zonotope.of_box(np.eye(2), lower=-np.ones(2), upper=np.ones(2))
    >>> square.line(np.array([1.0, 1.0])), round(square.halfspaces.sphere(), 12)
    ((-1.0, 1.0), 1.0)
    """

    generators: np.ndarray
    centre: np.ndarray
    tie: np.ndarray
    tie_centre: np.ndarray

    @classmethod
    def of_box(
        cls, matrix: np.ndarray, lower: np.ndarray, upper: np.ndarray, tie: np.ndarray | None = None
    ) -> Zonotope:
        """Return {matrix F : lower <= F <= upper, tie F = 0}.

        Parameters
        ----------
        matrix : (R, N).
        lower, upper : (N,), finite, lower <= upper.
        tie : (any, N); dependent rows are taken out by rank, those within rounding of zero too.
        """
        half, middle = (upper - lower) / 2, (upper + lower) / 2
        generators, centre = matrix * half, matrix @ middle
        count = matrix.shape[1]
        if tie is None or not tie.size:
            return cls(generators, centre, np.zeros((0, count)), np.zeros(0))
        rows = np.column_stack([tie * half, tie @ middle])
        _, sizes, basis = np.linalg.svd(rows, full_matrices=False)
        floor = max(_TINY * sizes[0], 1e-14 * np.linalg.norm(np.column_stack([generators, centre])))
        basis = basis[sizes > floor]
        return cls(generators, centre, basis[:, :count], basis[:, count])

    @cached_property
    def scale(self) -> np.ndarray:
        """Largest deviation from the centre of every row, (R,); the largest of all for a row that cannot move."""
        reach = np.abs(self.generators).sum(axis=1)
        fallback = max(reach.max(initial=0.0), np.abs(self.centre).max(initial=0.0)) or 1.0
        return np.where(reach > 0, reach, fallback)

    @cached_property
    def halfspaces(self) -> Halfspaces:
        """Every face, exact to rounding.

        Raises
        ------
        AllocationError
            For more than `MOST_SUBSETS` subsets of generators.
        """
        lifted = np.vstack([self.generators / self.scale[:, None], self.tie])
        normals, offsets = _faces(lifted, np.concatenate([self.centre / self.scale, self.tie_centre]))
        rows = len(self.centre)
        flat = np.linalg.norm(normals[:, :rows], axis=1) <= 1e-9  # says something of the slice alone
        is_empty = bool(np.any(offsets[flat] < -1e-9))
        normals, offsets = normals[~flat, :rows] / self.scale, offsets[~flat]
        offsets = np.where(np.abs(offsets) <= 1e-13, 0.0, offsets)
        sizes = np.linalg.norm(normals, axis=1)
        return Halfspaces(normals / sizes[:, None], offsets / sizes, is_empty)

    def line(self, direction: np.ndarray) -> tuple[float, float]:
        """Return the least and the largest s with s times direction in the set, by linear programs.

        Both are attained to 1e-10 of the full effort and proved by the dual multipliers to 1e-7; NaN
        where the line misses the set. Works for any number of rows and actuators.

        Raises
        ------
        AllocationError
            For a direction of zero length or wrong shape, or an answer that its dual does not prove.
        """
        direction = np.asarray(direction, dtype=float)
        if direction.shape != self.centre.shape or not np.all(np.isfinite(direction)) or not np.any(direction):
            raise AllocationError(
                f"direction {direction} is not {len(self.centre)} finite numbers that are not all zero"
            )
        return 0.0 - self._largest(-direction), self._largest(direction)

    def _largest(self, direction: np.ndarray) -> float:
        from scipy.optimize import linprog

        unit = np.abs(direction / self.scale).max()
        step = direction / self.scale / unit
        matrix = np.vstack([self.generators / self.scale[:, None], self.tie])
        left = np.column_stack([matrix, np.concatenate([-step, np.zeros(len(self.tie))])])
        right = -np.concatenate([self.centre / self.scale, self.tie_centre])
        cost = np.zeros(left.shape[1])
        cost[-1] = -1.0
        bounds = [(-1.0, 1.0)] * (left.shape[1] - 1) + [(None, None)]
        found = linprog(cost, A_eq=left, b_eq=right, bounds=bounds, method="highs", options=TOLERANCES)
        if found.status == 2:
            return float("nan")
        if found.status != 0:
            raise AllocationError(f"the linear program along {direction} failed: {found.message}")
        reach = float(found.x[-1])
        dual = found.eqlin.marginals / -(found.eqlin.marginals @ left[:, -1])
        bound = np.abs(dual @ matrix).sum() - dual @ right
        if not abs(bound - reach) <= _LP_TOLERANCE * max(1.0, abs(reach)):
            raise AllocationError(
                f"along {direction} the linear program gives {reach}, its dual {bound}; rescale the data"
            )
        return 0.0 if abs(reach) <= _TINY else float(reach / unit)


def _ratios(top: np.ndarray, bottom: np.ndarray, where_zero: np.ndarray) -> np.ndarray:
    """Return top/bottom; where bottom is 0, infinity with the sign of `where_zero` (a box that is flat there)."""
    safe = np.where(bottom > 0, bottom, 1.0)
    return np.where(bottom > 0, top / safe, np.where(where_zero < 0, -np.inf, np.inf))


def _faces(generators: np.ndarray, centre: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return unit normals (M, m) and offsets (M,) of a zonotope in m dimensions, of any rank."""
    basis, sizes, _ = np.linalg.svd(generators, full_matrices=True)
    rank = int(np.sum(sizes > _TINY * max(sizes.max(initial=0.0), 1e-300)))
    inside, outside = basis[:, :rank], basis[:, rank:]
    spanned = inside.T @ generators
    lengths = np.linalg.norm(spanned, axis=0)
    units = (spanned / np.where(lengths > 0, lengths, 1.0))[:, lengths > _TINY * lengths.max(initial=0.0)]
    local = _orthogonal(units) if rank else np.zeros((0, 0))
    normals = np.vstack([local @ inside.T, outside.T])
    normals = np.vstack([normals, -normals])
    return normals, np.abs(normals @ generators)[:, lengths > 0].sum(axis=1) + normals @ centre


def _orthogonal(units: np.ndarray) -> np.ndarray:
    """Return the unit normals to every r - 1 independent ones of N unit vectors in r dimensions, (M, r)."""
    rank, count = units.shape
    if rank == 1:
        return np.ones((1, 1))
    subsets = comb(count, rank - 1)
    if subsets > MOST_SUBSETS:
        raise AllocationError(
            f"{count} actuators in {rank} dimensions have {subsets} candidate faces, more than {MOST_SUBSETS}: no "
            "sphere, samples or slices; the largest box and the margins, by linear programs, remain"
        )
    chosen = np.array(list(combinations(range(count), rank - 1)))
    spans = units[:, chosen].transpose(1, 0, 2)
    left, sizes, _ = np.linalg.svd(spans)
    return left[sizes[:, -1] > _TINY, :, -1]
