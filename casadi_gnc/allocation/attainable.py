"""What the actuators can make: largest box, inscribed sphere and margins of three attainable sets.

With B_v = A + D_v E the effectiveness at vertex v of the uncertainty, B_0 = A, and F within its bounds:

================  ==========================================  =========================================
name here         set                                         what it means for a command u in it
================  ==========================================  =========================================
nominal           {A F}                                       can be made if the geometry is as believed
each_vertex       intersection over v of {B_v F}              can be made at every vertex, but by forces
                                                              that depend on the error nobody knows
common_forces     {u : B_v F = u for all v, one F}            can be made exactly without knowing the
                  = {A F : D_v E F = 0 for all v}             error, by one F for the whole uncertainty
================  ==========================================  =========================================

The nominal geometry counts among the v (D_0 = 0), so each set contains the next; where the errors do
not surround zero the last two sets are the smaller for it: centre `effectiveness` in its uncertainty.

**Why the inside of the uncertainty is sampled.** The support function of {B F} along n is, with
middle c and half-widths w of the bounds, h(n, D) = n.B c + sum_i w_i |n.B e_i|, B = A + D E. It is
*convex* in D: its maximum lies at a vertex of the uncertainty, its minimum need not, and the reach
of the intersection over all D is set by that minimum. In one dimension with A = 0, D = +-1, E = 1 and
|F| <= 1, both vertices make [-1, 1] and the middle of the uncertainty makes nothing. So `each_vertex` is
only an upper bound for the whole uncertainty; `sampled` lowers that bound, and `common_forces` is the
lower bound: B_v F = u for all v is linear in D_v, hence holds for every mixture of vertices.

**The origin may be outside**, where actuators cannot be shut (lower > 0) or a stuck one pushes. Then no
box or sphere about it is attainable; the number given is negative: minus the size at which the box
(for the sphere: the cube) about the origin first touches the set.

Source: Durham (1993), doi:10.2514/3.21072 (attainable sets); Huang, Biggs, Duan (2020), eqs (57)-(62),
doi:10.1016/j.ast.2019.105572, whose +-1.5e-3 N m box is not attainable: the nominal cube is +-5.16e-4.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import comb
from typing import Any

import numpy as np

from casadi_gnc.allocation.attainable_sets import (
    AttainableSet,
    SetKind,
    attainable_sets,
    bounds_of,
    half_widths,
    overlap,
)
from casadi_gnc.allocation.problem import AllocationProblem
from casadi_gnc.allocation.reach import Attainable, Reach
from casadi_gnc.allocation.zonotope import Zonotope
from casadi_gnc.errors import AllocationError
from casadi_gnc.mathematics.arrays import real_array

#: Most subsets of actuators looked at over all samples; some seconds of work.
_MOST_WORK = 300_000


def attainable(
    problem: AllocationProblem,
    wanted: Any = None,
    *,
    directions: Any = None,
    samples: int = 200,
    seed: int = 0,
    previous: Any = None,
    units: Sequence[str] | None = None,
) -> Attainable:
    """Return largest box, inscribed spheres and margins of the three attainable sets.

    Parameters
    ----------
    wanted : (R,) or one number, half-widths of a virtual-control box [effort]; its proportions are those of
        the largest box. Left out: a cube, of rows of several kinds one cube a kind, in proportion to the
        least reach along an axis of the nominal geometry: no length is both a force and a torque.
    directions : (K, R), for the margins; left out: the R axes.
    samples : how many points inside the uncertainty to try; mixtures of its vertices with
        Dirichlet weights, half of them crowded towards faces and edges.
    seed : of the samples.
    previous : (N,), see `attainable_sets`.
    units : of the R rows, "N m"; rows of one unit are of one kind, and each kind has a sphere of its own.

    Raises
    ------
    AllocationError
        For a wrong shape, sign or count.

    Examples
    --------
    >>> import numpy as np
    >>> problem = AllocationProblem(np.diag([1.0, 2.0]), lower=-1.0, upper=1.0)
    >>> found = attainable(problem, wanted=2.0, units=("N m", "N m"))
    >>> found.nominal.box.tolist(), found.sentences()[0]
    ([1.0, 1.0], 'the box ±2 N m is not attainable with the nominal geometry: \
the largest box of its proportions is 50 % of it')
    """
    rows = len(problem.effectiveness)
    if samples < 0:
        raise AllocationError(f"samples is {samples}, expected 0 or more")
    told = ("",) * rows if units is None else tuple(units)
    if len(told) != rows:
        raise AllocationError(f"units has {len(told)} entries, expected {rows}, one a row")
    box = None if wanted is None else half_widths(wanted, rows)
    along = np.eye(rows) if directions is None else np.atleast_2d(real_array("directions", directions, AllocationError))
    sets = attainable_sets(problem, previous=previous)
    shape = _cubes(sets[0], told) if box is None else box
    notes: list[str] = []
    nominal, vertices, common = (_reach(one, shape, along, told, notes) for one in sets)
    drawn = samples if problem.is_robust and not any(np.isnan(each) for each in nominal.spheres.values()) else 0
    affordable = max(1, _MOST_WORK // comb(problem.count, min(rows, problem.count) - 1))
    if drawn > affordable:
        notes.append(
            f"{affordable} samples of the uncertainty were tried instead of {drawn}: that many faces take long"
        )
        drawn = affordable
    inside = _sampled(problem, sets[1], shape, along, told, drawn, seed, previous) if drawn else None
    return Attainable(box, along, nominal, vertices, common, inside, drawn, seed, told, tuple(dict.fromkeys(notes)))


def _cubes(one: AttainableSet, units: tuple[str, ...]) -> np.ndarray:
    """Return the proportions of a box that is a cube in the rows of each kind, (R,)."""
    if len(set(units)) == 1:
        return np.ones(len(units))
    axes = np.array([one.line(axis) for axis in np.eye(len(units))])
    reach = np.nan_to_num(np.minimum(-axes[:, 0], axes[:, 1])).clip(0)
    least = np.array([min(reach[row] for row, each in enumerate(units) if each == unit) for unit in units])
    return least if least.any() else np.ones(len(units))


def _reach(one: AttainableSet, shape: np.ndarray, along: np.ndarray, units: tuple[str, ...], notes: list[str]) -> Reach:
    size, lines = one.box(shape), np.array([one.line(direction) for direction in along])
    try:
        spheres = _spheres(one, units)
    except AllocationError as error:
        notes.append(str(error))
        spheres = dict.fromkeys(units, float("nan"))
    return Reach(one.kind, _widths(size, shape), spheres, lines, bool(np.isnan(size)), units)


def _spheres(one: AttainableSet, units: tuple[str, ...]) -> dict[str, float]:
    """Return the radius for each kind of row, by its unit."""
    rows = {unit: [row for row, each in enumerate(units) if each == unit] for unit in units}
    return {unit: one.sphere(own if len(rows) > 1 else slice(None)) for unit, own in rows.items()}


def _sampled(
    problem: AllocationProblem,
    vertices: AttainableSet,
    shape: np.ndarray,
    along: np.ndarray,
    units: tuple[str, ...],
    samples: int,
    seed: int,
    previous: Any,
) -> Reach:
    """Return the reach of the intersection over the vertices and points inside the uncertainty, from faces."""
    bounds = bounds_of(problem, previous)
    rng = np.random.default_rng(seed)
    parts = list(vertices.parts)
    for sample in range(samples):
        weights = rng.dirichlet(np.full(len(problem.errors), 0.2 if sample % 2 else 1.0))
        matrix = problem.effectiveness + np.tensordot(weights, problem.errors, 1) @ problem.coupling
        parts.append(Zonotope.of_box(matrix, *bounds))
    one = AttainableSet(SetKind.SAMPLED, tuple(parts))
    lines = [overlap([part.halfspaces.line(direction) for part in parts]) for direction in along]
    size = one.box_of_faces(shape)
    widths = _widths(size, shape)
    return Reach(one.kind, widths, _spheres(one, units), np.array(lines), bool(np.isnan(size)), units)


def _widths(size: float, shape: np.ndarray) -> np.ndarray:
    """Return the half-widths; an axis of no width keeps none, however far away the set is."""
    return np.where(shape > 0, size * np.where(shape > 0, shape, 1.0), size if np.isnan(size) else 0.0)
