"""What every mission file may say: keys, units, shapes and ranges; the craft's own tables are the craft's.

SI units and radians throughout, with the unit in the key where it helps. Unknown keys are errors.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, field_validator, model_validator

from casadi_gnc.campaigns.dispersions import DispersionTable
from casadi_gnc.errors import FaultHandlingError, RequirementError
from casadi_gnc.missions.fault_handling import FaultHandling
from casadi_gnc.missions.requirements import Requirement
from casadi_gnc.missions.requirements.requirement import ID
from casadi_gnc.missions.scheme import MetricKind
from casadi_gnc.missions.timing import Timing
from casadi_gnc.tables.part import MisfitError, Name, NonNegative, Part, Positive
from casadi_gnc.tables.wording import shown


def _is_one(value: Any) -> Any:
    if value is not True and value == 1:
        return value
    raise ValueError(f"format is {shown(value)}; this version reads format 1")


Format = Annotated[Literal[1], BeforeValidator(_is_one)]


class FunnelTable(Part):
    """Bounds on a measured signal: -below rho < s < above rho, rho from start to floor."""

    signal: str = "mrp"
    start: list[Positive]
    floor: list[Positive]
    decay_per_s: list[Positive]
    below: list[Positive] = Field(description="share of rho allowed below zero")
    above: list[Positive] = Field(description="share of rho allowed above zero")

    @model_validator(mode="after")
    def _fit(self) -> FunnelTable:
        sizes = {name: len(getattr(self, name)) for name in ("start", "floor", "decay_per_s", "below", "above")}
        if len(set(sizes.values())) > 1:
            raise ValueError("lists of different length: " + ", ".join(f"{k} has {v}" for k, v in sizes.items()))
        for i, (start, floor) in enumerate(zip(self.start, self.floor, strict=True), 1):
            if floor > start:
                raise ValueError(f"axis {i}: floor {floor:g} is wider than start {start:g}")
        return self


class TimingTable(Part):
    """When things happen."""

    mode: Literal["sampled", "continuous"]
    sample_period_s: Positive
    duration_s: Positive
    plant_substeps: Annotated[int, Field(ge=1, le=1000)] = 1
    record_period_s: Positive | None = Field(default=None, description="keep a sample so often; every one if left out")

    @model_validator(mode="after")
    def _whole(self) -> TimingTable:
        samples = self.duration_s / self.sample_period_s
        if not samples <= 1e9 or abs(samples - round(samples)) > 1e-6 * samples:
            raise ValueError(f"duration_s / sample_period_s is {samples:.6g}; expected a whole number up to 1e9")
        if self.record_period_s is not None and self.record_period_s > self.duration_s:
            raise ValueError(
                f"record_period_s {self.record_period_s:g} is longer than the flight, {self.duration_s:g} s"
            )
        kept = (self.record_period_s or self.sample_period_s) / self.sample_period_s
        if kept < 0.5 or abs(kept - round(kept)) > 1e-6 * kept:
            raise ValueError(f"record_period_s / sample_period_s is {kept:.6g}; expected a whole number")
        return self

    def timing(self) -> Timing:
        """Return the times of a flight."""
        kept = round((self.record_period_s or self.sample_period_s) / self.sample_period_s)
        return Timing(self.mode, self.sample_period_s, self.duration_s, self.plant_substeps, kept)


class SchemeTable(Part):
    """One way to fly the mission; a craft adds how far a law may ask and how its effort is allocated."""

    name: Name
    title: str = ""
    feedback: Literal["achieved", "wanted"] = Field(
        default="achieved", description="what observers and anti-windup are told was done"
    )
    as_printed: bool | list[str] = Field(default=False, description="keep the paper's errata: all, or those named")
    law: dict[str, Any] = Field(description="type names the law, the other keys are its gains")

    @field_validator("name")
    @classmethod
    def _is_no_file_of_ours(cls, value: str) -> str:
        if value.lower() in ("comparison", "summary"):
            raise ValueError(f"a scheme cannot be named {value!r}: a file of the results is called so")
        return value


class MetricAsked(Part):
    """One number asked of a flight."""

    kind: MetricKind
    signal: str
    threshold: Positive | None = Field(default=None, description="of settling and reaching: the norm is below it")
    norm: Literal["max", "two"] | None = Field(
        default=None, description="max: largest magnitude, two: 2-norm; two for a sample_sum, else max"
    )
    after_s: NonNegative = Field(
        default=0.0, description="begin of the window; times of settling and reaching count from it"
    )
    until_s: Positive | None = Field(default=None, description="end of the window")

    @model_validator(mode="after")
    def _complete(self) -> MetricAsked:
        if (self.kind in ("settling", "reaching")) != (self.threshold is not None):
            raise ValueError("settling and reaching, and nothing else, take a threshold")
        if self.until_s is not None and self.until_s < self.after_s:
            raise ValueError(f"until_s {self.until_s:g} is before after_s {self.after_s:g}")
        return self


class MetricTable(MetricAsked):
    """One number asked of every flight, and its name."""

    name: Name


class RequirementTable(Part):
    """What every flight must meet: a bound on a metric, or a formula over signals and time."""

    id: str = Field(description="letters, digits, ., _ and -", json_schema_extra={"pattern": ID})
    text: str = Field(default="", description="in words")
    metric: Name | None = Field(default=None, description="a metric of this file, with at_most or at_least")
    at_most: float | None = Field(default=None, description="in the metric's unit")
    at_least: float | None = Field(default=None, description="in the metric's unit")
    formula: str | None = Field(default=None, description='e.g. "always[0, 600](norm(rate) <= 0.01)"')
    share: float = Field(default=1.0, gt=0, le=1, description="of the flights that must meet it")
    confidence: float = Field(default=0.9, gt=0, lt=1, description="with which that share must be shown")

    @model_validator(mode="after")
    def _fit(self) -> RequirementTable:
        try:
            self.requirement()
        except RequirementError as error:
            raise MisfitError(str(error), *filter(None, [error.key])) from None
        return self

    def requirement(self) -> Requirement:
        """Return what the table says."""
        given = self.model_dump()
        return Requirement(**{**given, "metric": self.metric or "", "formula": self.formula or ""})


class NoiseTable(Part):
    """How random numbers are drawn; how large each noise is stands in the craft's own tables."""

    seed: Annotated[int, Field(ge=0, lt=2**63, description="the same seed gives the same flight")] = 1
    period_s: Positive | None = Field(default=None, description="held so long; one sample period if left out")
    truncation_sigma: Positive | None = Field(default=None, description="larger ones are cut to so many deviations")


