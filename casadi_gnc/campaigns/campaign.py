"""Fly a campaign: draw cases, fly them shard by shard, keep their rows, look at some again."""

from __future__ import annotations

import dataclasses
import math
import shutil
import tempfile
from collections.abc import Callable, Iterator, Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.campaigns.cases import Cases, Dispersion, Drawn, cases_of
from casadi_gnc.campaigns.choosing import choose, refuse_unknown
from casadi_gnc.campaigns.dispersions import DispersionTable
from casadi_gnc.campaigns.draws import Purpose, check_seed, words
from casadi_gnc.campaigns.engines import CompiledBatch
from casadi_gnc.campaigns.plan import Plan
from casadi_gnc.campaigns.program import BatchEngine, Flown, Program, program_of
from casadi_gnc.campaigns.result import Campaign
from casadi_gnc.campaigns.store import Columns, Store, has_arrow, keep_texts, read_identity, shards
from casadi_gnc.embedded.printer import Math
from casadi_gnc.errors import CampaignError
from casadi_gnc.missions import metrics
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.origin import Origin
from casadi_gnc.missions.requirements import Requirement
from casadi_gnc.status import StepStatus

#: Samples of a shard, about: seconds of one core.
_SHARD_SAMPLES = 3e7
#: Cases of which one must be able to fly before anything is written.
_LOOKED_AT = 64
#: Called as told(cases done, cases in all).
Told = Callable[[int, int], None]
#: Called with a sentence.
Said = Callable[[str], None]
_Made = Callable[[int], BatchEngine]


def campaign(
    mission: Mission,
    flights: int,
    *,
    scheme: str | None = None,
    dispersions: Sequence[Dispersion] | None = None,
    plan: str | Plan = "independent",
    seed: int = 0,
    out: str | Path | None = None,
    shard: tuple[int, int] = (1, 1),
    audit: int = 3,
    engine: str = "auto",
    scheduler: str | None = None,
    maths: Math = "gnc",
    vectors: str | None = None,
    threads: int | None = None,
    told: Told | None = None,
    said: Said | None = None,
) -> Campaign:
    """Fly many cases of a mission and keep a row of each.

    A case is a function of the mission, the plan, the seed and its number. Cases that are in the folder already are
    not flown again, so that an interrupted campaign goes on where it was.

    Parameters
    ----------
    mission : what is flown.
    flights : number of cases.
    scheme : its name; the first by default.
    dispersions : what varies; those of the mission by default.
    plan : how the cases fill the space of what varies, by name or as a plan.
    seed : 0 to 2^64 - 1.
    out : folder of the rows; a temporary one by default, gone with the result.
    shard : (i, n), fly the i-th of n parts only: several machines fill one folder.
    audit : so many cases of each shard are flown again one by one in scalar C, and must have the same words.
    engine : "c", vector lanes on threads; "cuda", an NVIDIA GPU; "dask", workers on this or other machines, each
        flying as "c", or "dask:cuda"; "auto" takes the one that is done first by estimate. The words are the same.
    scheduler : address of a dask scheduler, such as "tcp://host:8786"; without it "dask" starts workers here.
    maths, vectors, threads : as for `casadi_gnc.campaigns.engines.CompiledBatch`.
    told : called as cases are done.
    said : called with a sentence that says which engine "auto" took, and why.

    Raises
    ------
    GncError
        For what cannot be flown or dispersed, a folder with another campaign, or an audit that finds other words.
    """
    if not 1 <= flights <= 2**32:
        raise CampaignError(f"{flights} flights are asked for; expected 1 to 2^32")
    if not 1 <= shard[0] <= shard[1]:
        raise CampaignError(f"the shard is {shard[0]}/{shard[1]}; expected i/n with 1 <= i <= n")
    refuse_unknown(engine, scheduler)
    varying = mission.dispersions if dispersions is None else dispersions
    cases = cases_of(mission, varying, plan, flights, check_seed(seed), scheme)
    flown = cases.varied.nominal
    if not varying and not flown.truth.noise.size:
        raise CampaignError(
            f"nothing differs from case to case: {mission.name} has neither a [[dispersion]] nor noise; add one"
        )
    _refuse_unwatched(cases)
    first = cases.draw(0, min(flights, _LOOKED_AT)).refused
    if all(first):
        raise CampaignError(f"the first {len(first)} cases are all refused; case 0: {first[0]}")
    folder = Path(tempfile.mkdtemp(prefix="casadi-gnc-campaign-")) if out is None else Path(out)
    try:
        store = Store(folder, _identity(cases, flights, varying, plan, maths))
        if flown.origin is not None:
            keep_texts(folder, _texts(flown.origin, varying))
        program = program_of(cases.varied, maths)

        def make(left: int) -> BatchEngine:
            choice = choose(engine, program, left, scheduler=scheduler, vectors=vectors, threads=threads)
            if said and engine == "auto":
                said(choice.why)
            return choice.make()

        _fly_missing(cases, store, shard, _Audit(program, cases.seed, audit), make, told)
    except BaseException:
        if out is None:
            shutil.rmtree(folder, ignore_errors=True)
        raise
    return Campaign(folder, cases, temporary=out is None)


