"""What commands about flights print."""

from __future__ import annotations

from typing import Any, Literal, NotRequired

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


@_TOLD
class Finding(TypedDict):
    """One check."""

    name: str
    scheme: str
    value: float | str
    limit: float | str
    sense: str
    """How the value must stand to the limit."""
    margin: float | str
    unit: str
    verdict: Literal["ok", "note", "warn", "fail"]
    consequence: str
    remedy: str
    source: str


class Findings(TypedDict):
    """All checks of a problem."""

    problem: str
    checks: list[Finding]


@_TOLD
class Channel(TypedDict):
    """Margins of a loop that is cut at one effort or measurement."""

    gain_low: float | None
    """Least factor on the loop for which it is stable."""
    gain_high: float | None
    """Largest such factor; null where there is none."""
    gain_at: float | None
    """rad/s."""
    phase: float | None
    """rad."""
    phase_at: float | None
    """rad/s; null where the loop's gain never is one."""
    delay: float | None
    """s; null where any delay is borne."""
    modulus: float | None
    """Least distance of the loop from -1."""
    disk: float | None
    """Disk margin, the symmetric one."""
    disk_at: float | None
    """rad/s."""


@_TOLD
class SchemeMargins(TypedDict):
    """Margins of one scheme."""

    scheme: str
    linearised_at_s: float
    channels: dict[str, Channel]
    effort_low: float
    """Least factor on all efforts alike for which the loop is stable."""
    effort_high: float | None
    disk_of_efforts: float
    """Radius of the disk in which each effort may have a factor of its own."""


@_TOLD
class Margins(TypedDict):
    """Margins of a mission."""

    problem: str
    schemes: list[SchemeMargins]
    notes: list[str]
    """Why a scheme has none."""


@_TOLD
class Claim(TypedDict):
    """A printed number beside ours."""

    id: str
    text: str
    where: str
    printed: float
    relation: Literal["equals", "at_most", "at_least"]
    unit: str
    ours: float | str | None
    bound: float | None
    deviation: float | None
    """Relative, or absolute where zero is printed."""
    assumption: str
    verdict: str
    failure: str


class Paper(TypedDict):
    """The claims of one paper."""

    name: str
    paper: str
    doi: str
    summary: str
    claims: list[Claim]


class Reproduction(TypedDict):
    """Claims of papers."""

    papers: list[Paper]


Sweeps = list[Sweep]
