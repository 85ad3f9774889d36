"""A formula in its normal form: least and largest of margins over samples, and nothing else."""

from __future__ import annotations

from dataclasses import dataclass

#: Stands for infinity, in single precision too.
BEYOND = 1e30


@dataclass(frozen=True)
class Node:
    """Base: a margin at every sample."""


@dataclass(frozen=True)
class Margin(Node):
    """A comparison, by its number."""

    number: int


@dataclass(frozen=True)
class Join(Node):
    """The least of several (every), or the largest."""

    every: bool
    parts: tuple[Node, ...]


@dataclass(frozen=True)
class Window(Node):
    """The least (every), or the largest, from `first` to `last` samples later; None is the end of the flight.

    Beyond the end there is nothing: an empty window is met where all of it must be, and not where some of it must.
    """

    every: bool
    first: int
    last: int | None
    part: Node


@dataclass(frozen=True)
class Held(Node):
    """The least (every) over this sample and `samples` before it, -`BEYOND` while there are fewer; or its contrary."""

    every: bool
    samples: int
    part: Node


@dataclass(frozen=True)
class Until(Node):
    """The largest, from `first` to `last` samples later, of the least of `goal` there and `keep` before.

    every: its contrary, largest and least exchanged.
    """

    every: bool
    first: int
    last: int | None
    keep: Node
    goal: Node
