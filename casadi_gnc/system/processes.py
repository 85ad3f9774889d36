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
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import connection, get_context, parent_process
from typing import Any

from casadi_gnc.errors import GncError

_PR_SET_PDEATHSIG = 1
#: Seconds that nobody minds to wait without being told why.
_SOON = 5.0


def pool(processes: int) -> ProcessPoolExecutor:
    """Return a pool of fresh interpreters that end with this process.

    Parameters
    ----------
    processes : at most so many work side by side.
    """
    return ProcessPoolExecutor(
        processes, mp_context=get_context("spawn"), initializer=_leave_with_pool, initargs=(os.getpid(),)
    )


def within(seconds: float, work: Callable[..., Any], *given: Any, told: Callable[[], Any] | None = None) -> Any:
    """Return what a function makes of what is given, computed by a fresh interpreter that is ended after a time.

    Code of libraries cannot be interrupted otherwise. For programs: whoever calls this at the top of a script of their
    own needs a guard, as every script that starts interpreters does.

    Parameters
    ----------
    seconds : after which there is no answer, 0 for no limit.
    work, given : a function of a module, and its arguments; both are pickled.
    told : called once, when an answer takes longer than some seconds.

    Raises
    ------
    TimeoutError
        Where there was no answer in time.
    GncError
        What the function raised.
    OSError
        Where the interpreter ended without an answer.
    """
    context = get_context("spawn")
    here, there = context.Pipe(duplex=False)
    worker = context.Process(target=_answer, args=(there, os.getpid(), work, given), daemon=True)
    worker.start()
    there.close()
    try:
        began = time.monotonic()
        if told is not None and not here.poll(min(_SOON, seconds or _SOON)):
            told()
        left = None if not seconds else max(0.0, seconds - (time.monotonic() - began))
        if not here.poll(left):
            raise TimeoutError
        try:
            is_answer, found = here.recv()
        except EOFError:
            raise OSError("the process that computed ended without an answer; is there enough memory?") from None
    finally:
        worker.kill()
        worker.join()
        here.close()
    if not is_answer:
        raise found
    return found


def _answer(there: connection.Connection, parent: int, work: Callable[..., Any], given: tuple[Any, ...]) -> None:
    _leave_with_pool(parent)
    try:
        there.send((True, work(*given)))
    except GncError as error:
        there.send((False, type(error)(str(error))))


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
