"""Fly a mission: build the tapes, choose an engine, run, and gather what came out."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib import metadata
from typing import Any

import numpy as np

from casadi_gnc.embedded.printer import Math
from casadi_gnc.errors import FlightError, NoCompilerError
from casadi_gnc.missions import metrics, tapes
from casadi_gnc.missions.engines import REGISTRY, Carried, CompiledEngine, Engine
from casadi_gnc.missions.flight import Flight
from casadi_gnc.missions.machine_engine import VirtualMachineEngine
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.parameters import Varied
from casadi_gnc.missions.recording import funnel_signals
from casadi_gnc.missions.requirements import Judge, Verdict
from casadi_gnc.missions.scheme import Scheme
from casadi_gnc.missions.timing import Mode
from casadi_gnc.status import StepStatus

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
    runner, notes = _engine(mission, chosen, built, engine, maths)
    carried = begin(mission, built, runner)
    return _flown(mission, chosen, built, runner, carried, decimation, maths, notes, progress)


def fly_case(
    varied: Varied,
    values: Sequence[float] | np.ndarray,
    seed: int,
    *,
    engine: EngineName = "c",
    maths: Math = "gnc",
    decimation: int | None = None,
    progress: Progress | None = None,
) -> Flight:
    """Fly a mission whose parameters are columns with some values of them, noise drawn from `seed`.

    The text that flies is that of every other case: the words are those of a batch. Other arguments as for `fly`.
    """
    mission = replace(varied.mission, noise=replace(varied.mission.noise, seed=seed), parts=varied.mission.parts_asked)
    chosen = mission.schemes[0]
    built = varied.tapes
    runner, notes = _engine(mission, chosen, built, engine, maths)
    carried = begin(mission, built, runner, np.array(values, dtype=float))
    every = mission.timing.record_every if decimation is None else decimation
    return _flown(mission, chosen, built, runner, carried, every, maths, notes, progress, told_of=varied.nominal)


def _flown(
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
    """Run all samples; `told_of` is the mission in numbers where the flown one has symbols."""
    known = told_of or mission
    total, chunk = mission.timing.samples, _CHUNK if built.symbolic else 200
    record = _room(-(-total // decimation), built.row.size)
    judges = _judges(mission, built)
    started, flown = time.perf_counter(), 0
    while flown < total:
        count = min(chunk if progress or total > _CHUNK else total, total - flown)
        kept = -(-flown // decimation)
        if judges:
            every = np.zeros((count, built.row.size))
            runner.run(carried, flown, count, 1, every)
            thinned = every[-flown % decimation :: decimation]
            record[kept : kept + len(thinned)] = thinned
            for judge in judges:
                judge.take(every)
            flown += count
        else:
            flown += runner.run(carried, flown, count, decimation, record[kept:])
        if progress:
            progress(flown, total)
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
        mission=mission.name,
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
            *_undefined(mission, values, raised),
            *_left(mission, built, record),
        ),
        verdicts=_verdicts(mission, built, carried.tally, values, judges),
    )


def _judges(mission: Mission, built: tapes.Tapes) -> list[Judge]:
    """Return what judges those requirements over signals that are not in the tally; it needs every sample."""
    watched = [one.requirement for one in built.watches]
    rest = [one for one in mission.requirements if one.formula and one not in watched]
    return [Judge(one, built.row, mission.timing.sample_period) for one in rest]


def _verdicts(
    mission: Mission, built: tapes.Tapes, tally: np.ndarray, values: dict[str, float | None], judges: list[Judge]
) -> dict[str, Verdict]:
    """Return the verdict of every requirement, by its id, in the mission's order; a flight that diverged meets none."""
    units = {metric.name: metric.unit for metric in mission.metrics}
    asked = [one for one in mission.requirements if one.metric]
    found = [Verdict(one, one.robustness(values), units[one.metric]) for one in asked]
    found += [
        Verdict(one.requirement, float(one.read(tally[built.tally.place(one.name)])), one.unit) for one in built.watches
    ]
    found += [judge.verdict() for judge in judges]
    if StepStatus.DIVERGED in metrics.statuses(built.tally, tally):
        found = [replace(verdict, robustness=-math.inf) for verdict in found]
    by_id = {verdict.requirement.id: verdict for verdict in found}
    return {one.id: by_id[one.id] for one in mission.requirements}


def cautions(scheme: Scheme) -> tuple[str, ...]:
    """Return what the law of a scheme says against its sample period before it flies, a sentence each."""
    found = (check for check in scheme.law.checks() if check.name.startswith("sampling."))
    return tuple(f"{check.consequence} {check.remedy}" for check in found if check.verdict in ("warn", "fail"))


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


def _engine(
    mission: Mission, scheme: Scheme, built: tapes.Tapes, engine: EngineName, maths: Math
) -> tuple[Engine, tuple[str, ...]]:
    kind = REGISTRY.find(engine)
    if kind is not CompiledEngine:
        return kind(mission, scheme, built), ()
    try:
        return CompiledEngine(mission, scheme, built, maths), ()
    except NoCompilerError as error:
        note = f"{error}. Flown on CasADi's virtual machine instead: some hundred times slower, with libm's last bits"
        return VirtualMachineEngine(mission, scheme, built), (note,)


def _undefined(
    mission: Mission, values: dict[str, float | None], raised: dict[StepStatus, tuple[int, float]]
) -> tuple[str, ...]:
    """Return a sentence for every metric that has no value."""
    if StepStatus.DIVERGED in raised:
        return (f"diverged at {raised[StepStatus.DIVERGED][1]:g} s: no metric of this flight has a value",)
    end, notes = mission.timing.duration, []
    for metric in mission.metrics:
        if values[metric.name] is None and metric.kind == "settling":
            notes.append(f"{metric.name}: never; at {end:g} s {metric.signal} was still above {metric.threshold:g}")
        elif metric.after > end:
            notes.append(f"{metric.name}: none; it looks from {metric.after:g} s on, and the flight ends at {end:g} s")
        elif values[metric.name] is None:
            notes.append(f"{metric.name}: none; no finite sample of {metric.signal} from {metric.after:g} to {end:g} s")
    return tuple(notes)


def _left(mission: Mission, built: tapes.Tapes, record: np.ndarray) -> tuple[str, ...]:
    """Return for every funnel that was left, as far as samples were kept, when and on which axis first."""
    notes, time = [], record[:, built.row.place("time")][:, 0]
    for funnel in mission.funnels:
        if funnel.signal not in built.row:
            continue
        lower, upper = (record[:, built.row.place(name)] for name in funnel_signals(mission, funnel).names[:2])
        signal = record[:, built.row.place(funnel.signal)]
        outside = ~((signal > lower) & (signal < upper))
        if outside.any():
            first = int(outside.any(axis=1).argmax())
            axes = " and ".join(str(axis) for axis in np.flatnonzero(outside[first]) + 1)
            notes.append(f"{funnel.signal} was outside its funnel from {time[first]:g} s on axis {axes} on")
    return tuple(notes)


def fly_all(mission: Mission, **options: Any) -> list[Flight]:
    """Return flights of all schemes of a mission, in order; options as for `fly`."""
    return [fly(mission, scheme.name, **options) for scheme in mission.schemes]
