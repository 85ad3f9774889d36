"""The tables by which a problem file disperses a key: `[[dispersion]]` with exactly one distribution."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

from pydantic import Field, field_validator, model_validator

from casadi_gnc.campaigns.correlated import Correlated
from casadi_gnc.campaigns.distributions import Choice, Distribution, LogUniform, Normal, Uniform
from casadi_gnc.campaigns.orientations import Direction, Form, Rotation
from casadi_gnc.errors import CampaignError, GncError
from casadi_gnc.system.csv_file import read_table
from casadi_gnc.tables.matrices import SYMMETRIC
from casadi_gnc.tables.part import MisfitError, NonNegative, Part, Positive, Vector

Range = Annotated[list[float], Field(min_length=2, max_length=2)]
Numbers = Annotated[list[float], Field(min_length=1)]


class NormalTable(Part):
    """A normal number."""

    mean: float
    deviation: Positive = Field(description="standard deviation, before it is truncated")
    truncate: Positive | None = Field(default=None, description="values stay within so many deviations of the mean")


class ChoiceTable(Part):
    """One of several values."""

    values: Annotated[list[float], Field(min_length=1)] | Annotated[list[Numbers], Field(min_length=1)] = Field(
        description="numbers, or rows of as many numbers as the key stands for"
    )
    weights: list[NonNegative] = Field(default=[], description="how often each, relative to the others; all alike")

    @model_validator(mode="after")
    def _fit(self) -> ChoiceTable:
        if self.weights and len(self.weights) != len(self.values):
            raise MisfitError(
                f"{len(self.weights)} weights for {len(self.values)} values; expected one each", "weights"
            )
        if self.weights and sum(self.weights) <= 0:
            raise MisfitError("all weights are zero; expected one above", "weights")
        lengths = {len(row) for row in self.rows()}
        if len(lengths) > 1:
            raise MisfitError(
                f"rows of {' and '.join(map(str, sorted(lengths)))} numbers; expected one length", "values"
            )
        return self

    def rows(self) -> list[list[float]]:
        """Return the alternatives, a row each."""
        return [row if isinstance(row, list) else [row] for row in self.values]


class DirectionTable(Part):
    """A vector in a random direction."""

    length: Positive = 1.0
    length_to: Positive | None = Field(default=None, description="lengths are uniform from length to this")
    about: Vector = Field(default=[0.0, 0.0, 1.0], description="axis of the cone; its length does not matter")
    within_rad: Annotated[float, Field(gt=0, le=math.pi)] = Field(
        default=math.pi, description="half angle of the cone; a half turn is the whole sphere"
    )

    @model_validator(mode="after")
    def _fit(self) -> DirectionTable:
        if not any(self.about):
            raise MisfitError("is zero; expected a vector along the axis", "about")
        if self.length_to is not None and self.length_to <= self.length:
            raise MisfitError(f"{self.length_to:g} is not above length, {self.length:g}", "length_to")
        return self


class RotationTable(Part):
    """A random attitude: all alike, or turned from the nominal one by a normal angle about a random axis."""

    form: Form = "mrp"
    deviation_rad: Positive | None = Field(default=None, description="of the angle; left out, all attitudes are alike")
    truncate: Positive | None = Field(default=None, description="the angle stays within so many deviations")
    nominal: list[float] | None = Field(default=None, description="attitude that is turned; the key's own if left out")

    @model_validator(mode="after")
    def _fit(self) -> RotationTable:
        if self.deviation_rad is None:
            for key in ("truncate", "nominal"):
                if getattr(self, key) is not None:
                    raise MisfitError("is for a rotation with deviation_rad; leave it out, or give that", key)
        if self.nominal is not None:
            self.rotation(None)
        return self

    def rotation(self, nominal: list[float] | None) -> Rotation:
        """Return the distribution; `nominal` is the key's own attitude."""
        turned = self.nominal if self.nominal is not None else nominal
        try:
            return Rotation(self.form, self.deviation_rad, self.truncate, None if turned is None else tuple(turned))
        except CampaignError as error:
            raise MisfitError(str(error), "nominal") from None


class CorrelatedTable(Part):
    """A block of jointly normal numbers."""

    mean: Numbers
    covariance: Annotated[list[Numbers], Field(min_length=1), SYMMETRIC] = Field(
        description="rows, positive semidefinite"
    )

    @model_validator(mode="after")
    def _fit(self) -> CorrelatedTable:
        self.block()
        return self

    def block(self) -> Correlated:
        """Return the distribution."""
        try:
            return Correlated(tuple(self.mean), tuple(map(tuple, self.covariance)))
        except CampaignError as error:
            raise MisfitError(str(error), "covariance") from None


