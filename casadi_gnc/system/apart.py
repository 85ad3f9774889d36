"""Call a function of ours in a process of its own: what it runs is somebody else's, and may crash, hang or lie.

The process has this one's rights; it is no cage. It protects this process's memory and patience: arguments and answer
are JSON in files of a folder that both know, the answer is for the caller to check, and the process ends with its limit
of time, or with this one.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import logging
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

from casadi_gnc import errors
from casadi_gnc.errors import GncError
from casadi_gnc.system.processes import leave_with_parent

_ASKED, _ANSWER = "asked.json", "answer.json"
#: Most bytes of an answer.
_MOST = 2**24
_ROOT = str(Path(__file__).resolve().parents[2])
_BEGIN = "import sys; sys.path.insert(0, sys.argv[1]); from casadi_gnc.system.apart import serve; serve(*sys.argv[2:])"


class ApartError(GncError):
    """Report a process that ended otherwise than with an answer."""


def call(function: str, shop: Path, given: dict[str, Any], *, limit: float) -> Any:
    """Return what a function answers that is called as `function(shop, given)` in another process.

    Parameters
    ----------
    function : "module:name", of ours.
    shop : folder that both know; arguments and answer are written into it.
    given : plain data.
    limit : seconds after which the process is ended.

    Raises
    ------
    GncError
        The function's own, with its kind and sentence.
    ApartError
        Where the process crashed, took too long, or left no answer.
    """
    (shop / _ANSWER).unlink(missing_ok=True)
    (shop / _ASKED).write_text(json.dumps(given), encoding="utf-8")
    # -P: a file in the current folder is no module of ours.
    command = [sys.executable, "-P", "-c", _BEGIN, _ROOT, function, str(shop), str(os.getpid())]
    quiet = subprocess.DEVNULL
    with subprocess.Popen(
        command, cwd=shop, start_new_session=True, stdin=quiet, stdout=quiet, stderr=quiet
    ) as process:
        try:
            code = process.wait(limit)
        except subprocess.TimeoutExpired:
            raise ApartError(f"did not end within {limit:g} s") from None
        finally:
            _end(process)
    if code < 0:
        raise ApartError(f"was ended by {signal.Signals(-code).name}")
    return _answer(shop / _ANSWER, code)


def _end(process: subprocess.Popen) -> None:
    """End a process and all that it started."""
    if hasattr(os, "killpg"):
        with contextlib.suppress(OSError):
            os.killpg(process.pid, signal.SIGKILL)
    process.kill()


def _answer(path: Path, code: int) -> Any:
    """Return an answer; raise the error that it tells."""
    try:
        with path.open("rb") as file:
            content = file.read(_MOST + 1)
        found = json.loads(content) if len(content) <= _MOST else None
    except (OSError, ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise ApartError(f"ended with code {code} and without an answer")
    if "error" in found:
        kind = getattr(errors, str(found["error"]), None)
        is_ours = isinstance(kind, type) and issubclass(kind, GncError)
        raise (kind if is_ours else ApartError)(str(found.get("said"))[:2000])  # type: ignore[misc]
    return found.get("found")


def serve(function: str, shop: str, parent: str) -> None:
    """Answer one call; the other end of `call`."""
    leave_with_parent(int(parent))
    logging.disable()  # what code runs was said by the process that asked
    module, name = function.split(":")
    given = json.loads((Path(shop) / _ASKED).read_text(encoding="utf-8"))
    try:
        told = {"found": getattr(importlib.import_module(module), name)(Path(shop), given)}
    except GncError as error:
        told = {"error": type(error).__name__, "said": str(error)}
    except Exception as error:  # of code that is not ours; its sentence is all that can be said
        told = {"error": "", "said": f"failed: {type(error).__name__}: {error}"}
    (Path(shop) / _ANSWER).write_text(json.dumps(told), encoding="utf-8")
