"""The three attainable sets of an allocation problem, as intersections of zonotopes.

`casadi_gnc.allocation.attainable` says what each means, and why they must not be confused.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np

from casadi_gnc.allocation.problem import AllocationProblem
from casadi_gnc.allocation.zonotope import TOLERANCES, Zonotope
from casadi_gnc.errors import AllocationError
from casadi_gnc.mathematics.arrays import real_array


class SetKind(Enum):
    """Which set is meant; the value is the phrase for the reader."""

    NOMINAL = "with the nominal geometry"
    EACH_VERTEX = "with forces of its own for each vertex of the uncertainty"
    COMMON_FORCES = "with one set of forces for the whole uncertainty"
    SAMPLED = "with forces of its own for each vertex and each sample of the uncertainty"


@dataclass(frozen=True, eq=False)
class AttainableSet:
    """Hold an intersection of zonotopes, sliced or not; all its methods are exact to rounding.

    Parameters
    ----------
    kind : which set.
    parts : the zonotopes, each in the R dimensions of the effort.
    """

    kind: SetKind
    parts: tuple[Zonotope, ...]

    def line(self, direction: Any) -> tuple[float, float]:
        """Return the least and the largest s with s times direction attainable, NaN where there is none."""
        return overlap([part.line(np.asarray(direction, dtype=float)) for part in self.parts])

    def box(self, proportions: Any) -> float:
        """Return the largest s for which every u with |u_i| <= s p_i is attainable, by linear programs.

        The set is convex, so the corners decide. Negative where the origin is outside: the box first
        touches the set at -s. NaN where the set is empty.

        Parameters
        ----------
        proportions : p, (R,), non-negative, not all zero; in the unit of the effort s is a pure number.
        """
        p = half_widths(proportions, len(self.parts[0].centre))
        # Opposite corners share a line.
        signs = [s for s in product((1.0, -1.0), repeat=len(p)) if s[0] > 0]
        lines = np.array([self.line(corner) for corner in np.unique(np.array(signs) * p, axis=0)])
        return self._signed(np.min(np.minimum(lines[:, 1], -lines[:, 0])), p)

    def box_of_faces(self, proportions: Any) -> float:
        """Return the same as `box` from the faces: faster for many parts, impossible for too many actuators."""
        p = half_widths(proportions, len(self.parts[0].centre))
        return self._signed(np.min([part.halfspaces.box(p) for part in self.parts]), p)

    def sphere(self, rows: Any = slice(None)) -> float:
        """Return the radius of the largest sphere about the origin, from the faces, in the plane of some rows.

        These share one unit; the others stay zero.

        Negative where the origin is outside: minus the largest component of the nearest effort, a lower
        bound of the distance. NaN: the set is empty.

        Raises
        ------
        AllocationError
            Where a part has too many faces to list.
        """
        radius = np.min([part.halfspaces.sphere(rows) for part in self.parts])
        shape = np.zeros(len(self.parts[0].centre))
        shape[rows] = 1.0
        return self._signed(radius, shape)

    def _signed(self, size: Any, proportions: np.ndarray) -> float:
        """Return a size, or what there is to say where the origin is not in the set (size negative or NaN)."""
        if size >= 0:
            return float(size) + 0.0
        return float("nan") if self.is_empty else 0.0 - self._distance(proportions)

    @cached_property
    def is_empty(self) -> bool:
        """Whether no effort at all is in the set."""
        return bool(np.isinf(self._distance(np.ones(len(self.parts[0].centre)))))

    def _distance(self, proportions: np.ndarray) -> float:
        """Return the least s for which the box |u_i| <= s p_i touches the set; infinity for never.

        One linear program in the t of every part, the effort u they share, and s.
        """
        from scipy import sparse
        from scipy.optimize import linprog

        rows, scale = len(proportions), self.parts[0].scale
        unit = (proportions / scale).max()
        shape = (proportions / scale / unit)[:, None]
        lines, right = [], []
        for k, part in enumerate(self.parts):
            line: list[Any] = [None] * (len(self.parts) + 2)
            line[k] = sparse.csr_array(np.vstack([part.generators / scale[:, None], part.tie]))
            line[-2] = sparse.csr_array(np.vstack([-np.eye(rows), np.zeros((len(part.tie), rows))]))
            line[-1] = sparse.csr_array((rows + len(part.tie), 1))
            lines.append(line)
            right += [-part.centre / scale, -part.tie_centre]
        equal = sparse.block_array(lines, format="csr")
        moves = sum(part.generators.shape[1] for part in self.parts)
        both = np.vstack([np.eye(rows), -np.eye(rows)])
        below = sparse.hstack([sparse.csr_array((2 * rows, moves)), both, -np.vstack([shape, shape])], format="csr")
        bounds = [(-1.0, 1.0)] * moves + [(None, None)] * rows + [(0.0, None)]
        cost = np.zeros(moves + rows + 1)
        cost[-1] = 1.0
        found = linprog(
            cost, below, np.zeros(2 * rows), equal, np.concatenate(right), bounds, method="highs", options=TOLERANCES
        )
        if found.status not in (0, 2):
            raise AllocationError(f"the linear program of the distance to the attainable set failed: {found.message}")
        return float(found.x[-1]) / unit if found.status == 0 else float("inf")


def attainable_sets(
    problem: AllocationProblem, *, previous: Any = None
) -> tuple[AttainableSet, AttainableSet, AttainableSet]:
    """Return the nominal, the each-vertex and the common-forces set of a problem.

    Parameters
    ----------
    previous : forces of the previous sample, (N,) [N], for the set of one sample within amplitude
        *and* rate bounds; left out, the amplitude bounds alone.
    """
    bounds = bounds_of(problem, previous)
    nominal = Zonotope.of_box(problem.effectiveness, *bounds)
    changes = np.unique(problem.errors @ problem.coupling, axis=0)
    changes = changes[np.any(changes, axis=(1, 2))]
    vertices = tuple(Zonotope.of_box(problem.effectiveness + change, *bounds) for change in changes)
    tie = changes.reshape(-1, problem.count)
    return (
        AttainableSet(SetKind.NOMINAL, (nominal,)),
        AttainableSet(SetKind.EACH_VERTEX, (nominal, *vertices)),
        AttainableSet(SetKind.COMMON_FORCES, (Zonotope.of_box(problem.effectiveness, *bounds, tie),)),
    )


def bounds_of(problem: AllocationProblem, previous: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return the bounds of the amplitude, or of one sample after `previous`, checked."""
    if previous is None:
        return problem.lower, problem.upper
    forces = real_array("previous", previous, AllocationError)
    if forces.shape != (problem.count,) or not np.all(np.isfinite(forces)):
        raise AllocationError(f"previous has shape {forces.shape}, expected {problem.count} finite forces")
    return problem.box(forces)


def half_widths(value: Any, rows: int) -> np.ndarray:
    """Return the half-widths of a box, (rows,), from numbers or one for all, checked."""
    array = real_array("half_widths", value, AllocationError)
    array = np.full(rows, float(array)) if array.ndim == 0 else array
    if array.shape != (rows,) or not np.all(np.isfinite(array)) or np.any(array < 0) or not np.any(array):
        raise AllocationError(f"a box of half-widths {array} is not {rows} non-negative numbers with one above zero")
    return array


def overlap(lines: list[Any]) -> tuple[float, float]:
    """Return the intersection of intervals, NaN for none."""
    least, largest = np.max([line[0] for line in lines]), np.min([line[1] for line in lines])
    slack = 1e-9 * max(abs(least), abs(largest))
    return (float(least), float(largest)) if least <= largest + slack else (float("nan"), float("nan"))
