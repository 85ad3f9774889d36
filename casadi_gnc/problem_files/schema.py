"""What every mission file may say: keys, units, shapes and ranges.

SI units and radians throughout, with the unit in the key where it helps. Unknown keys are errors.
The gains of a law are declared once, in the law's own file; their part of the schema is made from
there. The tables of a craft are declared in its file in `casadi_gnc.vehicles`.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Annotated, Any, Literal

import casadi as ca
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, create_model, field_validator, model_validator

from casadi_gnc.laws import LAWS, Law, gains_of
from casadi_gnc.mechanics import attitude
from casadi_gnc.missions.mission import MetricKind
from casadi_gnc.system.text import refused
from casadi_gnc.tables import matrices

Vector = Annotated[list[float], Field(min_length=3, max_length=3)]
Rows = Annotated[list[Vector], Field(min_length=1)]
Matrix = Annotated[list[Vector], Field(min_length=3, max_length=3)]
Positive = Annotated[float, Field(gt=0)]
Angle = Annotated[float, Field(ge=-2 * math.pi, le=2 * math.pi, description="in radians")]
Angles = Annotated[list[Angle], Field(min_length=3, max_length=3)]
NonNegative = Annotated[float, Field(ge=0)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]{0,62}$", description="letters, digits and _")]


def _is_one(value: Any) -> Any:
    if value is not True and value == 1:
        return value
    raise ValueError(f"format is {value!r}; this version reads format 1")


Format = Annotated[Literal[1], BeforeValidator(_is_one)]


class Part(BaseModel):
    """Base of all parts of a file: unknown keys, infinities, NaN and numbers as text are refused."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True, strict=True)

    @field_validator("*", mode="after")
    @classmethod
    def _can_be_read(cls, value: Any) -> Any:
        for text in value if isinstance(value, list) else [value]:
            if isinstance(text, str) and (character := refused(text)):
                raise ValueError(
                    f"holds the character {character}, which is invisible and can change what a reader, a terminal or "
                    "a compiler takes the rest for; leave it out"
                )
        return value


class Orientation(Part):
    """How the combined frame is turned from the chaser's: a matrix or three angles, not both."""

    rotation: Matrix | None = Field(default=None, description="R, v_combined = R v_chaser, orthonormal to 1e-4")
    rotation_321_rad: Angles | None = Field(default=None, description="yaw, pitch, roll of the frame: R = Rx Ry Rz")

    @field_validator("rotation")
    @classmethod
    def _is_rotation(cls, value: list[list[float]] | None) -> list[list[float]] | None:
        return None if value is None else matrices.check_rotation(value)

    @model_validator(mode="after")
    def _not_both(self) -> Orientation:
        if self.rotation is not None and self.rotation_321_rad is not None:
            raise ValueError("rotation and rotation_321_rad are both given; keep one")
        return self


def orientation(model: Orientation) -> ca.DM | None:
    """Return the rotation that a table gives, (3, 3), or None if it gives none."""
    if model.rotation is not None:
        return ca.DM(model.rotation)
    if model.rotation_321_rad is not None:
        return attitude.frame_rotation(*model.rotation_321_rad)
    return None


class FunnelModel(Part):
    """Bounds on a measured signal: -below rho < s < above rho, rho from start to floor."""

    signal: str = "mrp"
    start: list[Positive]
    floor: list[Positive]
    decay_per_s: list[Positive]
    below: list[Positive] = Field(description="share of rho allowed below zero")
    above: list[Positive] = Field(description="share of rho allowed above zero")

    @model_validator(mode="after")
    def _fit(self) -> FunnelModel:
        sizes = {name: len(getattr(self, name)) for name in ("start", "floor", "decay_per_s", "below", "above")}
        if len(set(sizes.values())) > 1:
            raise ValueError("lists of different length: " + ", ".join(f"{k} has {v}" for k, v in sizes.items()))
        for i, (start, floor) in enumerate(zip(self.start, self.floor, strict=True), 1):
            if floor > start:
                raise ValueError(f"axis {i}: floor {floor:g} is wider than start {start:g}")
        return self


class TimingModel(Part):
    """When things happen."""

    mode: Literal["sampled", "continuous"]
    sample_period_s: Positive
    duration_s: Positive
    plant_substeps: Annotated[int, Field(ge=1, le=1000)] = 1
    record_period_s: Positive | None = Field(default=None, description="keep a sample so often; every one if left out")

    @model_validator(mode="after")
    def _whole(self) -> TimingModel:
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


