"""Requirements that look ahead inside another condition over time: they need every sample, so their flights fly again.

Each goes one by one in scalar C, on a thread of its own, and its record is gone when its margins are known. It must
have the words of the batch, so every such flight is an audit too.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from casadi_gnc.campaigns.cases import Cases, Drawn
from casadi_gnc.campaigns.program import Flown
from casadi_gnc.campaigns.store import Columns
from casadi_gnc.embedded.printer import Math
from casadi_gnc.errors import CampaignError
from casadi_gnc.missions.one_build import OneBuild


def unwatched(cases: Cases) -> list[str]:
    """Return the ids of the requirements of a campaign whose verdict needs every sample of a flight."""
    watched = [one.requirement for one in cases.varied.tapes.watches]
    return [one.id for one in cases.varied.nominal.requirements if one.formula and one not in watched]


def margins_of_records(
    cases: Cases, drawn: Drawn, good: np.ndarray, flights: Flown, maths: Math, threads: int | None
) -> Columns:
    """Return by how much each flight meets each such requirement, by id, (flights,).

    Parameters
    ----------
    cases, drawn, good : of the campaign, a shard, and which of its cases flew.
    flights : what the batch came to.
    maths, threads : as for `casadi_gnc.campaigns.engines.CompiledBatch`.

    Raises
    ------
    CampaignError
        For a flight with other words than in the batch.
    """
    asked, places = unwatched(cases), np.flatnonzero(good)
    if not asked or not len(places):
        return {}
    count = min(threads or os.cpu_count() or 1, len(places))
    found = np.empty((len(asked), len(places)))

    def part(mine: int) -> None:
        build = OneBuild(cases.varied, maths=maths)
        for at in range(mine, len(places), count):
            place = places[at]
            tally, robustness = build.judge(drawn.values[place], int(drawn.seeds[place]))
            if (tally.view(np.uint64) != flights.tally[at].view(np.uint64)).any():
                raise CampaignError(other_words(int(drawn.numbers[place])))
            found[:, at] = [robustness[one] for one in asked]

    with ThreadPoolExecutor(count) as pool:
        for _ in pool.map(part, range(count)):
            pass
    return dict(zip(asked, found, strict=True))


def other_words(number: int) -> str:
    """Return what is told of a case that has other words when it is flown again."""
    return (
        f"case {number} has other words when it is flown again in scalar C: the compiler has not kept the arithmetic; "
        "nothing of its shard was kept. Take another compiler (CC=...), and tell its version"
    )
