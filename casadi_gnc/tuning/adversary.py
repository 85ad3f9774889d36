"""The worst case of gains: the search of `falsify` for a break of "cost <= level", with ever higher levels.

The search is a function of what its flights come to, so a raised level asks for the same flights once more, which are
known, and goes on where the last break ended it.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from casadi_gnc.tuning.descending import Effort
from casadi_gnc.tuning.flights import Flights as Searched
from casadi_gnc.tuning.flights import holds
from casadi_gnc.tuning.gain_flights import Case, Flights
from casadi_gnc.tuning.journal import Journal
from casadi_gnc.tuning.reach import Reach
from casadi_gnc.tuning.searching import search

#: Flights of a search after the last break, at most.
MOST = 256
#: A case is a break where it costs more than the worst known by such a share.
NO_WORSE = 0.005


class _Costs:
    """What a search flies: one choice of gains in dispersed cases; a flight's number is the level less its cost."""

    def __init__(self, flights: Flights, z: np.ndarray, level: float) -> None:
        self.changes: dict[str, Any] = {}
        self.level = level
        self._flights = flights
        self._gains = flights.gains.values(z)
        self._known: dict[bytes, float] = {}

    def at(self, rows: np.ndarray) -> np.ndarray:
        """Return the number of each row, (n,), NaN where a file of it would be refused."""
        fresh = np.array([row for row in rows if row.tobytes() not in self._known])
        if len(fresh):
            self._known.update(zip((row.tobytes() for row in fresh), self._costs(fresh).tolist(), strict=True))
        return self.level - np.array([self._known[row.tobytes()] for row in rows])

    def gradient(self, row: np.ndarray) -> None:
        """Return None: slopes are differences side by side, as those by the gains are."""

    def _costs(self, rows: np.ndarray) -> np.ndarray:
        varied = self._flights.objective.cases.varied
        able = np.array([holds(varied, np.concatenate([self._gains[0], row])) for row in rows], dtype=bool)
        found = np.full(len(rows), math.nan)
        if able.any():
            cases = [Case(row, self._flights.nominal.seed) for row in rows[able]]
            table = self._flights.table(self._gains, cases)
            costs = self._flights.cost.total(self._flights.cost.values(table), self._flights.scales)
            costs[np.array([bool(why) for why in table["refused"]])] = math.nan  # no such craft
            found[able] = costs
        return found


def raised(value: float) -> float:
    """Return the level that a case must exceed to be worse than a value."""
    return value + NO_WORSE * abs(value)


def worst_case(flights: Flights, z: np.ndarray, value: float, seed: int) -> tuple[Case, float] | None:
    """Return the worst case that is found for gains at coordinates z, and its cost; None where none is worse.

    It is searched within the density's contour of four standard deviations, where `falsify` searches by itself.

    Parameters
    ----------
    value : the largest cost of the cases that are known. seed : of the plan.
    """
    space = flights.space
    costs, reach = _Costs(flights, z, raised(value)), Reach(space)
    found = None
    while math.isfinite(costs.level):
        trial = search(Searched([costs], space, Journal({}), MOST), reach, seed, Effort())  # type: ignore[list-item]
        if trial is None:
            break
        value = costs.level - trial.value
        found = Case(space.rows(trial.point[None, :])[0], flights.nominal.seed), value
        costs.level = raised(value)
    return found
