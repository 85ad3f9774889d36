"""What a package says of itself to other programs: each number that goes in, comes out, is kept or can be changed.

The same data become `dictionary.json`, the packets of `casadi_gnc.embedded.packets` and the frames of
`casadi_gnc.embedded.frames`.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

from casadi_gnc.embedded.members import access, elements
from casadi_gnc.signals import Layout

#: Name of the file in a package.
DICTIONARY = "dictionary.json"
_FORMAT = 1
Type = Literal["real", "int32", "uint32"]


@dataclass(frozen=True)
class Entry:
    """Describe a member of a struct of the package.

    Parameters
    ----------
    name : of the signal.
    place : of the member in its struct, as C says it: `memory.rate`.
    size : how many numbers.
    type : of each; "real" is the package's own.
    unit, note : for people; "" where nothing is said.
    default, minimum, above : of parameters: values, closed or open lower bound.
    """

    name: str
    place: str
    size: int
    type: Type = "real"
    unit: str = ""
    note: str = ""
    default: tuple[float, ...] = ()
    minimum: float | None = None
    above: float | None = None

    @property
    def elements(self) -> list[str]:
        """The C expression of each number in its struct."""
        return [self.place] if self.size == 1 else elements(self.place, self.size)

    def array(self, owner: str) -> str:
        """Return C for the member as an array, whatever its size; `owner` is "input.", say."""
        return f"(&{owner}{self.place})" if self.size == 1 else f"{owner}{self.place}"


@dataclass(frozen=True)
class Dictionary:
    """Describe a package.

    Parameters
    ----------
    name, title, scheme : of the package.
    real : "float64" or "float32".
    period_s : between two steps, 0 where nobody said.
    calls : C that readies the objects `state` and `params` ("init", "reset") and that steps them ("step"); `objects`
        says which of the two there are.
    inputs, outputs, state, parameters : members of the structs; the status is the last output.
    status : bits of the status.
    """

    name: str
    title: str
    scheme: str
    real: str
    period_s: float
    calls: Mapping[str, str]
    objects: tuple[str, ...]
    inputs: tuple[Entry, ...]
    outputs: tuple[Entry, ...]
    state: tuple[Entry, ...]
    parameters: tuple[Entry, ...] = ()
    status: Sequence[Mapping[str, Any]] = field(default_factory=tuple)

    @property
    def groups(self) -> dict[str, tuple[Entry, ...]]:
        """The members by the struct that they are in; empty ones left out."""
        found = {"input": self.inputs, "output": self.outputs, "state": self.state, "params": self.parameters}
        return {name: entries for name, entries in found.items() if entries}

    def text(self) -> str:
        """Return `dictionary.json`."""
        said = {key: _plain(value) for key, value in vars(self).items()}
        return json.dumps({"format": _FORMAT, **said}, indent=1) + "\n"


def _plain(value: Any) -> Any:
    """Return entries as tables without what nobody said."""
    if isinstance(value, tuple) and value and isinstance(value[0], Entry):
        return [{k: v for k, v in asdict(one).items() if v not in ("", (), None)} for one in value]
    return value


def entries(layout: Layout, owner: str = "", note: str = "") -> Iterator[Entry]:
    """Yield the members of a struct that hold the signals of a layout."""
    for signal in layout.signals:
        place = access(Layout((signal,)), owner)[0].removesuffix("[0]" if signal.size > 1 else "")
        frame = f"{signal.frame} frame" if signal.frame else ""
        yield Entry(signal.name, place, signal.size, "real", signal.unit, ", ".join(filter(None, (frame, note))))


#: What every output ends with.
STATUS = Entry("status", "status", 1, "uint32", "", "bits, 0: nothing unusual happened")


def bits(statuses: Mapping[int, tuple[str, str]]) -> tuple[dict[str, Any], ...]:
    """Return the bits of a status as tables."""
    return tuple({"value": bit, "name": name, "meaning": meaning} for bit, (name, meaning) in statuses.items())


def calls(name: str, reset: str = "") -> dict[str, str]:
    """Return the calls of a package that has parameters; `reset` is what its reset takes beside the state."""
    return {
        "init": f"{name}_init(&params)",
        "reset": f"{name}_reset(&state{reset})",
        "step": f"{name}_step(&state, &params, &input, &output)",
    }
