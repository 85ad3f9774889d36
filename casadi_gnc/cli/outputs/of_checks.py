"""What `check`, `margins` and `reproduce` print."""

from __future__ import annotations

from typing import Literal

from pydantic import ConfigDict, with_config
from typing_extensions import TypedDict

_TOLD = with_config(ConfigDict(use_attribute_docstrings=True))


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
class MassCentre(TypedDict):
    """Errors of the mass centre, true minus known, for which the loop is stable."""

    key: str
    """Of a file, of that error; empty where the craft has none."""
    low_m: list[float | None]
    """End along each axis, the others without error; null where it is stable as far as a kilometre."""
    high_m: list[float | None]
    nearest_m: float | None
    """Least distance at which it is not, of all directions that were looked at."""
    towards: list[float] | None
    why_none: str
    """Why there is no bound; empty where there is one."""


@_TOLD
class StructuredDisk(TypedDict):
    """Bounds by mu on the disk that all efforts bear at once, where it is least."""

    proved: float
    """Radius that is borne, by the certified upper bound on mu."""
    broken: float | None
    """Radius of the factors below, which bring a pole to the boundary; null where none were found."""
    at_rad_per_s: float
    gains: list[float]
    """Magnitudes of these factors, by effort."""
    phases_rad: list[float]


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
    mass_centre: MassCentre
    structured_disk: StructuredDisk | None
    """With --structured."""


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
