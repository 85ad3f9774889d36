"""Fly a campaign: draw cases, fly them shard by shard, keep their rows, look at some again."""

from __future__ import annotations

import math
import shutil
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

from casadi_gnc.campaigns.cases import Dispersion, cases_of
from casadi_gnc.campaigns.choosing import choose, refuse_unknown
from casadi_gnc.campaigns.draws import check_seed
from casadi_gnc.campaigns.flying import Audit, Told, fly_missing
from casadi_gnc.campaigns.identity import identity_of, texts_of
from casadi_gnc.campaigns.keeping import Keep, keep_records
from casadi_gnc.campaigns.plan import Plan
from casadi_gnc.campaigns.program import BatchEngine, program_of
from casadi_gnc.campaigns.result import Campaign
from casadi_gnc.campaigns.store import WHOLE, Store, keep_texts, shards
from casadi_gnc.embedded.printer import Math
from casadi_gnc.errors import CampaignError
from casadi_gnc.missions.mission import Mission

#: Samples of a shard, about: seconds of one core.
_SHARD_SAMPLES = 3e7
#: Cases of which one must be able to fly before anything is written.
_LOOKED_AT = 64
#: Called with a sentence.
Said = Callable[[str], None]


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
    keep: Keep | None = None,
    told: Told | None = None,
    said: Said | None = None,
) -> Campaign:
    """Fly many cases of a mission and keep a row of each.

    A case is a function of the mission, the plan, the seed and its number. Cases that are in the folder already are
    not flown again, so that an interrupted campaign goes on where it was, and one of more flights goes on from there.

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
    keep : cases whose whole records are kept in the folder too, once all cases are flown.
    told : called as cases are done.
    said : called with a sentence that says which engine "auto" took, and why, and with one for each file of the folder
        that cannot be trusted and is flown again.

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
    first = cases.draw(0, min(flights, _LOOKED_AT))
    if all(first.refused):
        raise CampaignError(f"the first {len(first.refused)} cases are all refused; case 0: {first.refused[0]}")
    folder = Path(tempfile.mkdtemp(prefix="casadi-gnc-campaign-")) if out is None else Path(out)
    try:
        size = shard_size(flown.timing.samples)
        store = Store.prepared(folder, identity_of(cases, flights, varying, plan, maths, size))
        if flown.origin is not None:
            keep_texts(folder, texts_of(flown.origin, varying))
        program = program_of(cases.varied, maths)

        def make(left: int) -> BatchEngine:
            choice = choose(engine, program, left, scheduler=scheduler, vectors=vectors, threads=threads)
            if said and engine == "auto":
                said(choice.why)
            return choice.make()

        check = Audit(program, cases.seed, audit, threads)
        fly_missing(cases, store, first, shard, check, make, told, said)
        if keep is not None and all(store.state(number) == WHOLE for number, _, _ in shards(store.identity)):
            keep_records(Campaign(folder, cases), keep)
    except BaseException as error:
        if out is None:
            shutil.rmtree(folder, ignore_errors=True)
        if isinstance(error, OSError):  # a full disk, a share that went away, a folder in the place of a file
            raise CampaignError(
                f"cannot write to {str(error.filename2 or folder)!r}: {error.strerror or error}; what is finished is "
                "kept, and the same command goes on from there"
            ) from error
        raise
    return Campaign(folder, cases, temporary=out is None)


def shard_size(samples: int) -> int:
    """Return how many flights of so many samples make a shard: a power of two, the same on every machine."""
    return 2 ** max(4, min(16, round(math.log2(_SHARD_SAMPLES / samples))))


def parts_of(text: str) -> tuple[int, int]:
    """Return (i, n) of "i/n"; raise `CampaignError` for another text."""
    first, _, second = text.partition("/")
    if not (first.isdecimal() and second.isdecimal()):
        raise CampaignError(f"the shard is {text!r}; expected i/n, such as 3/40")
    return int(first), int(second)
