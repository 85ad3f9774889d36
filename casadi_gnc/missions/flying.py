"""Fly a mission: build the tapes, choose an engine, run, and gather what came out."""

from __future__ import annotations

import time
from collections.abc import Callable
from importlib import metadata
from typing import Any

import numpy as np

from casadi_gnc.embedded.printer import Math
from casadi_gnc.errors import FlightError, NoCompilerError
from casadi_gnc.missions import metrics, tapes
from casadi_gnc.missions.engines import REGISTRY, Carried, CompiledEngine, Engine
from casadi_gnc.missions.flight import Flight
from casadi_gnc.missions.judging import judges_of, verdicts
from casadi_gnc.missions.machine_engine import VirtualMachineEngine
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.noting import cautions, left_funnels, undefined
from casadi_gnc.missions.scheme import Scheme
from casadi_gnc.missions.timing import Mode

EngineName = Any
Progress = Callable[[int, int], None]

#: Samples between two calls of the progress function, at most.
_CHUNK = 50_000
#: Bytes of a record beyond which a flight is refused.
_LARGEST_RECORD = 4e9


def fly(
    mission: Mission,
    scheme: str | None = None,
    *,
    engine: EngineName = "c",
    maths: Math = "gnc",
    mode: Mode | None = None,
    decimation: int | None = None,
    progress: Progress | None = None,
) -> Flight:
    """Fly one scheme of a mission.

    Parameters
    ----------
    mission : from `casadi_gnc.load`.
    scheme : its name; the first one of the mission by default.
    engine : "c" (compiled), "vm" (CasADi's virtual machine), another engine's name or class. Without a compiler "c"
        becomes "vm" and the flight's notes say so.
    maths : elementary functions of the C: "gnc" (the same words on every machine) or "libm".
    mode : "sampled" or "continuous" instead of the mission's own.
    decimation : keep every so many-th sample, by default as the mission says; metrics and statuses use all of them.
    progress : called as progress(samples flown, samples in all).

    Raises
    ------
    FlightError
        For an unknown scheme or a decimation below 1.
    """
    decimation = mission.timing.record_every if decimation is None else decimation
    if decimation < 1:
        raise FlightError(f"decimation is {decimation}, expected 1 or more")
    if maths not in ("gnc", "libm"):
        raise FlightError(f"maths is {maths!r}, expected 'gnc' or 'libm'")
    if mode not in (None, "sampled", "continuous"):
        raise FlightError(f"mode is {mode!r}, expected 'sampled' or 'continuous'")
    if mode is not None and mode != mission.timing.mode:
        mission = mission.with_timing(mode=mode)
    chosen = mission.scheme(scheme)
    built = tapes.tapes_of(mission, chosen)
    runner, notes = engine_of(mission, chosen, built, engine, maths)
    carried = begin(mission, built, runner)
    return flown(mission, chosen, built, runner, carried, decimation, maths, notes, progress)


def flown(
    mission: Mission,
    chosen: Scheme,
    built: tapes.Tapes,
    runner: Engine,
    carried: Carried,
    decimation: int,
    maths: Math,
    notes: tuple[str, ...],
    progress: Progress | None,
    told_of: Mission | None = None,
) -> Flight:
    """Run all samples and gather what came out; `told_of` is the mission in numbers where the flown one has symbols."""
    known = told_of or mission
    total, chunk = mission.timing.samples, _CHUNK if built.symbolic else 200
    record = _room(-(-total // decimation), built.row.size)
    judges = judges_of(mission, built)
    started, done = time.perf_counter(), 0
    while done < total:
        count = min(chunk if progress or total > _CHUNK else total, total - done)
        kept = -(-done // decimation)
        if judges:
            every = np.zeros((count, built.row.size))
            runner.run(carried, done, count, 1, every)
            thinned = every[-done % decimation :: decimation]
            record[kept : kept + len(thinned)] = thinned
            for judge in judges:
                judge.take(every)
            done += count
        else:
            done += runner.run(carried, done, count, decimation, record[kept:])
        if progress:
            progress(done, total)
    seconds = time.perf_counter() - started
    made = {
        "engine": runner.name,
        "maths": maths if runner.name == "c" else "libm",
        "mode": mission.timing.mode,
        "feedback": chosen.feedback,
        "seed": mission.noise.seed if mission.truth.noise.size else None,
        "problem_sha256": known.digest,
        "casadi_gnc": metadata.version("casadi-gnc"),
        "casadi": metadata.version("casadi"),
        "compiler": runner.compiler.version if isinstance(runner, CompiledEngine) else "",
    }
    period = mission.timing.sample_period
    raised = metrics.statuses(built.tally, carried.tally)
    values = metrics.read(tuple(mission.metrics), built.tally, carried.tally, (total - 1) * period, period)
    return Flight(
        mission=known.name,
        scheme=chosen.name,
        title=chosen.title or chosen.name,
        layout=built.row,
        samples=record,
        metrics=values,
        metric_units={metric.name: metric.unit for metric in mission.metrics},
        statuses=raised,
        made=made,
        seconds=seconds,
        notes=(
            *known.craft.notes(),
            *cautions(known.scheme(chosen.name)),
            *notes,
            *undefined(mission, values, raised),
            *left_funnels(mission, built, record),
        ),
        verdicts=verdicts(mission, built, carried.tally, values, judges),
    )


def _room(rows: int, columns: int) -> np.ndarray:
    """Return the array of the record; refuse one that would not fit."""
    if rows * columns * 8 > _LARGEST_RECORD:
        size = rows * columns * 8 / 1e9
        raise FlightError(f"{rows} samples of {columns} numbers need {size:.1f} GB; keep fewer by a larger decimation")
    return np.zeros((rows, columns))


def begin(mission: Mission, built: tapes.Tapes, runner: Engine, values: np.ndarray | None = None) -> Carried:
    """Return the columns at t = 0: the mission's start, the law's first memory, actuators at rest.

    With parameters, `values` are theirs.
    """
    if values is None:
        derived, x = np.zeros(0), np.array(mission.start, dtype=float)
    else:
        derived, x = runner.configure(values)
    good, memory = runner.first(x, derived)
    return Carried(
        x=x,
        m=memory,
        actuators=np.zeros(mission.truth.inputs.size),
        good=good,
        tally=metrics.fresh(tuple(mission.metrics), built.tally, built.watches),
        derived=derived,
    )


def engine_of(
    mission: Mission, scheme: Scheme, built: tapes.Tapes, engine: EngineName, maths: Math
) -> tuple[Engine, tuple[str, ...]]:
    """Return the engine of a name or class, made for a scheme, and what is to be told of the choice."""
    kind = REGISTRY.find(engine)
    if kind is not CompiledEngine:
        return kind(mission, scheme, built), ()
    try:
        return CompiledEngine(mission, scheme, built, maths), ()
    except NoCompilerError as error:
        note = f"{error}. Flown on CasADi's virtual machine instead: some hundred times slower, with libm's last bits"
        return VirtualMachineEngine(mission, scheme, built), (note,)


def fly_all(mission: Mission, **options: Any) -> list[Flight]:
    """Return flights of all schemes of a mission, in order; options as for `fly`."""
    return [fly(mission, scheme.name, **options) for scheme in mission.schemes]
