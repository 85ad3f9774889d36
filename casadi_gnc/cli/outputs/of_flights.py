"""What commands about flights print."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import ConfigDict, with_config
from typing_extensions import TypedDict

_TOLD = with_config(ConfigDict(use_attribute_docstrings=True))


class Value(TypedDict):
    """A metric of a flight."""

    value: float | None
    """Null where it has none; a note says why."""
    unit: str


@_TOLD
class Status(TypedDict):
    """A status bit that was raised."""

    status: str
    samples: int
    first_s: float
    """When it was raised first."""
    meaning: str


@_TOLD
class Verdict(TypedDict):
    """A requirement on one flight."""

    id: str
    text: str
    asked: str
    robustness: float | str
    """By how much it is met, negative where it is not, in the unit; "inf" or "-inf" where nothing bounds it."""
    unit: str
    verdict: Literal["met", "not met"]


@_TOLD
class Made(TypedDict):
    """By what a flight was flown."""

    engine: str
    maths: str
    mode: str
    feedback: str
    """What observers are told: "achieved" or "wanted" effort."""
    seed: int | None
    problem_sha256: str | None
    casadi_gnc: str
    casadi: str
    compiler: str | None


@_TOLD
class Scheme(TypedDict):
    """The flight of one scheme."""

    scheme: str
    title: str
    metrics: dict[str, Value]
    statuses: list[Status]
    requirements: list[Verdict]
    notes: list[str]
    made: Made
    seconds: float
    """That the engine took."""


class Flights(TypedDict):
    """Flights of a mission, one a scheme."""

    mission: str
    schemes: list[Scheme]


@_TOLD
class Swept(Scheme):
    """The flight of one scheme with one value of a sweep."""

    shown: float | None
    """The metric that the sweep shows."""


class Step(TypedDict):
    """One value of a sweep."""

    value: Any
    schemes: list[Swept]


class Sweep(TypedDict):
    """Flights over the values of one key."""

    sweep: str
    key: str
    show: str
    values: list[Step]


Sweeps = list[Sweep]
