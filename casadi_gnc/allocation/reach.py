"""What `attainable` answers: how far each set reaches, in numbers and sentences, each row in its own unit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from casadi_gnc.allocation.attainable_sets import SetKind
from casadi_gnc.errors import AllocationError


@dataclass(frozen=True, eq=False)
class Reach:
    """Hold how far one set reaches; K directions, R rows of effort.

    Parameters
    ----------
    kind : which set.
    box : (R,), half-widths of the largest box of the proportions asked for [effort]; negative where
        the origin is outside, NaN for an empty set.
    spheres : for each kind of row, by its unit: radius of the largest sphere about the origin of these rows, the
        others at zero, sign as `box`; NaN too where there are too many faces to list.
    lines : (K, 2), least and largest s with s times the direction attainable; NaN where the line misses.
    is_empty : whether no effort at all is attainable in this sense.
    """

    kind: SetKind
    box: np.ndarray
    spheres: Mapping[str, float]
    lines: np.ndarray
    is_empty: bool
    units: tuple[str, ...]

    @property
    def sphere(self) -> float:
        """The radius where all rows are of one kind; NaN where they are not, as no sphere has two units."""
        return next(iter(self.spheres.values())) if len(self.spheres) == 1 else float("nan")

    @property
    def margins(self) -> np.ndarray:
        """Largest s along every direction, (K,); negative where only the opposite side is attainable."""
        return self.lines[:, 1]

    @property
    def holds_origin(self) -> bool:
        """Whether the actuators can make zero effort in this sense."""
        return bool(np.all(self.box >= 0))

    def sentence(self) -> str:
        """Return one line for the reader."""
        if self.is_empty:
            return f"{self.kind.value}: no effort at all is attainable"
        if not self.holds_origin:
            near = f"a box must grow to ±{_list(-self.box, self.units)} to touch what is"
            return f"{self.kind.value}: not even zero effort is attainable; {near}"
        if not np.any(self.box):
            return f"{self.kind.value}: no box about zero is attainable (zero is on the boundary, or the set is flat)"
        return f"{self.kind.value}: the largest box is ±{_list(self.box, self.units)}"

    def along(self, directions: np.ndarray) -> str:
        """Return one line on spheres and reach along directions, (K, R)."""
        balls = ", ".join(f"{radius:.3g} {unit}".rstrip() for unit, radius in self.spheres.items())
        axes = ", ".join(
            f"{low:.3g} to {high:.3g} {_unit_along(direction, self.units)}".rstrip()
            for (low, high), direction in zip(self.lines, directions, strict=True)
        )
        spheres = "spheres of" if len(self.spheres) > 1 else "sphere"
        return f"{self.kind.value}: {spheres} {balls}; along the axes {axes}"

    def summary(self) -> dict[str, Any]:
        """Return plain numbers for JSON; what does not exist is None."""
        return {
            "meaning": self.kind.value,
            "is_empty": self.is_empty,
            "holds_origin": self.holds_origin,
            "box": _plain(self.box),
            "sphere": _plain(self.sphere),
            "spheres": {unit: _plain(radius) for unit, radius in self.spheres.items()},
            "lines": _plain(self.lines),
        }


@dataclass(frozen=True, eq=False)
class Attainable:
    """Hold what `attainable` found; every number in the unit of its row of effort.

    Parameters
    ----------
    wanted : (R,), half-widths of the virtual-control box asked about, or None.
    directions : (K, R), of the margins.
    nominal, each_vertex, common_forces : the three sets, each inside the one before.
    sampled : least values over the vertices *and* `samples` points inside the uncertainty: still an upper
        bound for the whole uncertainty, of which `common_forces` is the lower. None without uncertainty.
    samples, seed : how many points were drawn, and from which seed.
    units : of the rows; "" where nobody said.
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
    units: tuple[str, ...]
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

    def sentences(self) -> tuple[str, ...]:
        """Return the verdict on the wanted box, then one line per set, then the notes."""
        lines = []
        if self.wanted is not None:
            share = self.shares()[SetKind.NOMINAL]
            verdict = "is" if share >= 1 else "is not"
            why = f"the largest box of its proportions is {100 * share:.3g} % of it"
            why = why if share >= 0 else "not even zero effort is"
            box = _list(self.wanted, self.units)
            lines.append(f"the box ±{box} {verdict} attainable with the nominal geometry: {why}")
        return (*lines, *(reach.sentence() for reach in self.reaches), *self.notes)

    def summary(self) -> dict[str, Any]:
        """Return plain numbers and sentences for JSON."""
        shares = None
        if self.wanted is not None:
            shares = {kind.name.lower(): _plain(share) for kind, share in self.shares().items()}
        return {
            "wanted": None if self.wanted is None else _plain(self.wanted),
            "share_of_wanted": shares,
            "units": list(self.units),
            "directions": _plain(self.directions),
            "sets": {reach.kind.name.lower(): reach.summary() for reach in self.reaches},
            "samples": self.samples,
            "seed": self.seed,
            "sentences": list(self.sentences()),
        }


def _list(values: np.ndarray, units: tuple[str, ...]) -> str:
    """Return numbers with their units: one where all are the same, else each kind in parentheses."""
    told = []
    for unit in dict.fromkeys(units):
        texts = [f"{value:.3g}" for value, each in zip(values, units, strict=True) if each == unit]
        numbers = texts[0] if len(set(texts)) == 1 else "(" + ", ".join(texts) + ")"
        told.append(f"{numbers} {unit}".rstrip())
    return ", ".join(told)


def _unit_along(direction: np.ndarray, units: tuple[str, ...]) -> str:
    """Return the unit of a multiple of a direction; none where it mixes kinds."""
    own = {unit for part, unit in zip(direction, units, strict=True) if part}
    return own.pop() if len(own) == 1 else ""


def _plain(values: Any) -> Any:
    """Return nested lists of numbers; what is not finite becomes None."""
    if np.ndim(values):
        return [_plain(value) for value in values]
    return float(values) if np.isfinite(values) else None
