"""What commands that list things, or only write files, print."""

from __future__ import annotations

from typing import Any

from pydantic import ConfigDict, with_config
from typing_extensions import TypedDict

_TOLD = with_config(ConfigDict(use_attribute_docstrings=True))


class Written(TypedDict):
    """Files that were written."""

    wrote: list[str]


class Problem(TypedDict):
    """A shipped problem."""

    name: str
    kind: str
    title: str


class Problems(TypedDict):
    """Shipped problems."""

    problems: list[Problem]


class Gain(TypedDict):
    """A gain of a law."""

    name: str
    symbol: str
    unit: str
    size: int
    range: str
    choices: list[Any]
    default: Any
    required: bool
    meaning: str


_Class = TypedDict("_Class", {"class": str})  # a key that is no name in Python


@_TOLD
class Law(_Class):
    """A law."""

    name: str
    about: str
    reads: list[str]
    commands: list[str] | None
    models: str | None
    """Kind of its belief."""
    funnels: dict[str, str]
    errata: dict[str, str]
    gains: list[Gain]
    fits: list[str]
    fits_as: dict[str, str]
    """By craft, the example in whose parts the law fits, where the first example has not all of them."""
    does_not_fit: dict[str, list[str]]
    """By craft, why."""
    unknown: list[str]
    """Crafts that no mission shows."""


class Laws(TypedDict):
    """Laws."""

    laws: list[Law]


class Column(TypedDict):
    """A signal."""

    name: str
    size: int
    unit: str
    frame: str


class Key(TypedDict):
    """A key of a craft's tables."""

    table: str
    name: str
    required: bool
    meaning: str


@_TOLD
class Craft(_Class):
    """A craft."""

    name: str
    about: str
    example: str
    measures: list[Column] | None
    """Null where only a mission says."""
    makes: list[Column] | None
    believes: str | None
    laws: list[str]
    keys: list[Key]


class Crafts(TypedDict):
    """Crafts."""

    crafts: list[Craft]


class Compiler(TypedDict):
    """A C compiler."""

    command: str
    version: str


class Cache(TypedDict):
    """Where compiled libraries are kept."""

    folder: str
    libraries: int


class Missing(TypedDict):
    """What is not there, and what that costs."""

    what: str
    cost: str


@_TOLD
class Doctor(TypedDict):
    """What is installed."""

    casadi_gnc: str
    python: str
    platform: str
    packages: dict[str, str]
    compilers: list[Compiler]
    solvers: list[str]
    targets: dict[str, list[str]]
    """By target, the programs that it lacks here."""
    cache: Cache
    missing: list[Missing]


@_TOLD
class Row(TypedDict):
    """One contestant on one family of problems; times in microseconds, null where there are none."""

    group: str
    family: str
    contestant: str
    samples: int
    passes: int
    success: float
    correct: float
    load_us: float | None
    setup_us: float | None
    first_us: float | None
    cold_us: float | None
    warm_us: float | None
    p95_us: float | None
    p99_us: float | None
    max_us: float | None
    solver_us: float | None
    wrapper_us: float | None
    mean_us: float | None
    violation: float | None
    gap: float | None
    missed: float | None
    """Median over samples of the measure that decides nothing; null where the contest has none."""
    missed_max: float | None
    iterations: float | None
    memory_MB: float | None
    failures: int


@_TOLD
class Ranked(TypedDict):
    """A contestant in its place, fast ones first."""

    contestant: str
    ratio_to_last: list[float] | None
    """Time over that of the one before: median, bounds of 95 %; null for the first, or without common samples."""


class Corrupt(TypedDict):
    """A line of the stored results that cannot be read."""

    line: int
    what: str


@_TOLD
class Benchmark(TypedDict):
    """Summary of a run."""

    header: dict[str, Any]
    """Machine, settings, versions, families, what the contest measures."""
    rows: list[Row]
    ranking: dict[str, list[Ranked]]
    alike: dict[str, list[list[str]]]
    """Contestants that do not differ beyond doubt."""
    left_out: int
    """First passes that are missing; the same command goes on."""
    corrupt_lines: list[Corrupt]


class TimeRatio(TypedDict):
    """Time over time: its value, and the bounds of 95 %."""

    value: float
    low: float
    high: float


@_TOLD
class Change(TypedDict):
    """How the times of one set changed from one run to another."""

    group: str
    families: list[str]
    ratios: dict[str, TimeRatio]
    """Time in the second run over that in the first, by contestant."""
    notable: int
    """Pairs of contestants that differ in the first run."""
    swapped: list[Any]
    """Those of them that come in the other order in the second."""


Changes = list[Change]
