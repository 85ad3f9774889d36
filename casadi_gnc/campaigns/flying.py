"""Fly the shards that a folder does not have: draw cases, fly some together, look at some again, keep the rows."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from casadi_gnc.campaigns.cases import Cases, Drawn
from casadi_gnc.campaigns.draws import Purpose, words
from casadi_gnc.campaigns.engines import CompiledBatch
from casadi_gnc.campaigns.program import BatchEngine, Flown, Program
from casadi_gnc.campaigns.rows import rows_of
from casadi_gnc.campaigns.store import MISSING, SHORT, WHOLE, Store, shards
from casadi_gnc.campaigns.whole_records import margins_of_records, other_words
from casadi_gnc.errors import CampaignError

#: Called as told(cases done, cases in all).
Told = Callable[[int, int], None]
#: Called with a sentence.
Said = Callable[[str], None]
#: From a number of flights to the engine that flies them.
Made = Callable[[int], BatchEngine]


def fly_missing(
    cases: Cases,
    store: Store,
    begun_with: Drawn,
    shard: tuple[int, int],
    audit: Audit,
    make: Made,
    told: Told | None,
    said: Said | None,
) -> None:
    """Fly the shards that the store does not have, with the engine that `make` returns for their flights.

    `begun_with` are the first cases, drawn already; `told` and `said` as for `casadi_gnc.campaigns.campaign.campaign`.
    """
    mine = [each for each in shards(store.identity) if each[0] % shard[1] == shard[0] - 1]
    total = sum(last - first for _, first, last in mine)
    states = {each[0]: store.state(each[0]) for each in mine}
    for state in states.values():
        if said and state not in (WHOLE, MISSING, SHORT):
            said(f"{state}; it is flown again")
    missing = [each for each in mine if states[each[0]] != WHOLE]
    left = sum(last - first for _, first, last in missing)
    done = total - left

    def counted(count: int) -> None:
        nonlocal done
        done += count
        if told:
            told(done, total)

    counted(0)
    if not missing:
        return
    engine = make(left)

    def parts() -> Iterator[tuple[list[_Shard], np.ndarray, np.ndarray]]:
        for some in _together(missing, engine.at_once):
            drawn = [_Shard(number, cases.draw_on(begun_with, first, last)) for number, first, last in some]
            yield drawn, np.vstack([each.values for each in drawn]), np.concatenate([each.seeds for each in drawn])

    try:
        for together, flights in engine.fly_all(parts(), counted):
            at = 0
            for each in together:
                own = flights.rows(at, at + len(each.seeds))
                at += len(each.seeds)
                audit.compare(each, own)
                margins = margins_of_records(cases, each.drawn, each.good, own, store.identity["maths"], audit.threads)
                store.write(each.number, rows_of(cases, each.drawn, each.good, own, margins))
                counted(int((~each.good).sum()))
    finally:
        engine.close()


def _together(missing: list[tuple[int, int, int]], at_once: int) -> Iterator[list[tuple[int, int, int]]]:
    """Yield runs of shards of at least so many cases."""
    some: list[tuple[int, int, int]] = []
    for each in missing:
        some.append(each)
        if sum(last - first for _, first, last in some) >= at_once:
            yield some
            some = []
    if some:
        yield some


class _Shard:
    """Hold the cases of a shard, and the numbers of those that fly."""

    def __init__(self, number: int, drawn: Drawn) -> None:
        self.number, self.drawn = number, drawn
        self.good = np.array([not why for why in drawn.refused])
        self.values, self.seeds = drawn.values[self.good], drawn.seeds[self.good]


class Audit:
    """Fly some cases of each shard again in scalar C, and compare all words."""

    def __init__(self, program: Program, seed: int, count: int, threads: int | None = None) -> None:
        self._program, self.threads = program, threads
        self._seed, self._count = seed, count
        self._alone: CompiledBatch | None = None

    def compare(self, shard: _Shard, flights: Flown) -> None:
        """Raise `CampaignError` where a case has other words in scalar C."""
        if not self._count or not len(shard.seeds):
            return
        picks = words(self._seed, Purpose.AUDIT, shard.drawn.numbers[:1], self._count)[0] % np.uint64(len(shard.seeds))
        chosen = np.unique(picks.astype(int))
        self._alone = self._alone or CompiledBatch(self._program, vectors="none", threads=1)
        again = self._alone.fly(shard.values[chosen], shard.seeds[chosen])
        apart = (again.words != flights.words[chosen]).any(axis=1)
        if apart.any():
            number = int(shard.drawn.numbers[shard.good][chosen[np.flatnonzero(apart)[0]]])
            raise CampaignError(other_words(number))
