"""Choose the engine of a campaign by how long each would take.

The rates are of the shipped missions, measured on common machines; they need to be right to a factor of two only, since
between a GPU and a few cores lies a factor of ten either way.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass

from casadi_gnc.campaigns.engines import CompiledBatch, best_vectors
from casadi_gnc.campaigns.program import BatchEngine, Program
from casadi_gnc.errors import CampaignError, GpuError, offer

#: Engines by name.
ENGINES = ("auto", "c", "cuda", "dask", "dask:cuda")
#: Operations of the tapes that a core does in a second, by the kind of its vector instructions.
_PER_CORE = {"none": 3e9, "baseline": 5e9, "avx2": 9e9, "avx512": 18e9}
#: The same where the on-board solver iterates, whose own operations are not in the tapes.
_PER_CORE_ITERATING = 0.8e9
#: Operations that a GPU of a data centre does in a second, by how many a sample has (up to, rate).
_PER_GPU = ((3000, 18e12), (7000, 7e12), (float("inf"), 2.5e12))
_PER_GPU_ITERATING = 0.15e12
#: Flights that fill it.
_FILLS_GPU = 34_000
#: Seconds of the compiler for each operation: gcc for lanes; NVRTC, and with the on-board solver in all.
_BUILD, _BUILD_GPU, _BUILD_GPU_ITERATING = 0.3e-3, 0.2e-3, 5.0
#: Seconds on cores below which no GPU is asked.
_SOON = 5.0


@dataclass(frozen=True)
class Choice:
    """Hold how to make the engine that flies, and a sentence that says why it is this one."""

    make: Callable[[], BatchEngine]
    why: str


def refuse_unknown(engine: str, scheduler: str | None) -> None:
    """Raise `CampaignError` for an engine that there is not, or a scheduler that it does not use."""
    if engine not in ENGINES:
        raise CampaignError(f"no engine {engine!r}; {offer(engine, ENGINES)}")
    if scheduler is not None and engine in ("c", "cuda"):
        raise CampaignError(f"engine {engine!r} uses no scheduler, and {scheduler!r} is given; take --engine dask")


def choose(
    engine: str,
    program: Program,
    flights: int,
    *,
    scheduler: str | None = None,
    vectors: str | None = None,
    threads: int | None = None,
) -> Choice:
    """Return the engine of that name, or for "auto" the one that would be done first.

    Parameters
    ----------
    flights : that are to be flown.
    scheduler, vectors, threads : as for `casadi_gnc.campaigns.campaign.campaign`.

    Raises
    ------
    CampaignError
        For an engine that does not exist.
    """
    refuse_unknown(engine, scheduler)

    def c() -> BatchEngine:
        return CompiledBatch(program, vectors=vectors, threads=threads)

    def cuda() -> BatchEngine:
        from casadi_gnc.campaigns.cuda import CudaBatch

        return CudaBatch(program)

    def dask() -> BatchEngine:
        from casadi_gnc.campaigns.cluster import DaskBatch

        inside = engine.partition(":")[2] or "c"
        return DaskBatch(program, inside=inside, scheduler=scheduler, vectors=vectors, workers=threads)

    asked = {"c": c, "cuda": cuda, "dask": dask, "dask:cuda": dask}
    if engine != "auto":
        return Choice(asked[engine], f"engine {engine}, as asked")
    if scheduler is not None:
        return Choice(dask, f"engine dask: its scheduler {scheduler} is given")
    kind, cores = vectors or best_vectors(), threads or os.cpu_count() or 1
    on_cores = seconds_on_cores(program, flights, kind, cores)
    told = f"{cores} core{'s' if cores > 1 else ''} take about {_rounded(on_cores)}"
    if on_cores < _SOON:
        return Choice(c, f"engine c: {told}")
    from casadi_gnc.campaigns.cuda import present

    try:
        card = present()
    except GpuError as error:
        return Choice(c, f"engine c: {told}; without a GPU: {str(error).partition(';')[0]}")
    on_gpu = seconds_on_gpu(program, flights)
    told = f"{told}, {card} about {_rounded(on_gpu)}"
    return Choice(cuda, f"engine cuda: {told}") if on_gpu < on_cores else Choice(c, f"engine c: {told}")


def seconds_on_cores(program: Program, flights: int, vectors: str, cores: int) -> float:
    """Return about how long engine c takes, its build included."""
    rate = _PER_CORE[vectors] if program.lanes else _PER_CORE["none"]
    rate = _PER_CORE_ITERATING if program.workspace else rate
    build = 0.0 if program.workspace else _BUILD * program.operations
    return build + float(flights) * program.samples * program.operations / (rate * cores)


def seconds_on_gpu(program: Program, flights: int) -> float:
    """Return about how long engine cuda takes, its build included; a card takes as long where it is not full."""
    rate = next(rate for most, rate in _PER_GPU if program.operations <= most)
    build = _BUILD_GPU * program.operations
    if program.workspace:
        rate, build = _PER_GPU_ITERATING, _BUILD_GPU_ITERATING
    return build + float(max(flights, _FILLS_GPU)) * program.samples * program.operations / rate


def _rounded(seconds: float) -> str:
    if seconds < 120:
        return f"{max(seconds, 1):.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.0f} h"
