"""What commands about allocation and synthesis print."""

from __future__ import annotations

from typing import NotRequired

from pydantic import ConfigDict, with_config
from typing_extensions import TypedDict

_TOLD = with_config(ConfigDict(use_attribute_docstrings=True))


class Latency(TypedDict, total=False):
    """How long answers took; without answers there is none."""

    p50_us: float
    p95_us: float
    p99_us: float
    max_us: float


@_TOLD
class Allocation(TypedDict):
    """Summary of all answers."""

    answers: int
    malformed: int
    """Lines of a stream that were no command."""
    statuses: dict[str, int]
    largest_relative_gap: float | None
    latency: Latency


@_TOLD
class Level(TypedDict):
    """What became of the rows of one exact priority; gap null where nothing is proved."""

    rows: list[int]
    error: float | None
    gap: float | None


@_TOLD
class Answer(TypedDict, total=False):
    """The answer to one line of a stream: forces with their certificate, or what is wrong with the line."""

    error: str
    """Alone, where the line is no command."""
    forces: list[float]
    """N, or the unit of the actuators."""
    status: str
    objective: float
    duality_gap: float
    """At most so much is the objective above the best; in the objective's unit."""
    vertex_weights: list[float]
    worst_vertex: int
    """Counted from 0."""
    unallocated: list[float]
    """Command less effort with the nominal geometry."""
    saturation: list[int]
    """0 inside, 1 at the lower bound, 2 at the upper bound, by actuator."""
    iterations: int
    levels: list[Level]
    """Of exact priorities, where the objective is propellant."""


@_TOLD
class Reach(TypedDict):
    """An attainable set; numbers in the unit of their row."""

    meaning: str
    is_empty: bool
    holds_origin: bool
    box: list[float] | None
    """Half-widths of the largest box about zero with the proportions of what is wanted."""
    sphere: float | None
    """Radius over all rows; meaningful where they have one unit."""
    spheres: dict[str, float | None]
    """Radius by unit, over the rows with that unit."""
    lines: list[list[float | None]]
    """Reach along each direction, back and forth."""


@_TOLD
class Attainable(TypedDict):
    """What the actuators can make."""

    problem: str
    wanted: list[float] | None
    share_of_wanted: dict[str, float | None] | None
    """By set; 1 or more where the box that is wanted is attainable."""
    units: list[str]
    directions: list[list[float]]
    sets: dict[str, Reach]
    samples: int
    seed: int
    sentences: list[str]


@_TOLD
class Constraint(TypedDict):
    """A matrix inequality, judged from the data."""

    name: str
    smallest: float | None
    """Smallest eigenvalue."""
    rounding: float | None
    """By how much rounding can have moved it."""
    margin: float
    """That was asked for."""
    holds: bool


class Norm(TypedDict):
    """An H-infinity norm between two bounds."""

    lower: float
    upper: float
    frequency_rad_s: float


class EnergyNorm(TypedDict):
    """What is promised of an H2 norm, and its bounds."""

    promised: float | None
    lower: float | None
    upper: float | None


@_TOLD
class Peak(TypedDict):
    """The largest command that follows a start within its bounds."""

    value: float | None
    """That was found."""
    bound: float
    """That none exceeds."""
    limit: float | None
    start: list[float]
    time_s: float


@_TOLD
class Saturation(TypedDict):
    """What a loop with saturation is proved to bear."""

    share: float
    """Of each command, that the limits may take away; 1: all of it."""
    command_over_limit: float | None
    """That commands may reach, in their limits; null: any."""


@_TOLD
class Written(TypedDict):
    """Gains that were written into a mission file."""

    file: str
    keys: list[str]
    checks: dict[str, str]
    """What then warns or fails."""


class Synthesis(TypedDict):
    """Gains and their certificate; keys that a recipe does not have are left out."""

    problem: str
    status: str
    sentence: str
    certified: bool
    gains: dict[str, list[list[float]] | float]
    """Matrices by rows; a number where a structure names it."""
    backend: str
    conflict: list[str]
    """Inequalities that cannot hold together."""
    multipliers: dict[str, float]
    """Of the proof that they cannot."""
    constraints: list[Constraint]
    no_point_with_entries_up_to: NotRequired[dict[str, float | None]]
    """Range of each unknown that the proof covers; null: any."""
    promised_norm: NotRequired[float | None]
    smallest_gamma: NotRequired[list[float | None]]
    """Between which the smallest bound on the norm lies."""
    poles_rad_s: NotRequired[list[list[float]]]
    """Real and imaginary part."""
    norm: NotRequired[Norm | None]
    h2_norm: NotRequired[EnergyNorm]
    pole_depths_rad_s: NotRequired[dict[str, float]]
    """By region of poles that was asked for, how deep the poles lie in it."""
    saturation: NotRequired[Saturation]
    peak: NotRequired[Peak | None]
    stable_ratios: NotRequired[list[float | None] | None]
    """Range of (assumed mass)/(true mass); null: without an end."""
    written: NotRequired[Written]
