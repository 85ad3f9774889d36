"""The flights of a search: of several builds, remembered, counted, within a budget."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from casadi_gnc.errors import GncError
from casadi_gnc.missions.parameters import Varied
from casadi_gnc.tuning.journal import Journal
from casadi_gnc.tuning.objective import Objective, differences
from casadi_gnc.tuning.space import Space

#: What a flight there and back costs, in flights (`tests/bench/sensitivity_speed.py`: 2.7 to 3.1).
THERE_AND_BACK = 4
#: Called as told(flights, flights at most).
Told = Callable[[int, int], None]


class SpentError(Exception):
    """End a search whose budget does not allow the next flights; never seen outside of it."""


@dataclass(eq=False)
class Build:
    """Hold a mission that a search flies.

    Parameters
    ----------
    make : returns what flies it, when it is first flown.
    changes : of the file, by path.
    """

    make: Callable[[], Objective]
    changes: dict[str, Any] = field(default_factory=dict)
    #: Why it cannot fly, "" where it can or was not asked yet.
    why: str = ""
    _made: Objective | None = None

    @property
    def objective(self) -> Objective:
        """What flies it; raise `GncError` where it cannot fly."""
        if self._made is None:
            self._made = self.make()
        return self._made

    def at(self, rows: np.ndarray) -> np.ndarray:
        """Return the numbers of flights, (n,), NaN where there are none."""
        if not self.why:
            try:
                return self._at(rows)
            except GncError as error:
                if self._made is not None:
                    raise
                self.why = str(error)
        return np.full(len(rows), math.nan)

    def gradient(self, row: np.ndarray) -> np.ndarray | None:
        """Return the derivatives of the number of a row by its numbers, (P,), NaN where a flight has none.

        None where the scheme has no derivatives.
        """
        try:
            slopes = self.objective.sensitivities
        except GncError:  # pulses, or an allocation in Python
            return None
        return slopes.at_row(row, seed=self.objective.seed).gradient

    def _at(self, rows: np.ndarray) -> np.ndarray:
        """Return the numbers of flights; none where a file of that row would be refused."""
        varied = self.objective.cases.varied
        found = np.full(len(rows), math.nan)
        able = np.array([holds(varied, row) for row in rows], dtype=bool)
        if able.any():
            found[able] = self.objective.at(rows[able])
        return found


def holds(varied: Varied, row: np.ndarray) -> bool:
    """Return whether a craft with these numbers has no flaw, and its law can have them at its sample period."""
    try:
        made = varied.at(row)
        made.schemes[0].law.check_hold()
    except GncError:
        return False
    return not list(made.craft.flaws())


@dataclass(frozen=True, eq=False)
class Trial:
    """Hold a flight: of which build, at which point, (p,), and its number."""

    of: int
    point: np.ndarray
    value: float

    @property
    def broken(self) -> bool:
        """Whether the requirement is not met."""
        return self.value < 0


@dataclass(frozen=True)
class Step:
    """Tell where a search was: what it did, after how many flights, the robustness, and how far from the nominal."""

    did: str
    flights: int
    robustness: float
    distance: float


class Flights:
    """Fly points of a search.

    Parameters
    ----------
    builds : at least one; the first is the mission as it is.
    space : of the points, the same of all builds.
    journal : of what was flown.
    most : flights at most.
    told : called as flights are done.
    """

    def __init__(
        self, builds: Sequence[Build], space: Space, journal: Journal, most: int, told: Told | None = None
    ) -> None:
        self.builds, self.space, self.most = tuple(builds), space, most
        self._journal, self._told = journal, told
        self._asked: set[tuple[int, bytes]] = set()
        self._turned: set[tuple[int, bytes]] = set()
        self._without: set[int] = set()
        #: Flights of this process; the rest were in the journal.
        self.flown = 0
        #: The flight of the smallest number so far.
        self.lowest: Trial | None = None
        self.path: list[Step] = []

    @property
    def count(self) -> int:
        """Different flights that the search asked for; a slope there and back counts as `THERE_AND_BACK`."""
        return len(self._asked) + THERE_AND_BACK * len(self._turned)

    def fly(self, of: int, points: np.ndarray) -> np.ndarray:
        """Return the numbers at points, (n, p), of a build, (n,); inf where there is none that is finite or below.

        Raises
        ------
        SpentError
            Where the budget does not allow them.
        """
        points = np.asarray(points, dtype=float).reshape(-1, self.space.size)
        rows = self.space.rows(points)
        fresh = {(of, row.tobytes()) for row in rows} - self._asked
        if self.count + len(fresh) > self.most:
            raise SpentError
        lacking = np.unique(rows[~self._journal.known(of, rows)], axis=0)
        if len(lacking):
            self._journal.note(of, lacking, self.builds[of].at(lacking))
            self.flown += len(lacking)
        self._asked |= fresh
        if self._told and fresh:
            self._told(self.count, self.most)
        values = self._journal.numbers(of, rows)
        values = np.where(np.isnan(values), math.inf, values)
        best = int(np.argmin(values))
        if self.lowest is None or values[best] < self.lowest.value:
            self.lowest = Trial(of, points[best], float(values[best]))
        return values

    def best(self, of: int, points: np.ndarray) -> Trial:
        """Return the flight of the smallest number among points."""
        values = self.fly(of, points)
        place = int(np.argmin(values))
        return Trial(of, np.asarray(points)[place], float(values[place]))

    def derivatives(self, at: Trial) -> np.ndarray | None:
        """Return the slope at a flight there and back, (p,), NaN where it has no number.

        None where as few coordinates move that differences cost no more flights, and of a build without derivatives.

        Raises
        ------
        SpentError
            Where the budget does not allow it.
        """
        moved = ~(self.space.discrete | np.isnan(at.point))
        if moved.sum() <= THERE_AND_BACK or at.of in self._without or not math.isfinite(at.value):
            return None
        (row,) = self.space.rows(at.point[None, :])
        fresh = (at.of, row.tobytes()) not in self._turned
        if fresh and self.count + THERE_AND_BACK > self.most:
            raise SpentError
        gradient = self._journal.gradient(at.of, row)
        if gradient is None:
            gradient = self.builds[at.of].gradient(row)
            if gradient is None:
                self._without.add(at.of)
                return None
            self._journal.note_gradient(at.of, row, gradient)
            self.flown += THERE_AND_BACK
        self._turned.add((at.of, row.tobytes()))
        if self._told and fresh:
            self._told(self.count, self.most)
        return self.space.slope(at.point, gradient)

    def slope(self, at: Trial, step: float, only: np.ndarray | None = None) -> np.ndarray:
        """Return the slope at a flight by differences of one side, (p,), 0 where it is not in `only`, a mask, (p,).

        NaN where a flight has no number.
        """
        return differences(self.space, lambda points: self.fly(at.of, points), at.point, step, at.value, only)

    def note(self, did: str, at: Trial) -> Trial:
        """Put a flight on the search's path where it is lower than all before, or on the boundary; return it."""
        if did == "boundary" or all(at.value < step.robustness for step in self.path):
            self.path.append(Step(did, self.count, at.value, float(self.space.distance(at.point)[0])))
        return at
