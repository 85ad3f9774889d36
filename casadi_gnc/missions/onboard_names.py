"""The quantities that laws name on their way: what their methods return, found again in the tapes of a controller.

Whoever reads the C of a step sees one long expression; whoever wrote the law saw methods with names, equations and
files. Python's profiler tells of each method that returns while the expression is made, in the order in which they do.
"""

from __future__ import annotations

import inspect
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

import casadi as ca

from casadi_gnc.laws import Law, sampling
from casadi_gnc.missions.loop import Loop
from casadi_gnc.missions.onboard_notes import told_of

#: A title, and the expression that it names.
Named = list[tuple[str, ca.SX]]
#: Rooms whose functions are read like the lines of a paper.
_ROOMS = tuple(f"casadi_gnc.{room}." for room in ("laws", "mechanics", "navigation", "allocation"))


@contextmanager
def listened() -> Iterator[Named]:
    """Collect what methods of laws and mechanics return while the context lasts."""
    found: Named = []

    def hear(frame: FrameType, event: str, value: Any) -> None:
        if event != "return":
            return
        if isinstance(value, tuple) and isinstance(frame.f_locals.get("self"), Loop):
            found.append((told_of(Loop, frame.f_code.co_name), ca.vertcat(*map(ca.SX, value))))
        if not isinstance(value, ca.SX):
            return
        if frame.f_code is sampling.at.__code__:  # what was made of the symbol was made of its value
            _, symbol, memory = (frame.f_locals[name] for name in inspect.signature(sampling.at).parameters)
            values = ca.substitute([each for _, each in found], [symbol], [ca.SX(memory)])
            found[:] = [(title, each) for (title, _), each in zip(found, values, strict=True)]
        elif title := _title(frame):
            found.append((title, ca.SX(value)))

    before = sys.getprofile()
    sys.setprofile(hear)
    try:
        yield found
    finally:
        sys.setprofile(before)


def _title(frame: FrameType) -> str:
    """Return what a function is called in the C; "" where it has nothing to say to a reader."""
    name, module = frame.f_code.co_name, str(frame.f_globals.get("__name__", ""))
    if name.startswith(("_", "<")):
        return ""
    owner = frame.f_locals.get("self")
    if not (module.startswith(_ROOMS) or isinstance(owner, Law)):
        return ""
    if owner is not None:
        return told_of(owner, name) if hasattr(type(owner), name) else ""
    function = frame.f_globals.get(name)
    if not inspect.isfunction(function) or function.__code__ is not frame.f_code:
        return ""
    first = (inspect.getdoc(function) or "").partition("\n")[0].removeprefix("Return ").rstrip(".")
    return f"{name} in {module.replace('.', '/')}.py" + (f": {first}" if first else "")
