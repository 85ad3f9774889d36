"""What `campaign` prints."""

from __future__ import annotations

from typing import Literal, NotRequired

from pydantic import ConfigDict, with_config
from typing_extensions import TypedDict

_TOLD = with_config(ConfigDict(use_attribute_docstrings=True))


class Bounded(TypedDict):
    """An estimate with its bounds of the stated confidence; null beyond what the flights can say."""

    value: float | None
    low: float | None
    high: float | None


class Driver(TypedDict):
    """How much a dispersed value has to do with a metric."""

    key: str
    rank_correlation: Bounded
    first_order: Bounded | None


class Index(TypedDict):
    """Sensitivity indices of one dispersed value, of a plan pick_freeze."""

    key: str
    first_order: Bounded
    total: Bounded


class Case(TypedDict):
    """A case, by the number that flies it again."""

    case: int
    value: float | None


class Far(TypedDict):
    """The case that is farthest from a requirement."""

    case: int
    margin: float | None


@_TOLD
class Metric(TypedDict):
    """A metric over all flights."""

    unit: str
    kind: str
    without: int
    """Flights that have no value."""
    percentiles: dict[str, Bounded]
    """By percent; empty where the cases were chosen rather than drawn."""
    worst: list[Case]
    tolerance_limit: NotRequired[float | None]
    """That 99.73 % of all flights keep, with the stated confidence."""
    drivers: NotRequired[list[Driver]]
    range: NotRequired[list[float] | None]
    """Least and largest value, where the cases were chosen."""
    sensitivity: NotRequired[list[Index] | None]


@_TOLD
class Demand(TypedDict):
    """A requirement on the share of flights that meet it."""

    asked: str
    text: str
    share: float
    confidence: float
    met_by: int
    of: int
    worst: Far
    shown: Bounded
    """Share of all flights that meet it."""
    verdict: Literal["met", "not met", "undecided"]
    more_if_all_pass: NotRequired[int | None]
    """Further flights that decide it if all of them meet it; null where none do."""
    more_at_this_rate: NotRequired[int | None]


class Raised(TypedDict):
    """Flights that raised a status bit."""

    sentence: str
    flights: int
    share: Bounded


@_TOLD
class Campaign(TypedDict):
    """What many flights say."""

    mission: str
    scheme: str
    cases: int
    asked: int
    refused: int
    why: dict[str, int]
    """Reasons of the refused cases, and how many have each."""
    damaged: list[str]
    """Files that could not be read and whose cases are flown again by the same command."""
    confidence: float
    weighted: bool
    representative: bool
    """Whether the cases were drawn from the dispersions; else shares and percentiles say nothing and are left out."""
    effective_flights: float
    metrics: dict[str, Metric]
    requirements: dict[str, Demand]
    statuses: dict[str, Raised]
