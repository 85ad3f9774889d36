"""Measure one cell: one contestant, one family, warm or cold, once through its samples.

========  ====================================================================================
column    what is timed
========  ====================================================================================
set-up    making the runner; in the first cell of a process it includes importing and compiling
first     the first solve after it, nothing warmed up
warm      solves one after another, each from what the solver kept of the last; three solves
          that warm up caches are discarded before
cold      each solve by a runner freshly set up, so that nothing is known of an earlier answer; one
          such solve is discarded before
========  ====================================================================================

Answers are judged after the last of them, so that judging does not cool the caches between two.
"""

from __future__ import annotations

import gc
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from casadi_gnc.benchmarks.contest import Accuracy, Family, Judgement, Runner, contest

Mode = Literal["warm", "cold"]
#: Time as it passes, or processor time of the contestant, which other work on the machine hardly changes.
Clock = Literal["wall", "cpu"]
_CLOCKS: dict[Clock, Callable[[], int]] = {"wall": time.perf_counter_ns, "cpu": time.process_time_ns}
#: Solves before the warm ones that are not counted.
WARM_UP = 3


@dataclass(frozen=True, eq=False)
class Job:
    """Say what to measure.

    Parameters
    ----------
    samples : numbers of the family's samples, in order.
    """

    contest: str
    contestant: str
    family: Family
    accuracy: Accuracy
    mode: Mode
    samples: tuple[int, ...]
    clock: Clock = "wall"


@dataclass(frozen=True, eq=False)
class Shot:
    """Hold one solve: its sample, its time, what was said of it, or how it failed."""

    sample: int
    seconds: float
    judgement: Judgement | None
    failure: str = ""


@dataclass(frozen=True, eq=False)
class Measured:
    """Hold what a cell gave: seconds of each set-up in order, of the first solve, and all solves."""

    setups: list[float]
    first: float
    shots: list[Shot]


#: Told before each phase: sample number, or -1 outside a timed solve.
Beat = Callable[[int], None]


def measure(job: Job, beat: Beat) -> Measured:
    """Return the measurements of a job; what the set-up raises is raised.

    Parameters
    ----------
    beat : called with the sample before each solve and with -1 before anything else, so that a
        watcher knows what hangs.
    """
    runners, clock = contest(job.contest), _CLOCKS[job.clock]

    def fresh() -> tuple[Runner, float]:
        beat(-1)
        started = clock()
        made = runners.runner(job.contestant, job.family, job.accuracy)
        return made, 1e-9 * (clock() - started)

    runner, once = fresh()
    setups = [once]
    said: list[tuple[int, float, Any]] = []
    gc.collect()
    gc.disable()
    try:
        first, _ = _timed(runner, job.samples[0], clock, beat)
        if job.mode == "warm":
            for k in job.samples[:WARM_UP]:
                _timed(runner, k, clock, beat)
        for k in job.samples:
            if job.mode == "cold":
                runner, once = fresh()
                setups.append(once)
            said.append((k, *_timed(runner, k, clock, beat)))
            if job.mode == "warm" and isinstance(said[-1][2], Exception):
                runner, _ = fresh()  # what is left after an exception is not trusted
    finally:
        gc.enable()
        beat(-1)
    return Measured(setups, first, [_judged(runner, *one) for one in said])


def _timed(runner: Runner, k: int, clock: Callable[[], int], beat: Beat) -> tuple[float, Any]:
    """Return seconds a call, and what was said or raised."""
    beat(k)
    started = clock()
    try:
        said = runner.run(k)
    except Exception as error:
        said = error
    spent = clock() - started
    return 1e-9 * spent / getattr(runner, "calls", 1), said


def _judged(runner: Runner, k: int, seconds: float, said: Any) -> Shot:
    if isinstance(said, Exception):
        return Shot(k, seconds, None, f"{type(said).__name__}: {said}")
    return Shot(k, seconds, runner.judge(k, said))