class RowsTable(Part):
    """Rows of a CSV file, all alike: a Latin hypercube of as many cases takes each row once."""

    file: str = Field(description="beside the problem file")
    columns: list[str] = Field(default=[], description="names in its first line, one for each number; all if left out")

    def rows(self, folder: Path) -> Choice:
        """Return the distribution; raise `MisfitError` where the file does not give it."""
        try:
            table = read_table(folder / self.file)
            lacking = [name for name in self.columns if name not in table.names]
            if lacking:
                raise MisfitError(
                    f"{self.file} has no column {lacking[0]!r}; it has {', '.join(table.names)}", "columns"
                )
            rows = table.column_numbers(self.columns or table.names)
        except GncError as error:
            raise MisfitError(str(error), "file") from None
        if not rows:
            raise MisfitError(f"{self.file} has a line of names and no rows", "file")
        for (line, _), row in zip(table.rows, rows, strict=True):
            if not all(map(math.isfinite, row)):
                raise MisfitError(
                    f"{self.file}, line {line}: a number is not finite; expected what can be flown", "file"
                )
        return Choice(tuple(map(tuple, rows)))


class DispersionTable(Part):
    """What one key, or every one that a pattern stands for, is in the cases of a campaign."""

    key: Annotated[str, Field(min_length=1)] = Field(
        description='where in the file, e.g. "truth.inertia_factor"; * stands for every item'
    )
    normal: NormalTable | None = None
    uniform: Range | None = Field(default=None, description="from, to")
    log_uniform: Range | None = Field(default=None, description="from, to: the logarithm is uniform")
    choice: ChoiceTable | None = None
    direction: DirectionTable | None = None
    rotation: RotationTable | None = None
    correlated: CorrelatedTable | None = None
    table: RowsTable | None = None

    @field_validator("uniform", "log_uniform")
    @classmethod
    def _ascends(cls, value: list[float] | None) -> list[float] | None:
        if value is not None and value[0] >= value[1]:
            raise ValueError(f"from {value[0]:g} to {value[1]:g}; expected the lower end first")
        return value

    @field_validator("log_uniform")
    @classmethod
    def _is_positive(cls, value: list[float] | None) -> list[float] | None:
        if value is not None and value[0] <= 0:
            raise ValueError(f"from {value[0]:g}; expected numbers above 0, which have a logarithm")
        return value

    @model_validator(mode="after")
    def _one_distribution(self) -> DispersionTable:
        given = self._given()
        if not given:
            raise MisfitError(f"has no distribution; expected one of {', '.join(_KINDS)}")
        if len(given) > 1:
            raise MisfitError(f"has several distributions, {' and '.join(given)}; keep one", given[1])
        return self

    def distribution(self, size: int, folder: Path, nominal: list[float] | None = None) -> Distribution:
        """Return the distribution for a key that stands for `size` numbers.

        Parameters
        ----------
        size : how many numbers the key stands for, from 1.
        folder : that of the problem file, where a table's file is looked for.
        nominal : what the file itself says the numbers are; a rotation by a normal angle starts there.

        Raises
        ------
        MisfitError
            Where the distribution makes another number of values, or its file cannot be read.
        """
        kind = self._given()[0]
        made = self._made(kind, size, folder, nominal)
        if made.values != size:
            once = "; of a symmetric matrix give mirror entries once" if _mirrors(made.values, size) else ""
            raise MisfitError(f"gives {made.values} numbers; the key {self.key!r} stands for {size}{once}", kind)
        return made

    def _made(self, kind: str, size: int, folder: Path, nominal: list[float] | None) -> Distribution:
        if self.normal is not None:
            return Normal(self.normal.mean, self.normal.deviation, self.normal.truncate, size)
        if self.uniform is not None:
            return Uniform(self.uniform[0], self.uniform[1], size)
        if self.log_uniform is not None:
            return LogUniform(self.log_uniform[0], self.log_uniform[1], size)
        if self.choice is not None:
            rows = self.choice.rows()
            return Choice(tuple(map(tuple, rows)), tuple(self.choice.weights), size if len(rows[0]) == 1 else 1)
        if self.direction is not None:
            told = self.direction
            x, y, z = told.about
            return Direction(told.length, told.length_to, (x, y, z), told.within_rad)
        try:
            if self.rotation is not None:
                fits = nominal is not None and len(nominal) == size
                return self.rotation.rotation(nominal if fits and self.rotation.deviation_rad is not None else None)
            if self.table is not None:
                return self.table.rows(folder)
        except MisfitError as error:
            raise MisfitError(str(error), kind, *error.path) from None
        assert self.correlated is not None
        return self.correlated.block()

    def _given(self) -> list[str]:
        return [kind for kind in _KINDS if getattr(self, kind) is not None]


def _mirrors(values: int, size: int) -> bool:
    """Return whether so many values are all entries of a matrix whose upper triangle has `size`."""
    rows = math.isqrt(values)
    return rows > 1 and rows**2 == values and rows * (rows + 1) // 2 == size


#: The keys of a dispersion that are distributions.
_KINDS = tuple(name for name in DispersionTable.model_fields if name != "key")
