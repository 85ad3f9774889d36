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

from dataclasses import dataclass
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
from casadi_gnc.allocation.zonotope import Zonotope
from casadi_gnc.errors import AllocationError

#: Most subsets of actuators looked at over all samples; some seconds of work.
_MOST_WORK = 300_000


@dataclass(frozen=True, eq=False)
class Reach:
    """Hold how far one set reaches; K directions, R rows of effort.

    Parameters
    ----------
    kind : which set.
    box : (R,), half-widths of the largest box of the proportions asked for [effort]; negative where
        the origin is outside, NaN for an empty set.
    sphere : radius of the largest sphere about the origin [effort], sign as `box`; NaN too where there are
        too many faces to list.
    lines : (K, 2), least and largest s with s times the direction attainable; NaN where the line misses.
    is_empty : whether no effort at all is attainable in this sense.
    """

    kind: SetKind
    box: np.ndarray
    sphere: float
    lines: np.ndarray
    is_empty: bool

    @property
    def margins(self) -> np.ndarray:
        """Largest s along every direction, (K,); negative where only the opposite side is attainable."""
        return self.lines[:, 1]

    @property
    def holds_origin(self) -> bool:
        """Whether the actuators can make zero effort in this sense."""
        return bool(np.all(self.box >= 0))

    def sentence(self, unit: str = "N m") -> str:
        """Return one line for the reader."""
        if self.is_empty:
            return f"{self.kind.value}: no effort at all is attainable"
        if not self.holds_origin:
            near = f"a box must grow to ±{_list(-self.box)} {unit} to touch what is"
            return f"{self.kind.value}: not even zero effort is attainable; {near}"
        if not np.any(self.box):
            return f"{self.kind.value}: no box about zero is attainable (zero is on the boundary, or the set is flat)"
        return f"{self.kind.value}: the largest box is ±{_list(self.box)} {unit}"

    def summary(self) -> dict[str, Any]:
        """Return plain numbers for JSON; what does not exist is None."""
        return {
            "meaning": self.kind.value,
            "is_empty": self.is_empty,
            "holds_origin": self.holds_origin,
            "box": _plain(self.box),
            "sphere": _plain(self.sphere),
            "lines": _plain(self.lines),
        }


@dataclass(frozen=True, eq=False)
class Attainable:
    """Hold what `attainable` found; every number in the unit of the effort (for torque [N m]).

    Parameters
    ----------
    wanted : (R,), half-widths of the virtual-control box asked about, or None.
    directions : (K, R), of the margins.
    nominal, each_vertex, common_forces : the three sets, each inside the one before.
    sampled : least values over the vertices *and* `samples` points inside the uncertainty: still an upper
        bound for the whole uncertainty, of which `common_forces` is the lower. None without uncertainty.
    samples, seed : how many points were drawn, and from which seed.
    notes : sentences on what could not be computed.
    """

    wanted: np.ndarray | None
    directions: np.ndarray
    nominal: Reach
    each_vertex: Reach
    common_forces: Reach
    sampled: Reach | None
    samples: int
    seed: int
    notes: tuple[str, ...] = ()

    @property
    def reaches(self) -> tuple[Reach, ...]:
        """All sets, the largest first."""
        return tuple(r for r in (self.nominal, self.each_vertex, self.sampled, self.common_forces) if r is not None)

    def shares(self) -> dict[SetKind, float]:
        """Return the attainable share of the wanted box in every set: 1 or more where it is attainable."""
        if self.wanted is None:
            raise AllocationError("no virtual-control box was asked about; give `wanted`")
        axis = int(np.argmax(self.wanted))
        return {reach.kind: float(reach.box[axis] / self.wanted[axis]) for reach in self.reaches}

    def sentences(self, unit: str = "N m") -> tuple[str, ...]:
        """Return the verdict on the wanted box, then one line per set, then the notes."""
        lines = []
        if self.wanted is not None:
            share = self.shares()[SetKind.NOMINAL]
            verdict = "is" if share >= 1 else "is not"
            why = f"the largest box of its proportions is {100 * share:.3g} % of it"
            why = why if share >= 0 else "not even zero effort is"
            lines.append(f"the box ±{_list(self.wanted)} {unit} {verdict} attainable with the nominal geometry: {why}")
        return (*lines, *(reach.sentence(unit) for reach in self.reaches), *self.notes)

    def summary(self) -> dict[str, Any]:
        """Return plain numbers and sentences for JSON."""
        shares = None
        if self.wanted is not None:
            shares = {kind.name.lower(): _plain(share) for kind, share in self.shares().items()}
        return {
            "wanted": None if self.wanted is None else _plain(self.wanted),
            "share_of_wanted": shares,
            "directions": _plain(self.directions),
            "sets": {reach.kind.name.lower(): reach.summary() for reach in self.reaches},
            "samples": self.samples,
            "seed": self.seed,
            "sentences": list(self.sentences()),
        }


