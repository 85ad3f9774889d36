"""How a benchmark measures."""

from __future__ import annotations

from dataclasses import dataclass

from casadi_gnc.benchmarks.contest import Accuracy
from casadi_gnc.benchmarks.measuring import Clock
from casadi_gnc.errors import BenchmarkError


@dataclass(frozen=True)
class Settings:
    """Say how to measure.

    Parameters
    ----------
    accuracy : which residuals count as a success.
    samples : at most so many of a family; None for all.
    passes : through all samples, warm; `cold_passes` with a fresh set-up for every `cold_every`-th sample.
    clock : "wall", or "cpu" for a machine that has other work: then waiting for anything counts nothing.
    time_limit : of a solve, [s]: what takes longer has failed, and a failure is charged it.
    grace : beyond the time limit, [s], after which a solve is killed, by the wall clock.
    run_limit : of the whole run, [s]: no cell is begun after it.
    share : of a contestant's time in one family, [s], after which it is given no further pass there.
    shift : of the geometric mean, [s].
    seed : of the order.
    deaths : crashes and hang-ups after which a contestant takes no further part; it is charged the limit.
    memory_MB : size at which a contestant's process is started anew.
    """

    accuracy: Accuracy = "mid"
    samples: int | None = None
    passes: int = 5
    cold_passes: int = 2
    cold_every: int = 5
    clock: Clock = "wall"
    time_limit: float = 1.0
    grace: float = 5.0
    run_limit: float = 150.0
    share: float = 1.0
    shift: float = 10e-6
    seed: int = 0
    deaths: int = 3
    memory_MB: float = 4000.0

    def __post_init__(self) -> None:
        for name in (
            "passes",
            "cold_every",
            "time_limit",
            "grace",
            "run_limit",
            "share",
            "shift",
            "deaths",
            "memory_MB",
        ):
            if not getattr(self, name) > 0:
                raise BenchmarkError(f"{name} is {getattr(self, name)}, expected more than 0")
        if self.samples is not None and self.samples < 1:
            raise BenchmarkError(f"samples is {self.samples}, expected 1 or more")
        if self.accuracy not in ("low", "mid", "high"):
            raise BenchmarkError(f"accuracy {self.accuracy!r} is not known; there is low, mid, high")
        if self.clock not in ("wall", "cpu"):
            raise BenchmarkError(f"clock {self.clock!r} is not known; there is wall, cpu")
