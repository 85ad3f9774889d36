"""What a formula says, as a tree: values of a sample, conditions on them, and when they must hold.

Every part has its place in the text, counted from 0, so that whoever finds it wrong later can point there.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields

#: Functions of one vector (or, but for norm, of several numbers) and those of each element.
FUNCTIONS = ("norm", "abs", "max", "min", "dot", "sqrt")
#: A condition at one instant of the flight, or over an interval that begins there.
TEMPORAL = ("always", "eventually", "held")
WORDS = ("and", "or", "not", "implies", "until", "raised", "end", *FUNCTIONS, *TEMPORAL)


@dataclass(frozen=True)
class Part:
    """Base of all parts: where it begins in the text."""

    place: int

    def parts(self) -> Iterator[Part]:
        """Yield the parts right below this one."""
        for field in fields(self):
            value = getattr(self, field.name)
            yield from (each for each in (value if isinstance(value, tuple) else (value,)) if isinstance(each, Part))

    def walk(self) -> Iterator[Part]:
        """Yield this part and all below it."""
        yield self
        for part in self.parts():
            yield from part.walk()


@dataclass(frozen=True)
class Value(Part):
    """A number or a vector at each sample."""


@dataclass(frozen=True)
class Number(Value):
    """A constant."""

    number: float


@dataclass(frozen=True)
class Named(Value):
    """A recorded signal, or one of its elements, counted from 1."""

    name: str
    element: int | None = None


@dataclass(frozen=True)
class Vector(Value):
    """Numbers in brackets, [0, 0, 1]."""

    elements: tuple[Value, ...]


@dataclass(frozen=True)
class Call(Value):
    """One of `FUNCTIONS`."""

    function: str
    arguments: tuple[Value, ...]


@dataclass(frozen=True)
class Arithmetic(Value):
    """Two values joined by +, -, * or /; a sign is 0 - value."""

    operator: str
    left: Value
    right: Value


@dataclass(frozen=True)
class Condition(Part):
    """True or false at each sample."""


@dataclass(frozen=True)
class Comparison(Condition):
    """Two numbers compared by <, <=, >, >=, == or !=."""

    operator: str
    left: Value
    right: Value


@dataclass(frozen=True)
class Raised(Condition):
    """A bit of the status word."""

    name: str


@dataclass(frozen=True)
class Not(Condition):
    """The contrary."""

    part: Condition


@dataclass(frozen=True)
class Junction(Condition):
    """All of several conditions (every), or one of them at least."""

    every: bool
    conditions: tuple[Condition, ...]


@dataclass(frozen=True)
class Interval:
    """From `first` to `last` seconds after an instant, both included; None is the end of the flight."""

    first: float = 0.0
    last: float | None = None


@dataclass(frozen=True)
class Temporal(Condition):
    """A condition over an interval: `always` after the instant, `eventually` after it, `held` before it."""

    word: str
    interval: Interval
    part: Condition


@dataclass(frozen=True)
class Until(Condition):
    """`goal` holds somewhere in the interval, and `keep` at every sample before."""

    interval: Interval
    keep: Condition
    goal: Condition