def _refuse_unwatched(cases: Cases) -> None:
    """Raise `CampaignError` for a requirement whose verdict needs every sample of a flight."""
    watched = [one.requirement for one in cases.varied.tapes.watches]
    for one in cases.varied.nominal.requirements:
        if one.formula and one not in watched:
            raise CampaignError(
                f"requirement {one.id} looks ahead inside another condition over time, so its verdict needs every "
                f"sample, which a campaign does not keep ({one.asked}); take always or eventually of a condition on "
                "one sample, or fly single cases"
            )


def opened(mission: Mission, folder: Path) -> Campaign:
    """Return the campaign of a mission that is kept in a folder, with its cases; nothing is flown.

    Raises
    ------
    CampaignError
        Where its plan or what varies was an object of Python's, so that the folder does not say what it was.
    """
    identity = read_identity(folder)
    if identity["dispersions"] is None or identity["plan_name"] is None:
        what = "plan" if identity["plan_name"] is None else "dispersions"
        raise CampaignError(f"{folder}: its {what} came from Python and not from a file; run it again there to open it")
    varying = [DispersionTable(**table) for table in identity["dispersions"]]
    origin = mission.origin
    here = mission if origin is None else mission.read_from(dataclasses.replace(origin, folder=folder))
    cases = cases_of(here, varying, identity["plan_name"], identity["cases"], identity["seed"], identity["scheme"])
    if cases.varied.nominal.digest != identity["problem_sha256"]:
        raise CampaignError(f"{folder / 'problem.toml'} is not what was flown: it was changed since")
    return Campaign(folder, cases)


def _texts(origin: Origin, dispersions: Sequence[Any]) -> dict[str, str]:
    """Return the files that the mission was read from, and the tables of what varies."""
    files = [each.table.file for each in dispersions if getattr(each, "table", None) is not None]
    tables = {name: (origin.folder / name).read_text(encoding="utf-8") for name in files}
    return {"problem.toml": origin.text, **{file.path: file.text for file in origin.guests}, **tables}


def _fly_missing(
    cases: Cases, store: Store, shard: tuple[int, int], audit: _Audit, make: _Made, told: Told | None
) -> None:
    """Fly the shards that the store does not have, with the engine that `make` returns for their flights."""
    mine = [each for each in shards(store.identity) if each[0] % shard[1] == shard[0] - 1]
    total = sum(last - first for _, first, last in mine)
    missing = [each for each in mine if store.state(each[0]) != "whole"]
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
            drawn = [_Shard(number, cases.draw(first, last)) for number, first, last in some]
            yield drawn, np.vstack([each.values for each in drawn]), np.concatenate([each.seeds for each in drawn])

    try:
        for together, flights in engine.fly_all(parts(), counted):
            at = 0
            for each in together:
                own = flights.rows(at, at + len(each.seeds))
                at += len(each.seeds)
                audit.compare(each, own)
                store.write(each.number, _rows(cases, each.drawn, each.good, own))
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


class _Audit:
    """Fly some cases of each shard again in scalar C, and compare all words."""

    def __init__(self, program: Program, seed: int, count: int) -> None:
        self._program, self._seed, self._count = program, seed, count
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
            raise CampaignError(
                f"case {number} has other words when it is flown again in scalar C: the compiler has not kept the "
                "arithmetic; nothing of its shard was kept. Take another compiler (CC=...), and tell its version"
            )


