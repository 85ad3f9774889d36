"""Requirements over signals in the tally of a flight, so that no sample of it needs to be kept.

A formula goes into the tally where what it needs to keep is little: `always` and `eventually` of conditions on one
sample, `until` of such, and what and, or and not make of these, take a number or two each; `held` takes one for every
sample of its length. What looks ahead inside another condition over time is judged when the flight is over, from the
margins of its comparisons at every sample.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import casadi as ca
import numpy as np

from casadi_gnc.errors import RequirementError
from casadi_gnc.missions.requirements import evaluating
from casadi_gnc.missions.requirements.requirement import Requirement, Verdict, margins_of, unbounded
from casadi_gnc.missions.requirements.weaving import Woven, weave
from casadi_gnc.signals import Layout, Signal

#: Numbers of delay lines that a tally carries for one requirement at most; each is copied at every sample.
_MOST_KEPT = 64


@dataclass(frozen=True, eq=False)
class Watch:
    """A requirement in the tally.

    Parameters
    ----------
    requirement : with a formula.
    name : of its place in the tally.
    unit : of its robustness.
    initial : the place before the first sample; its first number is the robustness so far.
    step : (row, kept) -> kept.
    """

    requirement: Requirement
    name: str
    unit: str
    initial: tuple[float, ...]
    step: ca.Function

    @property
    def signal(self) -> Signal:
        """The place in the tally."""
        return Signal(self.name, len(self.initial))

    def read(self, tally: np.ndarray) -> np.ndarray:
        """Return the robustness, (...), in this place of tallies, (..., size); +-inf where nothing bounds it."""
        return np.vectorize(unbounded, otypes=[float])(tally[..., 0])


def watches(requirements: Sequence[Requirement], row: Layout, period: float) -> tuple[Watch, ...]:
    """Return those requirements that go into the tally of a flight.

    Parameters
    ----------
    requirements : of a mission.
    row : what is recorded of a sample, with its `time`.
    period : from sample to sample [s].
    """
    found = (_watch(one, f"requirement_{i}", row, period) for i, one in enumerate(requirements) if one.formula)
    return tuple(watch for watch in found if watch is not None)


def _watch(requirement: Requirement, name: str, row: Layout, period: float) -> Watch | None:
    sample = row.symbol("row")
    bound = requirement.bind(row, sample, period)
    try:
        woven = weave(bound, ca.floor(row.split(sample).time / period + 0.5))
    except RequirementError:
        return None
    if woven.delay or woven.kept > _MOST_KEPT:
        return None
    cells = _cells(woven)
    now, later = ca.vertcat(*(cell[0] for cell in cells)), ca.vertcat(*(cell[1] for cell in cells))
    step = ca.Function("watch", [sample, now], [ca.densify(later)], ["row", "kept"], ["later"])
    return Watch(requirement, name, bound.unit, tuple(cell[2] for cell in cells), step)


def _cells(woven: Woven) -> list[tuple[ca.SX, ca.SX, float]]:
    """Return each number that is kept: now, later, before the first sample. The first is the robustness."""
    cells = [(one.now, one.later, one.initial) for one in woven.registers]
    for line in woven.lines:
        shifted = [*(ca.SX.sym("line") for _ in range(line.samples - 1)), line.past]
        cells += [(own, given, 0.0) for own, given in zip(shifted, [line.value, *shifted], strict=False)]
    if len(woven.registers) == 1:  # it is the robustness
        return cells
    return [(ca.SX.sym("robustness"), woven.robustness, 0.0), *cells]


@dataclass(eq=False)
class Judge:
    """Judge a formula that is not in the tally, from every sample of a flight.

    Parameters
    ----------
    requirement : with a formula.
    row, period : as for `watches`.
    """

    requirement: Requirement
    row: Layout
    period: float
    _taken: list[np.ndarray] = field(default_factory=list)

    def __post_init__(self) -> None:
        column = self.row.symbol("row")
        self._bound = self.requirement.bind(self.row, column, self.period)
        self._margins = margins_of(self._bound, self.row, column)

    def forget(self) -> None:
        """Forget all samples, for another flight."""
        self._taken.clear()

    def take(self, rows: np.ndarray) -> None:
        """Note the next samples, (K, columns)."""
        self._taken.append(self._margins(rows))

    def verdict(self) -> Verdict:
        """Return what follows from the samples that were noted."""
        margins = np.hstack(self._taken)
        found = evaluating.robustness(self._bound.tree, margins)[0]
        return Verdict(self.requirement, unbounded(found), self._bound.unit)