class SweepTable(Part):
    """Fly every scheme once for each of some values of one key, and tabulate one result."""

    name: Name
    key: str = Field(description='where in the file, e.g. "scheme.*.force_limit_N.*"; * stands for every item')
    values: Annotated[list[float | str | bool], Field(min_length=1)]
    show: str = Field(description="a metric, or a status such as FUNNEL_LEFT, of which the first time is shown")


class FaultHandlingTable(Part):
    """What flight packages do with faults beside telling them; what is left out is off."""

    failures: Annotated[list[str], Field(min_length=1)] = Field(
        default=[],
        description="bits of the status that make a failure; all but those of limits and certificates if left out",
    )
    count: bool = Field(default=False, description="steps, replaced measurements, steps in a row with each bit")
    latch_first: bool = Field(default=False, description="keep the first failure until it is acknowledged")
    measurement_age_s: Positive | dict[str, Positive] | None = Field(
        default=None, description="how long a measurement may be held, one for all or by signal"
    )
    safe_output: Literal["zero", "hold"] | list[float] | None = Field(
        default=None, description="what the actuators are told in safe mode, in words or a number each"
    )
    safe_after: Annotated[int, Field(ge=1)] | None = Field(
        default=None, description="failures in a row that begin safe mode"
    )
    release_after: Annotated[int, Field(ge=1)] | None = Field(
        default=None, description="steps without failure that end it; only an acknowledgement if left out"
    )
    gain_change_s: Positive | None = Field(
        default=None, description="the effort moves so long from that of old gains to that of new ones"
    )
    state_image: bool = Field(default=False, description="the state can be exported as octets and imported")

    @model_validator(mode="after")
    def _fit(self) -> FaultHandlingTable:
        try:
            self.handling()
        except FaultHandlingError as error:
            raise MisfitError(str(error), error.key) from None
        return self

    def handling(self) -> FaultHandling:
        """Return what the table says."""
        return FaultHandling(**self.model_dump(exclude_none=True))


class MissionTables(Part):
    """What every mission file has besides the craft's tables and the schemes."""

    format: Format
    kind: Literal["mission"]
    title: str = ""
    source: str = ""
    funnel: list[FunnelTable] = []
    timing: TimingTable
    noise: NoiseTable = NoiseTable()
    metric: list[MetricTable] = []
    requirement: list[RequirementTable] = []
    sweep: list[SweepTable] = []
    dispersion: list[DispersionTable] = Field(default=[], description="what differs from case to case of a campaign")
    fault_handling: FaultHandlingTable | None = Field(
        default=None, description="what flight packages do with faults beside telling them"
    )
    checks: list[str] = Field(default=[], description='further checks: names, or "./file.py:function"')

    @field_validator("funnel", mode="before")
    @classmethod
    def _are_tables(cls, value: Any) -> Any:
        if isinstance(value, dict):
            raise ValueError("there may be several funnels; write [[funnel]], not [funnel]")
        return value

    @field_validator("funnel")
    @classmethod
    def _signals_differ(cls, value: list[FunnelTable]) -> list[FunnelTable]:
        signals = [funnel.signal for funnel in value]
        for signal in signals:
            if signals.count(signal) > 1:
                raise ValueError(f"{signal!r} has two funnels")
        return value

    @field_validator("requirement")
    @classmethod
    def _ids_differ(cls, value: list[RequirementTable]) -> list[RequirementTable]:
        ids = [each.id for each in value]
        for i, one in enumerate(ids):
            if one in ids[:i]:
                raise MisfitError(f"the id {one!r} is given twice", i, "id")
        return value

    @field_validator("metric", "sweep")
    @classmethod
    def _names_differ(cls, value: list[Any]) -> list[Any]:
        return names_differ(value)


def names_differ(value: list[Any]) -> list[Any]:
    """Return tables as they came; raise `ValueError` where two have one name."""
    names = [item.name for item in value]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"the name {name!r} is given twice")
    return value
