"""The contestants of a run: their processes, and what each has spent and suffered."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from casadi_gnc.benchmarks.contest import Family
from casadi_gnc.benchmarks.measuring import Job, Mode
from casadi_gnc.benchmarks.results import Cell
from casadi_gnc.benchmarks.settings import Settings
from casadi_gnc.benchmarks.workers import Outcome, Worker


class Field:
    """Hold the processes of a run, and what each has spent and suffered.

    Parameters
    ----------
    name : of the contest.
    logs : folder for what the processes print.
    cells : those that were measured before.
    """

    def __init__(self, name: str, settings: Settings, logs: Path, cells: dict[tuple, Cell]) -> None:
        self._contest, self._settings, self._logs = name, settings, logs
        self._workers: dict[str, Worker] = {}
        self._cells = dict(cells)
        self._deaths: dict[str, int] = {}
        self._large: set[str] = set()
        for cell in cells.values():
            self._count(cell)

    def has(self, *key: Any) -> bool:
        """Return whether a cell was measured."""
        return key in self._cells

    def has_spent(self, who: str, family: str, number: int) -> bool:
        """Return whether a contestant has used its share; the first pass is always made."""
        if number == 0:
            return False
        spent = [cell for key, cell in self._cells.items() if key[:2] == (who, family)]
        return sum(sum(s for s in cell.seconds if s == s) for cell in spent) > self._settings.share

    def measure(self, who: str, family: Family, mode: Mode, number: int, started: float) -> Cell:
        """Return a cell, whatever happens to the contestant; `started` is when, in seconds of the run."""
        every = self._settings.cold_every if mode == "cold" else 1
        samples, failures = list(range(0, family.count, every)), {}
        outcome, is_new = Outcome(None), False
        while self._deaths.get(who, 0) < self._settings.deaths:
            rest = tuple(k for k in samples if str(k) not in failures)
            if not rest:
                break
            worker, is_new = self._worker(who)
            settings = self._settings
            job = Job(self._contest, who, family, settings.accuracy, mode, rest, settings.clock)
            outcome = worker.ask(job, settings.time_limit + settings.grace)
            if not outcome.failure:
                break
            if outcome.failure != "raised":
                self._deaths[who] = self._deaths.get(who, 0) + 1
            if outcome.sample < 0:  # no solve is to blame, so none of them can be had
                failures |= dict.fromkeys(map(str, rest), f"{outcome.failure}: {outcome.why}")
                break
            failures[str(outcome.sample)] = f"{outcome.failure}: {outcome.why}"
        cell = _cell((who, family.name, mode, number), samples, outcome, failures, started, is_new=is_new)
        self._cells[cell.key] = cell
        if cell.memory_MB > self._settings.memory_MB:
            self._large.add(who)
        return cell

    def _count(self, cell: Cell) -> None:
        lost = {text for text in cell.failures.values() if text.startswith(("died", "hung"))}
        self._deaths[cell.contestant] = self._deaths.get(cell.contestant, 0) + len(lost)

    def _worker(self, who: str) -> tuple[Worker, bool]:
        """Return a contestant's process, anew if it has grown too large, and whether it is a new one."""
        worker = self._workers.get(who)
        if worker is None:
            log = self._logs / ("".join(c if c.isalnum() else "_" for c in who) + ".txt")
            worker = self._workers[who] = Worker(log)
        if who in self._large:
            worker.stop()
            self._large.discard(who)
        return worker, not worker.is_running

    def stop(self) -> None:
        """End all processes."""
        for worker in self._workers.values():
            worker.stop()


def _cell(
    key: tuple[str, str, Mode, int],
    samples: list[int],
    outcome: Outcome,
    failures: dict[str, str],
    started: float,
    *,
    is_new: bool,
) -> Cell:
    """Return the cell of what was measured; a sample without an answer has no time and no good residual."""
    measured = outcome.measured
    shots = {shot.sample: shot for shot in measured.shots} if measured else {}
    failures = failures | {str(k): f"raised: {shot.failure}" for k, shot in shots.items() if shot.failure}
    judged = [shots[k].judgement if k in shots else None for k in samples]
    for k in samples:
        if k not in shots and str(k) not in failures:
            failures[str(k)] = "withdrawn: it had died or hung too often"
    return Cell(
        *key,
        samples=samples,
        seconds=[shots[k].seconds if k in shots and not shots[k].failure else math.nan for k in samples],
        own=[one.own_seconds if one else math.nan for one in judged],
        claimed=[bool(one and one.claimed) for one in judged],
        good=[bool(one and one.good) for one in judged],
        violation=[one.violation if one else math.inf for one in judged],
        gap=[one.gap if one else math.inf for one in judged],
        iterations=[one.iterations if one else 0 for one in judged],
        setup=min(measured.setups[is_new:], default=math.nan) if measured else math.nan,
        load=measured.setups[0] if measured and is_new else math.nan,
        first=measured.first if measured else math.nan,
        started=started,
        memory_MB=outcome.memory_MB,
        failures=failures,
        missed=[one.missed if one else math.nan for one in judged],
    )
