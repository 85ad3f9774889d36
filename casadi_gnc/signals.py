"""Named vectors: which signal sits where in a column, with its shape, unit and range.

Plants, laws and records speak of signals by name; engines and generated C see plain columns.
A `Layout` is the bridge between the two, for CasADi expressions and numpy arrays alike.
"""

from __future__ import annotations

import keyword
import math
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, Literal

import casadi as ca
import numpy as np

from casadi_gnc.errors import offer

Kind = Literal["", "mrp", "rate", "wheel_speed"]


@dataclass(frozen=True)
class Signal:
    """Describe one named signal.

    Parameters
    ----------
    name : a Python and C identifier.
    size : number of elements.
    unit : SI unit, ``""`` for dimensionless.
    frame : frame in which a vector is resolved, ``""`` for scalars and lists.
    limit : largest magnitude of an element that can be true; beyond it a measurement is rejected.
    kind : what it physically is, for whoever must know and cannot read names: "mrp", "rate" (of the body),
        "wheel_speed"; "" where nobody needs to.
    """

    name: str
    size: int = 1
    unit: str = ""
    frame: str = ""
    limit: float = math.inf
    kind: Kind = ""

    def __post_init__(self) -> None:
        if not self.name.isidentifier() or keyword.iskeyword(self.name):
            raise ValueError(f"signal name {self.name!r} is not an identifier")


@dataclass(frozen=True)
class Layout:
    """Order signals in one column vector.

    Examples
    --------
    >>> state = Layout((Signal("mrp", 3), Signal("rate", 3, "rad/s")))
    >>> state.size, state.place("rate")
    (6, slice(3, 6, None))
    """

    signals: tuple[Signal, ...] = ()

    def __post_init__(self) -> None:
        names = self.names
        if len(set(names)) != len(names):
            raise ValueError(f"signal names repeat: {', '.join(names)}")

    @property
    def names(self) -> tuple[str, ...]:
        """Names in order."""
        return tuple(signal.name for signal in self.signals)

    @property
    def size(self) -> int:
        """Length of the column."""
        return sum(signal.size for signal in self.signals)

    def __add__(self, other: Layout) -> Layout:
        return Layout(self.signals + other.signals)

    def __contains__(self, name: str) -> bool:
        return name in self.names

    def signal(self, name: str) -> Signal:
        """Return the description of the signal of a name; raise `KeyError` naming what there is."""
        for signal in self.signals:
            if signal.name == name:
                return signal
        raise KeyError(f"no signal {name!r}; {offer(name, self.names)}")

    def of_kind(self, kind: Kind) -> tuple[Signal, ...]:
        """Return the signals of a kind."""
        return tuple(signal for signal in self.signals if signal.kind == kind)

    def place(self, name: str) -> slice:
        """Return the rows that the signal of a name occupies."""
        start = 0
        for signal in self.signals:
            if signal.name == name:
                return slice(start, start + signal.size)
            start += signal.size
        raise KeyError(f"no signal {name!r}; {offer(name, self.names)}")

    def split(self, column: Any) -> SimpleNamespace:
        """Return the signals of a column as attributes; works on SX, MX, DM and numpy columns.

        Raises `ValueError` for a column of another length.
        """
        if column.shape[0] != self.size:
            raise ValueError(f"a column of {column.shape[0]} rows, expected {self.size} ({', '.join(self.names)})")
        return SimpleNamespace(**{name: column[self.place(name)] for name in self.names})

    def pack(self, **parts: Any) -> Any:
        """Stack the named parts into a column; each must be there, with its size."""
        if set(parts) != set(self.names):
            raise KeyError(f"expected {', '.join(self.names)}; got {', '.join(parts)}")
        for signal in self.signals:
            rows = ca.vec(parts[signal.name]).numel() if _symbolic(parts[signal.name]) else np.size(parts[signal.name])
            if rows != signal.size:
                raise ValueError(f"{signal.name} has {rows} elements, expected {signal.size}")
        if not self.signals:
            return ca.SX(0, 1)
        return ca.vertcat(*(parts[name] for name in self.names))

    def symbol(self, name: str) -> ca.SX:
        """Return a fresh symbolic column, whose symbols have this name."""
        return ca.SX.sym(name, self.size) if self.size else ca.SX(0, 1)

    def columns(self, samples: np.ndarray) -> dict[str, np.ndarray]:
        """Split rows of samples (K, size) into arrays (K, n), or (K,) where a signal is scalar."""
        parts = {}
        for signal in self.signals:
            block = samples[:, self.place(signal.name)]
            parts[signal.name] = block[:, 0] if signal.size == 1 else block
        return parts

    def limits(self) -> list[float]:
        """Return the largest credible magnitude of each element."""
        return [signal.limit for signal in self.signals for _ in range(signal.size)]


def _symbolic(value: Any) -> bool:
    return isinstance(value, (ca.SX, ca.MX, ca.DM))
