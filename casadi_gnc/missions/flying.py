"""Fly a mission: build the tapes, choose an engine, run, and gather what came out."""

from __future__ import annotations

import time
from collections.abc import Callable
from importlib import metadata
from typing import Any, Literal

import casadi as ca
import numpy as np

from casadi_gnc.embedded.printer import Math
from casadi_gnc.errors import FlightError, NoCompilerError
from casadi_gnc.missions import metrics, tapes
from casadi_gnc.missions.engines import Carried, CompiledEngine, Engine, VirtualMachineEngine
from casadi_gnc.missions.flight import Flight
from casadi_gnc.missions.mission import Mission, Mode, Scheme

EngineName = Literal["c", "vm"]
Progress = Callable[[int, int], None]

#: Samples between two calls of the progress function, at most.
_CHUNK = 50_000


def fly(
    mission: Mission,
    scheme: str | None = None,
    *,
    engine: EngineName = "c",
    maths: Math = "gnc",
    mode: Mode | None = None,
    decimation: int = 1,
    progress: Progress | None = None,
) -> Flight:
    """Fly one scheme of a mission.

    Parameters
    ----------
    mission : from `casadi_gnc.load`.
    scheme : its name; the first one of the mission by default.
    engine : "c" (compiled) or "vm" (CasADi's virtual machine). Without a compiler "c" becomes "vm"
        and the flight's notes say so.
    maths : elementary functions of the C: "gnc" (the same words on every machine) or "libm".
    mode : "sampled" or "continuous" instead of the mission's own.
    decimation : keep every so many-th sample; metrics and statuses use all of them.
    progress : called as progress(samples flown, samples in all).

    Raises
    ------
    FlightError
        For an unknown scheme or a decimation below 1.
    """
    if decimation < 1:
        raise FlightError(f"decimation is {decimation}, expected 1 or more")
    if engine not in ("c", "vm") or maths not in ("gnc", "libm") or mode not in (None, "sampled", "continuous"):
        raise FlightError(f"engine {engine!r}, maths {maths!r}, mode {mode!r}: one of them is not known")
    if mode is not None and mode != mission.timing.mode:
        mission = mission.with_timing(mode=mode)
    chosen = mission.scheme(scheme)
    built = tapes.build(mission, chosen)
    runner, notes = _engine(mission, chosen, built, engine, maths)
    carried = begin(mission, built)
    total, chunk = mission.timing.samples, _CHUNK if built.symbolic else 200
    record = np.zeros((-(-total // decimation), built.row.size))
    started, flown = time.perf_counter(), 0
    while flown < total:
        count = min(chunk if progress or total > _CHUNK else total, total - flown)
        kept = -(-flown // decimation)
        flown += runner.run(carried, flown, count, decimation, record[kept:])
        if progress:
            progress(flown, total)
    seconds = time.perf_counter() - started
    made = {
        "engine": runner.name,
        "maths": maths if runner.name == "c" else "libm",
        "mode": mission.timing.mode,
        "feedback": chosen.feedback,
        "problem_sha256": mission.digest,
        "casadi_gnc": metadata.version("casadi-gnc"),
        "casadi": metadata.version("casadi"),
        "compiler": runner.compiler.version if isinstance(runner, CompiledEngine) else "",
    }
    period = mission.timing.sample_period
    values = metrics.read(mission.metrics, built.tally, carried.tally, (total - 1) * period, period)
    return Flight(
        mission=mission.name,
        scheme=chosen.name,
        title=chosen.title or chosen.name,
        layout=built.row,
        samples=record,
        metrics=values,
        metric_units={metric.name: metric.unit for metric in mission.metrics},
        statuses=metrics.statuses(built.tally, carried.tally),
        made=made,
        seconds=seconds,
        notes=(*mission.warnings, *notes, *_never(mission, values)),
    )


def begin(mission: Mission, built: tapes.Tapes) -> Carried:
    """Return the columns at t = 0: the mission's start, the law's first memory, actuators at rest."""
    x = np.array(mission.start, dtype=float)
    y = np.array(mission.truth.measure(0.0, ca.DM(x))).ravel()
    return Carried(
        x=x,
        m=np.array(built.start(y)).ravel(),
        force=np.zeros(mission.truth.inputs.size),
        good=y.copy(),
        tally=metrics.fresh(mission.metrics, built.tally),
    )


def _engine(
    mission: Mission, scheme: Scheme, built: tapes.Tapes, engine: EngineName, maths: Math
) -> tuple[Engine, tuple[str, ...]]:
    if engine == "vm":
        return VirtualMachineEngine(mission, scheme, built), ()
    try:
        return CompiledEngine(mission, scheme, built, maths), ()
    except NoCompilerError as error:
        note = f"{error}. Flown on CasADi's virtual machine instead: some fifty times slower, with libm's last bits"
        return VirtualMachineEngine(mission, scheme, built), (note,)


def _never(mission: Mission, values: dict[str, float | None]) -> tuple[str, ...]:
    """Return a sentence for every settling that did not happen."""
    return tuple(
        f"{metric.name}: never; at {mission.timing.duration:g} s {metric.signal} was still above {metric.threshold:g}"
        for metric in mission.metrics
        if values[metric.name] is None
    )


def fly_all(mission: Mission, **options: Any) -> list[Flight]:
    """Return flights of all schemes of a mission, in order; options as for `fly`."""
    return [fly(mission, scheme.name, **options) for scheme in mission.schemes]
