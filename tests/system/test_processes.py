"""No worker outlives the process that started it. Truth: the system's own list of processes."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

POOL = """
import os, sys, time
from concurrent.futures import wait
from casadi_gnc.system import processes
if __name__ == "__main__":
    with processes.pool(2) as pool:
        tasks = [pool.submit({task}) for _ in range(2)]
        if "{busy}" == "idle":
            wait(tasks)
        print("on", flush=True)
        time.sleep(60)
"""
#: What the workers do, and the call.
WORK = {"idle": "os.getpid", "sleeping": "time.sleep, 60", "computing": "sum, range(10**12)"}


def of_session(session):
    """Return the processes of a session that are alive."""
    found = []
    for place in Path("/proc").glob("[0-9]*"):
        try:
            fields = (place / "stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if fields[0] != "Z" and int(fields[3]) == session:
            found.append(int(place.name))
    return found


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.parametrize("busy", WORK)
def test_workers_end_with_their_pool(busy, tmp_path):
    """Waiting for a task, in one, or before the first: killed as no program can prevent."""
    (tmp_path / "main.py").write_text(POOL.format(task=WORK[busy], busy=busy))
    run = subprocess.Popen(
        [sys.executable, tmp_path / "main.py"],
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, start_new_session=True,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
    )  # fmt: skip
    assert run.stdout.readline() == "on\n"
    until = time.monotonic() + 20
    while len(of_session(run.pid)) < 3 and time.monotonic() < until:
        time.sleep(0.05)
    assert len(of_session(run.pid)) >= 3  # two workers, beside what the library needs
    run.send_signal(signal.SIGKILL)
    run.wait()
    run.stdout.close()
    until = time.monotonic() + 10
    while of_session(run.pid) and time.monotonic() < until:
        time.sleep(0.05)
    left = of_session(run.pid)
    for process in left:
        os.kill(process, signal.SIGKILL)
    assert left == []


def test_what_takes_too_long_is_ended_with_its_process():
    """Code that never comes back to Python, here a sleep of the C library, is ended as well; its process with it."""
    from casadi_gnc.system.processes import within

    assert within(60.0, abs, -3) == 3
    began = time.monotonic()
    with pytest.raises(TimeoutError):
        within(1.0, time.sleep, 600.0)
    assert time.monotonic() - began < 60.0
    assert not [child for child in multiprocessing.active_children() if child.is_alive()]


def test_what_is_raised_there_is_raised_here():
    from casadi_gnc.errors import ProblemError
    from casadi_gnc.problem_files.document import read
    from casadi_gnc.system.processes import within

    with pytest.raises(ProblemError, match="no problem file 'nowhere'"):
        within(60.0, read, "nowhere")
    with pytest.raises(OSError, match="ended without an answer"):
        within(60.0, os._exit, 3)
