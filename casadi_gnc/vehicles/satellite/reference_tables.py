"""Where a satellite should point, as a file says it: one table for each reference, in the order in which they count."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from casadi_gnc import guests
from casadi_gnc.errors import GncError, LawError
from casadi_gnc.mechanics.earth import Epoch
from casadi_gnc.navigation import GroundTarget, Inertial, Nadir, Reference, Slew, SunPointing, Table, Timeline
from casadi_gnc.tables import matrices
from casadi_gnc.tables.part import MisfitError, NonNegative, Part, Positive, Vector, all_of

from .attitude_tables import DEGREE, Attitude, Quaternion

From = Annotated[float, Field(ge=0, description="time from which it counts")]
Turn = Annotated[float, Field(ge=0, description="time that the smooth turn from the one before takes; 0: at once")]


class InertialTable(Attitude):
    """A fixed attitude of the body from the inertial frame; none: the frame's own."""

    kind: Literal["inertial"]
    from_s: From = 0.0
    turn_s: Turn = 0.0

    def reference(self, epoch: Epoch | None) -> Reference:
        """Return the reference."""
        return Inertial(self.quaternion().elements())


class NadirTable(Attitude):
    """z to the Earth's centre, y against the orbit's normal, x along the way; an attitude is taken from there."""

    kind: Literal["nadir"]
    from_s: From = 0.0
    turn_s: Turn = 0.0

    def reference(self, epoch: Epoch | None) -> Reference:
        """Return the reference."""
        return Nadir(self.quaternion().elements())


class SunTable(Part):
    """An axis to the sun."""

    kind: Literal["sun"]
    from_s: From = 0.0
    turn_s: Turn = 0.0
    axis: Vector = Field(default=[0.0, 0.0, 1.0], description="unit vector, body axes, that looks at the sun")

    @field_validator("axis")
    @classmethod
    def _unit(cls, axis: list[float]) -> list[float]:
        return matrices.check_unit(axis)

    def reference(self, epoch: Epoch | None) -> Reference:
        """Return the reference."""
        return SunPointing(_known(epoch, "sun"), self.axis)


class GroundTable(Part):
    """z to a place on the Earth."""

    kind: Literal["ground"]
    from_s: From = 0.0
    turn_s: Turn = 0.0
    latitude_deg: Annotated[float, Field(ge=-90, le=90)] = Field(description="geodetic")
    longitude_deg: Annotated[float, Field(ge=-360, le=360)] = Field(description="east positive")
    height_m: float = Field(default=0.0, description="above the ellipsoid")

    def reference(self, epoch: Epoch | None) -> Reference:
        """Return the reference."""
        place = (DEGREE * self.latitude_deg, DEGREE * self.longitude_deg, self.height_m)
        return GroundTarget(_known(epoch, "ground"), *place)


class SlewTable(Part):
    """A turn about one axis between two attitudes from the inertial frame, within a rate and an acceleration."""

    kind: Literal["slew"]
    from_s: NonNegative = Field(default=0.0, description="time from which it counts, and at which it begins")
    turn_s: Turn = 0.0
    first: Attitude = Attitude()
    last: Attitude
    rate_limit_deg_per_s: Positive
    acceleration_limit_deg_per_s2: Positive

    def reference(self, epoch: Epoch | None) -> Reference:
        """Return the reference."""
        first, last = (each.quaternion().elements() for each in (self.first, self.last))
        rate, acceleration = DEGREE * self.rate_limit_deg_per_s, DEGREE * self.acceleration_limit_deg_per_s2
        return Slew(first, last, rate, acceleration, self.from_s)


class TableTable(Part):
    """A spline through attitudes from the inertial frame at given times, told here or in a CSV file."""

    kind: Literal["table"]
    from_s: From = 0.0
    turn_s: Turn = 0.0
    file: str | None = Field(
        default=None, description="CSV with the columns t, q0, q1, q2, q3, scalar first; beside the problem file"
    )
    times_s: list[float] = Field(default=[], description="rising")
    quaternions_scalar_first: list[Quaternion] = []

    @model_validator(mode="before")
    @classmethod
    def _read(cls, told: Any) -> Any:
        if not isinstance(told, dict) or not isinstance(told.get("file"), str):
            return told
        if "times_s" in told or "quaternions_scalar_first" in told:
            raise MisfitError("the rows are in the file; leave times_s and quaternions_scalar_first out", "file")
        try:
            read = Table.read(guests.data(told["file"]))
        except GncError as error:
            raise MisfitError(str(error), "file") from None
        rows = [list(row) for row in read.quaternions]
        return {**told, "times_s": list(read.times), "quaternions_scalar_first": rows}

    @model_validator(mode="after")
    def _is_one(self) -> TableTable:
        try:
            self.reference(None)
        except LawError as error:
            raise ValueError(str(error)) from None
        return self

    def reference(self, epoch: Epoch | None) -> Reference:
        """Return the reference."""
        return Table(self.times_s, self.quaternions_scalar_first)


AnyReference = Annotated[
    InertialTable | NadirTable | SunTable | GroundTable | SlewTable | TableTable, Field(discriminator="kind")
]


def timeline(tables: Sequence[Any], epoch: Epoch | None, *, has_orbit: bool) -> Reference:
    """Return what the tables say together; without tables, the inertial frame.

    Raises
    ------
    MisfitError
        For a first one that counts later, times that do not rise, an orbit or an epoch that is needed and not there,
        and what a reference itself refuses.
    """
    steps: list[tuple[float, Reference]] = []

    def add(i: int, each: Any) -> None:
        if i == 0 and each.from_s > 0:
            raise MisfitError(
                "nothing is said of the time before; let the first one begin at 0", "reference", 0, "from_s"
            )
        if i > 0 and not each.from_s > tables[i - 1].from_s:
            told = f"begins at {each.from_s:g} s, not after the one before, {tables[i - 1].from_s:g} s"
            raise MisfitError(told, "reference", i, "from_s")
        if i == 0 and each.turn_s > 0:
            raise MisfitError("there is no reference before it to turn from; leave it out", "reference", i, "turn_s")
        if i + 1 < len(tables) and each.from_s + each.turn_s > tables[i + 1].from_s:
            told = f"the turn ends at {each.from_s + each.turn_s:g} s, after the next one begins"
            raise MisfitError(
                f"{told}, {tables[i + 1].from_s:g} s; turn faster, or begin it later", "reference", i, "turn_s"
            )
        if each.kind in ("nadir", "ground") and not has_orbit:
            raise MisfitError("needs to know where the satellite is; give [orbit]", "reference", i, "kind")
        try:
            steps.append((each.from_s, each.reference(epoch)))
        except (LawError, ValueError) as error:
            raise MisfitError(str(error), "reference", i) from None

    all_of(*(partial(add, i, each) for i, each in enumerate(tables)))
    if not steps:
        return Reference()
    return steps[0][1] if len(steps) == 1 else Timeline(steps, [each.turn_s for each in tables])


def _known(epoch: Epoch | None, kind: str) -> Epoch:
    if epoch is None:
        raise ValueError(f'a reference of kind "{kind}" needs to know when it is; give [orbit] with an epoch')
    return epoch