def attainable(
    problem: AllocationProblem,
    wanted: Any = None,
    *,
    directions: Any = None,
    samples: int = 200,
    seed: int = 0,
    previous: Any = None,
) -> Attainable:
    """Return largest box, inscribed sphere and margins of the three attainable sets.

    Parameters
    ----------
    wanted : (R,) or one number, half-widths of a virtual-control box [effort]; its proportions are those of
        the largest box. Left out: a cube.
    directions : (K, R), for the margins; left out: the R axes.
    samples : how many points inside the uncertainty to try; mixtures of its vertices with
        Dirichlet weights, half of them crowded towards faces and edges.
    seed : of the samples.
    previous : (N,), see `attainable_sets`.

    Raises
    ------
    AllocationError
        For a wrong shape, sign or count.

    Examples
    --------
    >>> import numpy as np
    >>> problem = AllocationProblem(np.diag([1.0, 2.0]), lower=-1.0, upper=1.0)
    >>> found = attainable(problem, wanted=2.0)
    >>> found.nominal.box.tolist(), found.sentences()[0]
    ([1.0, 1.0], 'the box ±2 N m is not attainable with the nominal geometry: \
the largest box of its proportions is 50 % of it')
    """
    rows = len(problem.effectiveness)
    if samples < 0:
        raise AllocationError(f"samples is {samples}, expected 0 or more")
    box = None if wanted is None else half_widths(wanted, rows)
    shape = np.ones(rows) if box is None else box
    along = np.eye(rows) if directions is None else np.atleast_2d(np.asarray(directions, dtype=float))
    sets = attainable_sets(problem, previous=previous)
    notes: list[str] = []
    nominal, vertices, common = (_reach(one, shape, along, notes) for one in sets)
    drawn = samples if problem.is_robust and not np.isnan(nominal.sphere) else 0
    affordable = max(1, _MOST_WORK // comb(problem.count, min(rows, problem.count) - 1))
    if drawn > affordable:
        notes.append(
            f"{affordable} samples of the uncertainty were tried instead of {drawn}: that many faces take long"
        )
        drawn = affordable
    inside = _sampled(problem, sets[1], shape, along, drawn, seed, previous) if drawn else None
    return Attainable(box, along, nominal, vertices, common, inside, drawn, seed, tuple(dict.fromkeys(notes)))


def _reach(one: AttainableSet, shape: np.ndarray, along: np.ndarray, notes: list[str]) -> Reach:
    size, lines = one.box(shape), np.array([one.line(direction) for direction in along])
    try:
        sphere = one.sphere()
    except AllocationError as error:
        notes.append(str(error))
        sphere = float("nan")
    return Reach(one.kind, _widths(size, shape), sphere, lines, bool(np.isnan(size)))


def _sampled(
    problem: AllocationProblem,
    vertices: AttainableSet,
    shape: np.ndarray,
    along: np.ndarray,
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
    return Reach(one.kind, _widths(size, shape), one.sphere(), np.array(lines), bool(np.isnan(size)))


def _widths(size: float, shape: np.ndarray) -> np.ndarray:
    """Return the half-widths; an axis of no width keeps none, however far away the set is."""
    return np.where(shape > 0, size * np.where(shape > 0, shape, 1.0), size if np.isnan(size) else 0.0)


def _list(values: np.ndarray) -> str:
    texts = [f"{value:.3g}" for value in values]
    return texts[0] if len(set(texts)) == 1 else "(" + ", ".join(texts) + ")"


def _plain(values: Any) -> Any:
    """Return nested lists of numbers; what is not finite becomes None."""
    if np.ndim(values):
        return [_plain(value) for value in values]
    return float(values) if np.isfinite(values) else None