def _law_model(name: str, law: type[Law]) -> type[Part]:
    """Return the model of a law's table, made from the gains and options that the law declares."""
    fields: dict[str, Any] = {"type": (Literal[name], ...)}
    for key, declared in gains_of(law).items():
        about = declared.metadata
        if "choices" in about:
            kind: Any = bool if True in about["choices"] else Literal[about["choices"]]
            default = ... if declared.default is dataclasses.MISSING else declared.default
            fields[key] = (kind, Field(default, description=about["note"]))
            continue
        bounds = {"ge": about["minimum"], "gt": about["above"]}
        number: Any = Annotated[float, Field(**{k: v for k, v in bounds.items() if v is not None})]
        kind = number
        for size in reversed(about["size"] if isinstance(about["size"], tuple) else (about["size"],)):
            kind = kind if size == 1 else Annotated[list[kind], Field(min_length=size, max_length=size)]
        if declared.default is None:
            kind = kind | None
        symbol = f"{about['symbol']}, " if about["symbol"] else ""
        text = f"{symbol}{about['note']}" + (f" [{about['unit']}]" if about["unit"] else "")
        default = ... if declared.default is dataclasses.MISSING else declared.default
        fields[key] = (kind, Field(default, description=text))
    return create_model(f"{law.__name__}Gains", __base__=Part, __doc__=f"Gains of the law {name!r}.", **fields)


#: Model of a law's table by the law's name in a file.
LAW_MODELS = {name: _law_model(name, law) for name, law in LAWS.items()}


def law_tables(*names: str) -> Any:
    """Return the type of a scheme's `law`: the table of one of some laws, told apart by `type`."""
    models = tuple(LAW_MODELS[name] for name in names)
    if len(models) == 1:
        return models[0]
    alternatives: Any = models[0]
    for model in models[1:]:
        alternatives = alternatives | model
    return Annotated[alternatives, Field(discriminator="type")]


class SchemeModel(Part):
    """One way to fly the mission; a craft adds its laws (`law`), limits and how it allocates."""

    name: Name
    title: str = ""
    feedback: Literal["achieved", "wanted"] = Field(
        default="achieved", description="what observers and anti-windup are told"
    )
    as_printed: bool | list[str] = Field(default=False, description="keep the paper's errata: all, or those named")


class MetricModel(Part):
    """One number asked of every flight."""

    name: Name
    kind: MetricKind
    signal: str
    threshold: Positive | None = Field(default=None, description="of settling and reaching: the norm is below it")
    norm: Literal["max", "two"] | None = Field(
        default=None, description="max: largest magnitude, two: 2-norm; two for a sample_sum, else max"
    )
    after_s: NonNegative = Field(default=0.0, description="begin of the window; not of a settling")
    until_s: Positive | None = Field(default=None, description="end of the window; not of a settling")

    @model_validator(mode="after")
    def _complete(self) -> MetricModel:
        if (self.kind in ("settling", "reaching")) != (self.threshold is not None):
            raise ValueError("settling and reaching, and nothing else, take a threshold")
        if self.kind == "settling" and (self.after_s or self.until_s):
            raise ValueError("a settling looks at the whole flight and takes no after_s or until_s")
        if self.until_s is not None and self.until_s < self.after_s:
            raise ValueError(f"until_s {self.until_s:g} is before after_s {self.after_s:g}")
        return self


class NoiseModel(Part):
    """How random numbers are drawn; how large each noise is stands in the craft's own tables."""

    seed: Annotated[int, Field(ge=0, lt=2**63, description="the same seed gives the same flight")] = 1
    period_s: Positive | None = Field(default=None, description="held so long; one sample period if left out")
    truncation_sigma: Positive | None = Field(default=None, description="larger ones are cut to so many deviations")


class SweepModel(Part):
    """Fly every scheme once for each of some values of one key, and tabulate one result."""

    name: Name
    key: str = Field(description='where in the file, e.g. "scheme.*.force_limit_N.*"; * stands for every item')
    values: Annotated[list[float | str | bool], Field(min_length=1)]
    show: str = Field(description="a metric, or a status such as FUNNEL_LEFT, of which the first time is shown")


class MissionModel(Part):
    """What every mission file has; a craft adds its own tables, and `scheme` (`casadi_gnc.vehicles`)."""

    format: Format
    kind: Literal["mission"]
    title: str = ""
    source: str = ""
    funnel: list[FunnelModel] = []
    timing: TimingModel
    noise: NoiseModel = NoiseModel()
    metric: list[MetricModel] = []
    sweep: list[SweepModel] = []

    @field_validator("scheme", check_fields=False)
    @classmethod
    def _names_of_files(cls, value: list[Any]) -> list[Any]:
        for item in value:
            if item.name.lower() in ("comparison", "summary"):
                raise ValueError(f"a scheme cannot be named {item.name!r}: a file of the results is called so")
        return value

    @field_validator("funnel", mode="before")
    @classmethod
    def _are_tables(cls, value: Any) -> Any:
        if isinstance(value, dict):
            raise ValueError("there may be several funnels; write [[funnel]], not [funnel]")
        return value

    @field_validator("funnel")
    @classmethod
    def _signals_differ(cls, value: list[FunnelModel]) -> list[FunnelModel]:
        signals = [funnel.signal for funnel in value]
        for signal in signals:
            if signals.count(signal) > 1:
                raise ValueError(f"{signal!r} has two funnels")
        return value

    @field_validator("scheme", "metric", "sweep", check_fields=False)
    @classmethod
    def _names_differ(cls, value: list[Any]) -> list[Any]:
        names = [item.name for item in value]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"the name {name!r} is given twice")
        return value