def _rows(cases: Cases, drawn: Drawn, good: np.ndarray, flights: Flown) -> Columns:
    """Return the table of some cases: parameters, metrics, statuses; nothing but the former of those refused."""
    mission, tapes = cases.varied.nominal, cases.varied.tapes
    count = len(drawn.numbers)
    columns: Columns = {"case": drawn.numbers.astype(np.int64), "noise_seed": drawn.seeds, "weight": drawn.weights}
    columns |= {key: drawn.values[:, i] for i, key in enumerate(cases.varied.parameters.keys)}
    columns["refused"] = np.array(drawn.refused, dtype=object if has_arrow() else str)
    period, last = mission.timing.sample_period, (mission.timing.samples - 1) * mission.timing.sample_period
    values = metrics.read_many(tuple(mission.metrics), tapes.tally, flights.tally, last, period)
    for name, numbers in values.items():
        columns[f"metric.{name}"] = _spread(numbers, good, math.nan)
    for one in mission.requirements:
        columns[f"requirement.{one.id}"] = _spread(_margins(cases, one, values, flights), good, math.nan)
    for bit in StepStatus:
        raised = flights.tally[:, tapes.tally.place(f"count_{bit.name}")][:, 0]
        first = flights.tally[:, tapes.tally.place(f"first_{bit.name}")][:, 0]
        columns[f"samples.{bit.name}"] = _spread(raised, good, 0.0).astype(np.int64)
        columns[f"first.{bit.name}"] = _spread(np.where(raised > 0, first, math.nan), good, math.nan)
    assert all(len(column) == count for column in columns.values())
    return columns


def _margins(cases: Cases, one: Requirement, values: Columns, flights: Flown) -> np.ndarray:
    """Return by how much each flight meets a requirement, below 0 by how much it does not."""
    if one.metric:
        return one.margins(values)
    tapes = cases.varied.tapes
    watch = next(watch for watch in tapes.watches if watch.requirement == one)
    diverged = flights.tally[:, tapes.tally.place(f"count_{StepStatus.DIVERGED.name}")][:, 0] > 0
    return np.where(diverged, -math.inf, watch.read(flights.tally[:, tapes.tally.place(watch.name)]))


def _spread(numbers: np.ndarray, good: np.ndarray, otherwise: float) -> np.ndarray:
    column = np.full(len(good), otherwise)
    column[good] = numbers
    return column


def shard_size(samples: int) -> int:
    """Return how many flights of so many samples make a shard: a power of two, the same on every machine."""
    return 2 ** max(4, min(16, round(math.log2(_SHARD_SAMPLES / samples))))


def _identity(cases: Cases, flights: int, dispersions: Sequence[Any], plan: str | Plan, maths: Math) -> dict[str, Any]:
    mission = cases.varied.nominal
    return {
        "format": 1,
        "mission": mission.name,
        "problem_sha256": mission.digest,
        "changes": dict(mission.origin.changes) if mission.origin else None,
        "scheme": cases.varied.scheme.name,
        "mode": mission.timing.mode,
        "maths": maths,
        "seed": cases.seed,
        "plan": repr(cases.plan),
        "plan_name": plan if isinstance(plan, str) else None,
        "parameters": list(cases.varied.parameters.keys),
        "dispersions": _tables(dispersions),
        "distributions": [_told(each) for each in cases.distributions],
        "cases": flights,
        "shard": shard_size(mission.timing.samples),
        "table": "parquet" if has_arrow() else "npz",
        "casadi_gnc": metadata.version("casadi-gnc"),
        "casadi": metadata.version("casadi"),
    }


def _tables(dispersions: Sequence[Any]) -> list[dict[str, Any]] | None:
    """Return what varies as a file says it; None where it is an object of another kind."""
    if not all(isinstance(each, DispersionTable) for each in dispersions):
        return None
    return [each.model_dump(exclude_none=True, exclude_defaults=True) for each in dispersions]


def _told(distribution: Any) -> str:
    return repr(distribution) if dataclasses.is_dataclass(distribution) else type(distribution).__qualname__


def parts_of(text: str) -> tuple[int, int]:
    """Return (i, n) of "i/n"; raise `CampaignError` for another text."""
    first, _, second = text.partition("/")
    if not (first.isdecimal() and second.isdecimal()):
        raise CampaignError(f"the shard is {text!r}; expected i/n, such as 3/40")
    return int(first), int(second)
