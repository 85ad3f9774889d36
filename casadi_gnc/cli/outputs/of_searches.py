"""What commands that search with gradients print."""

from __future__ import annotations

from typing import Any, NotRequired

from pydantic import ConfigDict, with_config
from typing_extensions import TypedDict

_TOLD = with_config(ConfigDict(use_attribute_docstrings=True))


class Asked(TypedDict):
    """A requirement."""

    id: str
    text: str
    asked: str
    unit: str


class Within(TypedDict):
    """The set in which was searched."""

    kind: str
    radius: float


@_TOLD
class Moved(TypedDict):
    """A value that is not the file's."""

    key: str
    value: Any
    nominal: Any
    deviations: NotRequired[float | None]
    """By how many standard deviations; null for what has none."""


@_TOLD
class Break(TypedDict):
    """A case that breaks the requirement."""

    robustness: float | str
    """The text "inf" or "-inf" where it is not finite."""
    distance: float
    """From the nominal, in standard deviations."""
    moved: list[Moved]
    file: str | None


class Least(TypedDict):
    """The flight with the least robustness."""

    robustness: float | str
    distance: float
    moved: list[Moved]


@_TOLD
class Effort(TypedDict):
    """How hard was tried."""

    flights: int
    """A slope by derivatives, a flight there and back, counts as four."""
    flights_at_first_break: int | None
    plan: int
    descents: int
    slopes_by_derivatives: int
    slopes_by_differences: int
    sampled_without_slope: int


class Step(TypedDict):
    """A place on the search's path."""

    did: str
    flights: int
    robustness: float | str
    distance: float


@_TOLD
class Place(TypedDict):
    """A flight on the straight way to a break."""

    distance: float
    robustness: float | str


@_TOLD
class Certificate(TypedDict):
    """What is proved for every dispersion in a box that contains the set."""

    requirement_holds: bool
    stable: bool
    least_robustness: float | None
    """That is left at least, below 0 for nothing proved; null where nothing bounds it."""
    stable_up_to_times_the_box: float | None
    model: str | None
    """Of what it is proved; null where nothing is."""
    model_is_the_loop_of_the_flight: bool
    """But for limits of actuators and noise."""
    sentence: str


@_TOLD
class Falsification(TypedDict):
    """The smallest break found, or the margin that is left."""

    mission: str
    scheme: str
    requirement: Asked
    verdict: str
    sentence: str
    nominal_robustness: float | str
    set: Within
    broken: Break | None
    minimal: Break | None
    """The break with what does not matter as in the file."""
    certificate: Certificate | None
    """What is proved of the linear loop; null where a break was found."""
    least: Least
    effort: Effort
    path: list[Step]
    way: list[Place]
    """Eighths of the straight way from the file's own numbers to the smallest break; empty without."""
    notes: list[str]


@_TOLD
class Gain(TypedDict):
    """A gain that was free."""

    name: str
    key: str
    """Where it stands in the problem file."""
    unit: str
    before: float
    after: float
    low: float | None
    """Its bounds; null: none."""
    high: float | None


class Number(TypedDict):
    """A number at nominal and in the worst case; null where there is none."""

    name: str
    unit: str
    before: float | None
    after: float | None
    worst_before: float | None
    worst_after: float | None


@_TOLD
class Tuning(TypedDict):
    """Gains before and after."""

    problem: str
    scheme: str
    against: str
    cost: str
    cost_before: float | None
    cost_after: float | None
    gains: list[Gain]
    terms: list[Number]
    """Of the cost."""
    metrics: list[Number]
    requirements: list[Number]
    """Robustness of each."""
    worse: list[str]
    """Requirements that moved the wrong way, at nominal or in the worst case."""
    course: list[list[float | str | None]]
    """The cost of each iterate, and how it was found."""
    flights: int
    checks_before: dict[str, str]
    checks_after: dict[str, str]
    disagreement: float | None
    """Share by which the cost differs where the file is flown again by other code."""
    file: str | None
