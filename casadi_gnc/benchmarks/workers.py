"""One process a contestant, so that one that crashes, hangs or leaks takes nothing along.

The process (`serving`) is asked over its standard input and answers over its standard output; a counter
in a file mapped into both says which sample it is on. What passes the time limit of a solve is killed,
and the sample known.
"""

from __future__ import annotations

import contextlib
import mmap
import os
import pickle
import queue
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from casadi_gnc.benchmarks.measuring import Job, Measured

#: A set-up may import packages and compile; a solve may not.
SETUP_LIMIT = 120.0
#: Linear algebra on one thread, for all alike.
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "RAYON_NUM_THREADS")
#: What the counter's file holds: the sample, -1 outside a solve, and the number of beats.
BEAT = struct.Struct("qq")


@dataclass(frozen=True, eq=False)
class Outcome:
    """Hold how a job ended.

    Parameters
    ----------
    measured : what it gave; None if it failed.
    failure : "died", "hung" or "raised"; empty if it did not fail.
    why : a sentence.
    sample : at which it died or hung; -1 outside a solve.
    memory_MB : largest resident size of the process so far; NaN where the system does not say.
    """

    measured: Measured | None
    failure: str = ""
    why: str = ""
    sample: int = -1
    memory_MB: float = float("nan")


class _Process:
    """A process that serves, the counter it shares, and a thread that waits for its answers."""

    def __init__(self, log: Path) -> None:
        self._counter = tempfile.TemporaryFile()  # noqa: SIM115
        self._counter.write(BEAT.pack(-1, 0))
        self._counter.flush()
        self._beat = mmap.mmap(self._counter.fileno(), BEAT.size)
        command = [sys.executable, "-m", "casadi_gnc.benchmarks.serving", str(self._counter.fileno()), str(log)]
        self.popen = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={**os.environ, **dict.fromkeys(THREADS, "1"), "CASADI_GNC_PARENT": str(os.getpid())},
            pass_fds=(self._counter.fileno(),),
        )
        self.answers: queue.Queue[Outcome | None] = queue.Queue()
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        assert self.popen.stdout is not None
        with contextlib.suppress(Exception):  # an answer cut short is no answer
            while True:
                self.answers.put(pickle.load(self.popen.stdout))
        self.answers.put(None)

    def send(self, job: Job) -> None:
        assert self.popen.stdin is not None
        pickle.dump(job, self.popen.stdin)
        self.popen.stdin.flush()

    @property
    def beat(self) -> tuple[int, int]:
        return BEAT.unpack(self._beat[:])

    def end(self, *, kindly: bool) -> None:
        with contextlib.suppress(OSError):
            if self.popen.stdin is not None:
                self.popen.stdin.close()  # it reads the end and leaves
        if kindly:
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.popen.wait(1.0)
        self.popen.kill()
        self.popen.wait()
        if self.popen.stdout is not None:
            with contextlib.suppress(queue.Empty):
                while self.answers.get(timeout=1.0) is not None:
                    pass
            self.popen.stdout.close()
        self._beat.close()
        self._counter.close()


class Worker:
    """Run jobs of one contestant in a process of its own, started when first asked.

    Parameters
    ----------
    log : file that takes what the process prints.
    """

    def __init__(self, log: Path) -> None:
        self._log = log
        self._process: _Process | None = None

    @property
    def is_running(self) -> bool:
        """Whether there is a process."""
        return self._process is not None

    def ask(self, job: Job, limit: float) -> Outcome:
        """Return the outcome of a job, none of whose solves may take longer than `limit` [s], or is killed."""
        if self._process is None:
            self._process = _Process(self._log)
        process = self._process
        try:
            process.send(job)
        except OSError:
            return self._died(process)
        (_, ticks), since = process.beat, time.monotonic()
        while True:
            with contextlib.suppress(queue.Empty):
                outcome = process.answers.get(timeout=0.05)
                return self._died(process) if outcome is None else outcome
            (sample, now_ticks), now = process.beat, time.monotonic()
            if now_ticks != ticks:
                ticks, since = now_ticks, now
            allowed = SETUP_LIMIT if sample < 0 else limit
            if now - since > allowed:
                what = "a set-up" if sample < 0 else "a solve"
                self.stop(kindly=False)
                return Outcome(None, "hung", f"no end of {what} within {allowed:g} s; killed", sample)

    def stop(self, *, kindly: bool = True) -> None:
        """End the process, if there is one."""
        if self._process is not None:
            self._process.end(kindly=kindly)
            self._process = None

    def _died(self, process: _Process) -> Outcome:
        sample, code = process.beat[0], 0
        with contextlib.suppress(subprocess.TimeoutExpired):
            code = process.popen.wait(5.0)
        self.stop(kindly=False)
        why = f"ended by {signal.Signals(-code).name}" if code < 0 else f"ended with code {code}"
        return Outcome(None, "died", f"its process was {why}" if code < 0 else f"its process {why}", sample)


def answer(stream: Any, outcome: Outcome) -> None:
    """Write an outcome; the other end of `Worker.ask`."""
    pickle.dump(outcome, stream)
    stream.flush()
