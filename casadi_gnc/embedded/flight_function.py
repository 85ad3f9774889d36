"""What a package of a CasADi function is made of: the function, its ports with names and units, what it remembers."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from importlib import metadata
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.embedded.faults import Faults
from casadi_gnc.embedded.names import check_name
from casadi_gnc.errors import PackageError
from casadi_gnc.signals import Layout, Signal

_FORMAT = 1
#: What the status of a step can say.
STATUSES = {
    1: ("INPUT_REFUSED", "an input is not finite: outputs and state are those of the last good step"),
    2: ("RESULT_REFUSED", "a result is not finite: outputs and state are those of the last good step"),
    4: ("SINGULAR", "a linear system has no solution: outputs and state are those of the last good step"),
    8: ("NOT_INITIALISED", "the state was not initialised, or is damaged: outputs are zero"),
    16: ("STATE_DAMAGED", "the state was changed between two steps, as its checksum shows: outputs are zero"),
    64: (
        "UNCERTIFIED",
        "a quadratic program has no certified answer: all is as after the last good step",
    ),
}
#: The bit beside them of functions with a period and a time.
_TIME_SHIFTED = ("TIME_SHIFTED", "the time did not advance by the period; the step was taken all the same")
#: Bits of refused steps, which hold outputs and state; bits of steps of an initialised state.
HELD, TAKEN = 1 | 2 | 4 | 64, 1 | 2 | 4 | 32 | 64
#: What the bits of fault handling mean here.
_HANDLED = {
    "MEASUREMENT_STALE": "the outputs were held for longer than their age limit",
    "SAFE_MODE": "the outputs are the safe ones",
}
#: What may be said of a port.
_SAID = ("unit", "note", "initial")


@dataclass(frozen=True, eq=False)
class FlightFunction:
    """Hold a function that is stepped on board.

    Parameters
    ----------
    title : what it is, for people.
    function : its ports are dense; matrices are columns one after the other.
    pairs : input that is remembered -> output that is its next value.
    initial : first value of what is remembered, element by element.
    period : seconds between two steps, or 0 where nobody said.
    units, notes : port -> its unit, what it is.
    faults : what is done with faults beside telling them.

    Raises
    ------
    PackageError
        For names that C does not take or that clash, pairs that do not fit, and functions without an input.
    """

    title: str
    function: ca.Function
    pairs: dict[str, str]
    initial: tuple[float, ...]
    period: float
    units: dict[str, str]
    notes: dict[str, str]
    faults: Faults | None = None

    def __post_init__(self) -> None:
        for name in (*self.inputs.names, *self.state.names, *self.outputs.names):
            check_name(name, "port")
        if "status" in self.outputs:
            raise PackageError("an output is called 'status', which every package has; rename it")
        if not self.inputs.size:
            raise PackageError(
                f"{self.function.name()} has no input beside its state, expected at least one number: what it is "
                "stepped with"
            )

    @property
    def inputs(self) -> Layout:
        """What a step is given."""
        names = [name for name in self.function.name_in() if name not in self.pairs]
        return self._layout(names, self.function.numel_in)

    @property
    def state(self) -> Layout:
        """What is remembered from step to step."""
        return self._layout(list(self.pairs), self.function.numel_in)

    @property
    def outputs(self) -> Layout:
        """What a step gives."""
        names = [name for name in self.function.name_out() if name not in self.pairs.values()]
        return self._layout(names, self.function.numel_out)

    @property
    def is_clocked(self) -> bool:
        """Whether there are a period and an input that is the time [s], called so."""
        return self.period > 0.0 and "time" in self.inputs and self.inputs.signal("time").size == 1

    @property
    def statuses(self) -> dict[int, tuple[str, str]]:
        """What the status of a step can say, by bit."""
        found = {**STATUSES, 32: _TIME_SHIFTED} if self.is_clocked else dict(STATUSES)
        for bit, (name, sentence) in (self.faults.statuses if self.faults is not None else {}).items():
            found[bit] = name, _HANDLED.get(name, sentence)
        return dict(sorted(found.items()))

    @property
    def replayed(self) -> Layout:
        """What a replay compares besides the status: the outputs, and the state after the step."""
        state = tuple(Signal(f"state_{one.name}", one.size, one.unit) for one in self.state.signals)
        return self.outputs + Layout(state)

    def _layout(self, names: list[str], size: Any) -> Layout:
        try:
            return Layout(tuple(Signal(name, size(name), self.units.get(name, "")) for name in names if size(name)))
        except ValueError as error:
            raise PackageError(f"{self.function.name()}: {error}; rename a port") from None

    def shape(self, name: str) -> str:
        """Return the shape of a port as text, "" for scalars and columns."""
        side = self.function.size_in if name in self.function.name_in() else self.function.size_out
        rows, columns = side(name)
        return "" if columns == 1 else f"{rows} x {columns}, column by column"


def flight_function(
    function: ca.Function,
    *,
    state: Mapping[str, str] | None = None,
    ports: Mapping[str, Any] | None = None,
    rate: float | None = None,
    title: str = "",
) -> FlightFunction:
    """Return a function with what was said of it.

    Parameters
    ----------
    function : SX or MX; sparse ports become dense.
    state : input -> output that is its next value.
    ports : port -> table of "unit", "note", and of a state's "initial" value (a number, or one an element).
    rate : steps a second.

    Raises
    ------
    PackageError
        For anything that does not fit, in one sentence.
    """
    if function.n_in() + function.n_out() == 0 or function.n_out() == 0:
        raise PackageError(f"{function.name()} has no result, expected at least one")
    pairs = _pairs(function, dict(state or {}))
    said = _said(function, ports or {}, pairs)
    if rate is not None and not (math.isfinite(rate) and 0.0 < rate <= 1e9):
        raise PackageError(f"the rate is {rate:g} steps a second, expected more than 0 and at most 1e9")
    initial = [value for name in pairs for value in _initial(function, name, said[name].get("initial"))]
    return FlightFunction(
        title=title or f"The function {function.name()}",
        function=_dense(function),
        pairs=pairs,
        initial=tuple(initial),
        period=1.0 / rate if rate else 0.0,
        units={name: one["unit"] for name, one in said.items() if "unit" in one},
        notes={name: one["note"] for name, one in said.items() if "note" in one},
    )


def _pairs(function: ca.Function, pairs: dict[str, str]) -> dict[str, str]:
    inputs, outputs = function.name_in(), function.name_out()
    for name, after in pairs.items():
        for port, known, what in ((name, inputs, "input"), (after, outputs, "output")):
            if port not in known:
                raise PackageError(
                    f"the state pair {name}:{after} names the {what} {port!r}; {function.name()} has "
                    f"{', '.join(known) or 'none'}"
                )
        if function.size_in(name) != function.size_out(after):
            raise PackageError(
                f"the state pair {name}:{after} has shapes {_shape(function.size_in(name))} and "
                f"{_shape(function.size_out(after))}, expected one shape"
            )
    if twice := [after for after in pairs.values() if list(pairs.values()).count(after) > 1]:
        raise PackageError(f"the output {twice[0]!r} is the next value of two states; expected one")
    return {name: pairs[name] for name in inputs if name in pairs}


def _shape(size: tuple[int, int]) -> str:
    return f"{size[0]} x {size[1]}"


def _said(function: ca.Function, ports: Mapping[str, Any], pairs: dict[str, str]) -> dict[str, dict[str, Any]]:
    known = [*function.name_in(), *function.name_out()]
    for name, table in ports.items():
        if name not in known:
            raise PackageError(f"something is said of the port {name!r}; {function.name()} has {', '.join(known)}")
        if not isinstance(table, Mapping):
            raise PackageError(f"the port {name} is told as {table!r}, expected a table of {', '.join(_SAID)}")
        for key, value in table.items():
            if key not in _SAID:
                raise PackageError(f"the port {name} has {key!r}, expected {', '.join(_SAID)}")
            if key != "initial" and not isinstance(value, str):
                raise PackageError(f"the {key} of port {name} is {value!r}, expected a text")
            if key == "initial" and name not in pairs:
                raise PackageError(f"the port {name} has an initial value and is no state; name it as one")
    return {name: dict(ports.get(name, {})) for name in known}


def _initial(function: ca.Function, name: str, given: Any) -> list[float]:
    count = function.numel_in(name)
    if given is None:
        given = float(function.default_in(function.index_in(name)))
    try:
        values = np.array(given, dtype=float).ravel(order="F")
    except (TypeError, ValueError):
        raise PackageError(f"the initial value of {name} is {given!r}, expected {count} numbers") from None
    values = np.full(count, values[0]) if values.size == 1 else values
    if values.size != count or not np.isfinite(values).all():
        raise PackageError(f"the initial value of {name} is {str(given)[:80]}, expected {count} finite numbers")
    return [float(value) for value in values]


def _dense(function: ca.Function) -> ca.Function:
    """Return a function with dense ports."""
    inputs = [function.sparsity_in(i) for i in range(function.n_in())]
    outputs = [function.sparsity_out(i) for i in range(function.n_out())]
    if all(each.is_dense() for each in (*inputs, *outputs)):
        return function
    kind: Any = ca.SX if function.is_a("SXFunction") else ca.MX
    given: list[Any] = [kind.sym(name, *each.shape) for name, each in zip(function.name_in(), inputs, strict=True)]
    taken = [ca.project(one, each) for one, each in zip(given, inputs, strict=True)]
    results = [ca.densify(one) for one in function.call(taken, True, False)]
    return ca.Function(function.name(), given, results, function.name_in(), function.name_out())


def to_text(own: FlightFunction) -> str:
    """Return a function with what was said of it as JSON; the function is CasADi's own serialisation."""
    content = {name: getattr(own, name) for name in ("title", "pairs", "initial", "period", "units", "notes")}
    if own.faults is not None:
        content["faults"] = asdict(own.faults)
    about = {"format": _FORMAT, "casadi": metadata.version("casadi")}
    return json.dumps({**about, **content, "function": own.function.serialize()}, indent=1) + "\n"


def from_text(text: str) -> FlightFunction:
    """Return the function of a JSON text; raise `PackageError` where it is none of this version."""
    try:
        content = json.loads(text)
        if content.pop("format") != _FORMAT:
            raise PackageError(f"a function of another format than {_FORMAT}, which this version reads")
        content.pop("casadi")
        initial = tuple(float(value) for value in content.pop("initial"))
        function = ca.Function.deserialize(content.pop("function"))
        faults = Faults.from_data(content.pop("faults")) if "faults" in content else None
        return FlightFunction(**content, initial=initial, function=function, faults=faults)
    except (ValueError, KeyError, TypeError, RuntimeError, AttributeError, MemoryError) as error:
        raise PackageError(f"the function cannot be read: {type(error).__name__}: {str(error)[:200]}") from error
