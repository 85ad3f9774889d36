"""Flights of a tuning: the cost of gains, of dispersed cases, side by side from one build."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from casadi_gnc.campaigns.cases import Dispersion, cases_of
from casadi_gnc.campaigns.dispersions import DispersionTable
from casadi_gnc.tuning.costs import Cost
from casadi_gnc.tuning.gains import Gain, Gains
from casadi_gnc.tuning.objective import Objective
from casadi_gnc.tuning.space import Space

if TYPE_CHECKING:
    from casadi_gnc.campaigns.store import Columns
    from casadi_gnc.missions.mission import Mission

#: Half the length over which a difference is taken, in coordinates of the gains: a share of the gain.
_STEP = 1e-3


@dataclass(frozen=True, eq=False)
class Case:
    """Hold one case that gains are flown in: the numbers of what is dispersed, and the seed of its noise."""

    values: np.ndarray
    seed: int
    name: str = ""


class Flights:
    """Fly gains in cases.

    Parameters
    ----------
    mission : with the metrics of the cost. scheme : its name.
    gains : those that are free. dispersions : what differs from case to case.
    cost : what a flight costs; `scales` are set from the nominal case by `begin`.
    """

    def __init__(
        self, mission: Mission, scheme: str, gains: Gains, dispersions: Sequence[Dispersion], cost: Cost,
        threads: int | None = None,
    ) -> None:  # fmt: skip
        self.gains, self.cost = gains, cost
        column = cost.terms[0].column.partition(".")[2]
        self.objective = Objective(
            mission, scheme, parameters=[*map(_range, gains.each), *dispersions], what=column, threads=threads
        )
        whole, given, first = self.objective.space, self.objective.cases.parts.given, gains.size
        #: Of the dispersions, without the gains.
        self.space = Space(whole.keys[first:], given[first:], whole.distributions[first:], whole.nominal[first:])
        self.keys = self.space.keys
        self.nominal = Case(self.space.nominal, self.objective.seed, "nominal")
        self.scales = np.ones(len(cost.terms))

    @property
    def count(self) -> int:
        """Flights so far."""
        return self.objective.flights

    def table(self, values: np.ndarray, cases: Sequence[Case]) -> Columns:
        """Return what flights of gains, (n, P), came to in each case: columns of n times as many rows."""
        rows = np.hstack(
            [np.repeat(values, len(cases), axis=0), np.tile(np.array([one.values for one in cases]), (len(values), 1))]
        )
        seeds = np.tile(np.array([one.seed for one in cases], dtype=np.uint64), len(values))
        return self.objective.table(rows, seeds)

    def terms(self, values: np.ndarray, cases: Sequence[Case]) -> np.ndarray:
        """Return the terms of the cost, (n, cases, T), each in its unit."""
        return self.cost.values(self.table(values, cases)).reshape(len(values), len(cases), -1)

    def costs(self, points: np.ndarray, cases: Sequence[Case]) -> np.ndarray:
        """Return the costs, (n, cases), at coordinates of the gains, (n, P)."""
        return self.cost.total(self.terms(self.gains.values(points), cases), self.scales)

    def slopes(self, z: np.ndarray, cases: Sequence[Case]) -> np.ndarray:
        """Return the slopes of the costs along the coordinates, (cases, P), by central differences in one batch."""
        ahead = np.minimum(z + _STEP * np.eye(len(z)), self.gains.high)
        behind = np.maximum(z - _STEP * np.eye(len(z)), self.gains.low)
        costs = self.costs(np.vstack([ahead, behind]), cases)
        with np.errstate(invalid="ignore"):
            slopes = (costs[: len(z)] - costs[len(z) :]) / np.diag(ahead - behind)[:, None]
        return np.where(np.isfinite(slopes), slopes, np.nan).T


def planned(
    mission: Mission, scheme: str, dispersions: Sequence[Dispersion], plan: str, count: int, seed: int
) -> list[Case]:
    """Return the cases of a campaign's plan, without those that cannot fly; numbers and seeds are the campaign's."""
    drawn = cases_of(mission, dispersions, plan, count, seed, scheme).draw(0, count)
    return [
        Case(row, int(own), f"case {number}")
        for row, own, number, why in zip(drawn.values, drawn.seeds, drawn.numbers, drawn.refused, strict=True)
        if not why
    ]


def _range(gain: Gain) -> DispersionTable:
    """Return the range of a gain in the words of a dispersion."""
    ends = [gain.low, gain.high]
    return (
        DispersionTable(key=gain.key, log_uniform=ends)
        if gain.logarithmic
        else DispersionTable(key=gain.key, uniform=ends)
    )
