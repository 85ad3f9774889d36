"""The cases of a campaign: each a function of what is flown, the plan, the seed and the case's number alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from casadi_gnc.campaigns.distributions import Distribution
from casadi_gnc.campaigns.draws import Purpose, words
from casadi_gnc.campaigns.naming import Parts, plan_of
from casadi_gnc.campaigns.plan import Plan
from casadi_gnc.errors import CampaignError
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.parameters import Varied, vary
from casadi_gnc.missions.paths import numbers_of
from casadi_gnc.tables.part import MisfitError


class Dispersion(Protocol):
    """Say how the numbers of one key differ from case to case."""

    @property
    def key(self) -> str:
        """Where in a problem file the numbers stand."""
        ...

    def distribution(self, size: int, folder: Path, nominal: list[float] | None = None) -> Distribution:
        """Return the distribution of `size` numbers."""
        ...


@dataclass(frozen=True, eq=False)
class Drawn:
    """Hold some cases: their numbers, their parameters, the seeds of their noise, their weights, why one is refused."""

    numbers: np.ndarray
    values: np.ndarray
    seeds: np.ndarray
    weights: np.ndarray
    refused: list[str]


@dataclass(frozen=True, eq=False)
class Cases:
    """Draw the cases of a campaign.

    Parameters
    ----------
    varied : the mission and its parameters, in the order of the dispersions.
    distributions : of the parameters, one after the other.
    plan : of the unit cube of all of them.
    seed : of the campaign, 0 to 2^64 - 1.
    parts : which dispersion has which numbers and dimensions.
    """

    varied: Varied
    distributions: tuple[Distribution, ...]
    plan: Plan
    seed: int
    parts: Parts

    def draw(self, first: int, last: int) -> Drawn:
        """Return the cases first ... last - 1."""
        points = self.plan.points(self.seed, first, last)
        weights = self.plan.weights(self.seed, first, last)
        columns, at = [], 0
        for distribution in self.distributions:
            columns.append(distribution.at(points[:, at : at + distribution.dimensions]))
            at += distribution.dimensions
        numbers = np.arange(first, last)
        values = np.hstack(columns) if columns else np.empty((last - first, 0))
        seeds = words(self.seed, Purpose.NOISE, self.plan.noise_numbers(first, last), 1)[:, 0]
        return Drawn(numbers, values, seeds, weights, self.varied.refusals(values))

    def draw_on(self, known: Drawn, first: int, last: int) -> Drawn:
        """Return the cases first ... last - 1, of which those up to some number, `known`, are drawn already."""
        have = len(known.numbers)
        if first >= have:
            return self.draw(first, last)
        names = ("numbers", "values", "seeds", "weights", "refused")
        kept = [getattr(known, name)[first:last] for name in names]
        rest = self.draw(max(have, first), max(have, last))
        *columns, why = ((one, getattr(rest, name)) for one, name in zip(kept, names, strict=True))
        return Drawn(*map(np.concatenate, columns), refused=why[0] + why[1])


def cases_of(
    mission: Mission,
    dispersions: Sequence[Dispersion],
    plan: str | Plan,
    flights: int,
    seed: int,
    scheme: str | None = None,
) -> Cases:
    """Return the cases of a campaign.

    Parameters
    ----------
    mission : what is flown.
    dispersions : what varies; without any, the noise does.
    plan : a plan, or the name of one: see `casadi_gnc.campaigns.naming`.
    flights : how many there are to be.
    seed : of the campaign.
    scheme : which one flies; the first by default.

    Raises
    ------
    FlightError, CampaignError
        For a key that leads nowhere or cannot be dispersed, a distribution that does not fit it, an unknown plan.
    """
    chosen = mission.scheme(scheme)
    alone = mission.with_scheme(chosen.name) if len(mission.schemes) > 1 else mission
    varied = vary(alone, [each.key for each in dispersions])
    folder, found, at = Path() if alone.origin is None else alone.origin.folder, [], 0
    for each in dispersions:
        size = len(numbers_of(alone, each.key))
        nominal = list(map(float, varied.parameters.nominal[at : at + size]))
        at += size
        try:
            found.append(each.distribution(size, folder, nominal))
        except MisfitError as error:
            raise CampaignError(f"the dispersion of {each.key!r}: {error}") from error
    dimensions = max(1, sum(each.dimensions for each in found))
    parts = Parts(tuple(each.key for each in dispersions), varied.parameters.keys, tuple(found))
    made = plan_of(plan, parts, flights) if isinstance(plan, str) else plan
    if made.dimensions != dimensions:
        raise CampaignError(f"the plan has {made.dimensions} dimensions, and the dispersions take {dimensions}")
    if made.cases is not None and flights > made.cases:
        raise CampaignError(f"{flights} flights are asked for, and the plan has {made.cases} cases; ask for those")
    return Cases(varied, tuple(found), made, seed, parts)
