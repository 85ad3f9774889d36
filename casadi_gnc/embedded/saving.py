"""Write a controller down, and read it back: what a package keeps whose mission no file describes.

The functions are CasADi's own serialisation, everything else is plain JSON; numbers keep every bit.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from importlib import metadata
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.allocation.problem import AllocationProblem
from casadi_gnc.embedded.controller import Controller, Tunable
from casadi_gnc.embedded.faults import Faults
from casadi_gnc.embedded.monitor import Monitor, Watched
from casadi_gnc.errors import PackageError
from casadi_gnc.signals import Layout, Signal

_FORMAT = 1
_LAYOUTS = ("measured", "memory", "wanted", "limited", "actuators", "report")
_COLUMNS = ("lower", "upper", "least", "most")
_ARRAYS = ("effectiveness", "lower", "upper", "coupling", "errors", "effort_weight", "change_weight", "max_step",
           "preferred")  # fmt: skip


def to_text(controller: Controller) -> str:
    """Return a controller as JSON."""
    content: dict[str, Any] = {name: getattr(controller, name) for name in ("title", "source", "scheme", "period")}
    content |= {name: [_signal(each) for each in getattr(controller, name).signals] for name in _LAYOUTS}
    content |= {name: [_number(value) for value in getattr(controller, name)] for name in _COLUMNS}
    content["tapes"] = {name: tape.serialize() for name, tape in controller.tapes.items()}
    content["statuses"] = [[bit, name, sentence] for bit, (name, sentence) in controller.statuses.items()]
    content["tunables"] = [asdict(one) for one in controller.tunables]
    content["notes"], content["marks"] = controller.notes, controller.marks
    if controller.monitor is not None:
        own = controller.monitor
        kept = {"watched": [asdict(one) for one in own.watched], "tape": own.tape.serialize(), "horizon": own.horizon}
        content["monitor"] = {**kept, "left_out": own.left_out, "lines": own.lines, "initial": own.initial}
        content["monitor"] |= {"finish": own.finish}
    if controller.faults is not None:
        content["faults"] = asdict(controller.faults)
    content["allocation"] = None if controller.allocation is None else _problem(controller.allocation)
    return json.dumps({"format": _FORMAT, "casadi": metadata.version("casadi"), **content}, indent=1) + "\n"


def from_text(text: str) -> Controller:
    """Return the controller of a JSON text; raise `PackageError` where it is none of this version."""
    try:
        content = json.loads(text)
        if content["format"] != _FORMAT:
            raise PackageError(f"a controller of format {content['format']}; this version reads format {_FORMAT}")
        given: dict[str, Any] = {name: content[name] for name in ("title", "source", "scheme", "period")}
        given |= {name: Layout(tuple(_signal_of(each) for each in content[name])) for name in _LAYOUTS}
        given |= {name: tuple(float(value) for value in content[name]) for name in _COLUMNS}
        given["tapes"] = {name: ca.Function.deserialize(tape) for name, tape in content["tapes"].items()}
        given["statuses"] = {bit: (name, sentence) for bit, name, sentence in content["statuses"]}
        given["tunables"] = tuple(Tunable(**{**one, "default": tuple(one["default"])}) for one in content["tunables"])
        given["notes"] = {
            tape: {port: tuple((int(n), str(what)) for n, what in blocks) for port, blocks in ports.items()}
            for tape, ports in content.get("notes", {}).items()
        }
        given["marks"] = {
            tape: tuple((str(title), tuple(int(k) for k in nodes)) for title, nodes in marks)
            for tape, marks in content.get("marks", {}).items()
        }
        given["monitor"] = _monitor_of(content["monitor"]) if "monitor" in content else None
        given["faults"] = Faults.from_data(content["faults"]) if "faults" in content else None
        given["allocation"] = None if content["allocation"] is None else _problem_of(content["allocation"])
    except (ValueError, KeyError, TypeError, RuntimeError) as error:
        raise PackageError(f"the controller cannot be read: {type(error).__name__}: {str(error)[:200]}") from error
    return Controller(**given)


def _monitor_of(content: dict[str, Any]) -> Monitor:
    return Monitor(
        watched=tuple(Watched(**one) for one in content["watched"]),
        left_out=tuple((str(name), str(why)) for name, why in content["left_out"]),
        tape=ca.Function.deserialize(content["tape"]),
        lines=tuple(int(length) for length in content["lines"]),
        initial=tuple(float(value) for value in content["initial"]),
        horizon=int(content["horizon"]),
        finish=int(content["finish"]),
    )


def _number(value: float) -> float | str:
    return float(value) if math.isfinite(value) else str(float(value))


def _signal(signal: Signal) -> dict[str, Any]:
    return {**asdict(signal), "limit": _number(signal.limit)}


def _signal_of(content: dict[str, Any]) -> Signal:
    return Signal(**{**content, "limit": float(content["limit"])})


def _problem(problem: AllocationProblem) -> dict[str, Any]:
    arrays = {name: np.asarray(getattr(problem, name)) for name in _ARRAYS}
    written = {name: [list(array.shape), [_number(v) for v in array.ravel()]] for name, array in arrays.items()}
    return {**written, "accuracy_weight": problem.accuracy_weight}


def _problem_of(content: dict[str, Any]) -> AllocationProblem:
    arrays = {
        name: np.array([float(value) for value in content[name][1]]).reshape(content[name][0]) for name in _ARRAYS
    }
    if not arrays["coupling"].size:
        del arrays["coupling"], arrays["errors"]
    return AllocationProblem(**arrays, accuracy_weight=float(content["accuracy_weight"]))
