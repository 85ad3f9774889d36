"""The process of one contestant: read jobs, measure, answer, until there is no more to read.

    python -m casadi_gnc.benchmarks.serving COUNTER LOG

COUNTER is the inherited descriptor of the file of `workers.BEAT`; LOG takes whatever solvers print.
"""

from __future__ import annotations

import mmap
import os
import pickle
import signal
import sys

from casadi_gnc.benchmarks.measuring import measure
from casadi_gnc.benchmarks.workers import BEAT, Outcome, answer
from casadi_gnc.errors import GncError
from casadi_gnc.system.processes import leave_with_parent


def main() -> None:
    """Serve until the asking end is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to handle
    # A solver that hangs must not outlive its run.
    leave_with_parent(int(os.environ.get("CASADI_GNC_PARENT", os.getppid())))
    jobs, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    beat = mmap.mmap(int(sys.argv[1]), BEAT.size)
    log = os.open(sys.argv[2], os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
    for descriptor in (1, 2):
        os.dup2(log, descriptor)
    ticks = 0

    def tell(sample: int) -> None:
        nonlocal ticks
        ticks += 1
        BEAT.pack_into(beat, 0, sample, ticks)

    while True:
        try:
            job = pickle.load(jobs)
        except EOFError:
            return
        tell(-1)
        try:
            outcome = Outcome(measure(job, tell), memory_MB=_memory())
        except GncError as error:
            outcome = Outcome(None, "raised", str(error))
        except Exception as error:
            outcome = Outcome(None, "raised", f"{type(error).__name__}: {error}")
        answer(answers, outcome)


def _memory() -> float:
    """Return the largest resident size of this process so far [MB]."""
    try:
        import resource
    except ImportError:
        return float("nan")
    unit = 1e6 if sys.platform == "darwin" else 1e3  # bytes there, kilobytes elsewhere
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit


if __name__ == "__main__":
    main()
