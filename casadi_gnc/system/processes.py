"""Processes that work for this one, and end when it does, however it ends.

A pool of the standard library waits for ever for the next task when the process that filled it is killed. Whoever
starts processes here takes `pool`; a process that was started otherwise calls `leave_with_parent` first.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import threading
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import connection, get_context, parent_process

_PR_SET_PDEATHSIG = 1


def pool(processes: int) -> ProcessPoolExecutor:
    """Return a pool of fresh interpreters that end with this process.

    Parameters
    ----------
    processes : at most so many work side by side.
    """
    return ProcessPoolExecutor(
        processes, mp_context=get_context("spawn"), initializer=_leave_with_pool, initargs=(os.getpid(),)
    )


def leave_with_parent(parent: int) -> None:
    """End this process as soon as the one that started it has ended, where the system can (Linux).

    Parameters
    ----------
    parent : number of the process that started this one; if it is gone already, this one ends at once.
    """
    if sys.platform != "linux":
        return
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)


def _leave_with_pool(parent: int) -> None:
    """End a worker with its pool's process: by the system where it can, else by a thread that waits for it."""
    leave_with_parent(parent)
    started_by = parent_process()
    if started_by is not None and sys.platform != "linux":
        threading.Thread(target=_wait_for, args=(started_by.sentinel,), daemon=True).start()


def _wait_for(sentinel: int) -> None:
    connection.wait([sentinel])
    os._exit(1)
