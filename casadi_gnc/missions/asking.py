"""Ask a law or a plant for an expression, and tell its author what is wrong with the answer.

Whoever writes a law is told in one sentence, with the class and the method: a call that fails, a list in the
place of a column, a column of another size, NaN that was meant for "unknown".
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc import guests
from casadi_gnc.errors import GncError, LawError
from casadi_gnc.mathematics.arrays import real_array
from casadi_gnc.signals import Layout

#: What Python decides at once is not known of a symbol.
_ON_SYMBOLS = (
    "Python's if, and, or, min, max cannot decide on symbols; take casadi.if_else or casadi_gnc.mathematics.bounds"
)


def ask(owner: Any, method: str, *arguments: Any) -> Any:
    """Return what a method of a law, a plant or a craft returns; its failure is one sentence with its own lines."""
    function: Callable[..., Any] = getattr(owner, method)
    try:
        return function(*arguments)
    except GncError:
        raise
    except Exception as error:  # whatever an author's code does
        raise LawError(f"{type(owner).__name__}.{method} failed: {_told(error)}") from error


def _told(error: Exception) -> str:
    """Return an exception as a sentence with its author's lines; of CasADi's many lines, the one that says it."""
    text = str(error).strip()
    if "truth value" in text:
        return _ON_SYMBOLS + guests.own_lines(error)
    if isinstance(error, OverflowError):
        return "a number overflows in it, one of its data is too large" + guests.own_lines(error)
    if not isinstance(error, (RuntimeError, NotImplementedError)) or "\n" not in text:
        return guests.told(error)
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return next((line for line in lines if "Wrong number or type" in line), lines[-1]) + guests.own_lines(error)


def column(owner: Any, method: str, value: Any, expected: Layout | int, what: str = "") -> Any:
    """Return a method's answer as it came, if it is a column of the expected size.

    Raises
    ------
    LawError
        Naming class, method, what came and what was expected.
    """
    size = expected if isinstance(expected, int) else expected.size
    told = what or (", ".join(f"{s.name} ({s.size})" for s in expected.signals) if isinstance(expected, Layout) else "")
    wanted = f"expected a column of {size} numbers" + (f": {told}" if told else "")
    name = f"{type(owner).__name__}.{method}"
    if isinstance(value, (list, tuple, dict)) or value is None:
        raise LawError(f"{name} returned {_kind(value)}, {wanted}; stack parts by casadi.vertcat(...)")
    if isinstance(value, ca.MX):
        raise LawError(f"{name} returned an MX expression, {wanted} of SX; functions of MX have to be expanded")
    if not isinstance(value, (ca.SX, ca.DM, np.ndarray, int, float, np.number)):
        raise LawError(f"{name} returned {_kind(value)}, {wanted}")
    found = (
        ca.SX(value)
        if isinstance(value, (ca.SX, ca.DM))
        else ca.SX(ca.DM(real_array(f"{name} returned an array that", value, LawError)))
    )
    shape = found.shape
    if size and (found.numel() != size or (shape[1] != 1 and size > 1)):
        raise LawError(f"{name} returned {shape[0]} x {shape[1]} numbers, {wanted}")
    return value


def flags(owner: Any, method: str, value: Any) -> Any:
    """Return the flags by status bit that a method gave, if they are that."""
    from casadi_gnc.status import StepStatus

    if not isinstance(value, Mapping) or not all(isinstance(key, StepStatus) for key in value):
        raise LawError(
            f"{type(owner).__name__}.{method} returned {_kind(value)}; expected flags by status bit, "
            "{StepStatus.FUNNEL_LEFT: expression}"
        )
    return value


def shown(owner: Any, value: Any, expected: Layout) -> Any:
    """Return the signals by name that `show` gave, if they are those that are declared."""
    if not isinstance(value, Mapping) or set(value) != set(expected.names):
        given = ", ".join(map(str, value)) if isinstance(value, Mapping) else _kind(value)
        raise LawError(
            f"{type(owner).__name__}.show returned {given or 'nothing'}; expected the signals of `outputs` by name: "
            f"{', '.join(expected.names) or 'none'}"
        )
    for signal in expected.signals:
        column(owner, "show", value[signal.name], signal.size, signal.name)
    return value


def _kind(value: Any) -> str:
    if value is None:
        return "nothing"
    return f"a {type(value).__name__}" + (f" of {len(value)}" if hasattr(value, "__len__") else "")
