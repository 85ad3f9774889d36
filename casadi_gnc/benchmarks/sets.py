"""Files of kind "benchmark": families of samples, as data.

An allocation family is one of

* recorded: `problem` (an allocation file) and `commands` (a CSV beside the set, see `outside`);
* random: actuators on a rigid body from a seed, see `families`;
* from outside: `commands` alone, a `.mat` or CSV file that brings its own matrices.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from casadi_gnc.errors import BenchmarkError
from casadi_gnc.problem_files.document import read_kind, shipped
from casadi_gnc.problem_files.mission_tables import Format
from casadi_gnc.tables.part import NonNegative, Part, Positive

FamilyName = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,40}$", description="small letters, digits and _")]


class Random(Part):
    """Thrusters or wheels of a made-up craft, and commands that they can about make."""

    seed: Annotated[int, Field(ge=0)]
    actuators: Annotated[int, Field(ge=1, le=32)]
    rows: Literal[3, 6] = 3
    samples: Annotated[int, Field(ge=1, le=10_000)] = 40
    centre_error_m: NonNegative = Field(default=0.0, description="half width of the box of mass-centre errors")
    both_ways: bool = Field(default=False, description="actuators that push and pull")
    reach: Positive = Field(default=0.5, description="size of the commands, as a share of what can be made")


class AllocationFamily(Part):
    """Samples of one allocation problem."""

    name: FamilyName
    title: str
    problem: str | None = Field(default=None, description="an allocation file, shipped or beside the set")
    commands: str | None = Field(default=None, description="a table of commands beside the set")
    random: Random | None = None
    samples: Annotated[int, Field(ge=1)] | None = Field(default=None, description="only the first so many commands")
    certain: bool = Field(default=False, description="leave the problem's uncertainty out")

    @model_validator(mode="after")
    def _one_source(self) -> AllocationFamily:
        if (self.random is None) == (self.commands is None):
            raise ValueError("give either [family.random] or commands")
        if self.random is not None and self.problem is not None:
            raise ValueError("problem belongs to commands; leave it out of a random family")
        return self


class LmiFamily(Part):
    """Samples of matrix inequalities; see `lmi_families` for the kinds."""

    name: FamilyName
    title: str
    kind: Literal["feasible", "infeasible", "bounded_real", "regulator"]
    seed: Annotated[int, Field(ge=0)] = 0
    samples: Annotated[int, Field(ge=1, le=1000)] = 8
    size: Annotated[int, Field(ge=1, le=12)] = 3


class BenchmarkModel(Part):
    """A set of families."""

    format: Format
    kind: Literal["benchmark"]
    title: str
    source: str = ""
    contest: Literal["allocation", "synthesis"]
    family: list[AllocationFamily] = []
    lmi_family: list[LmiFamily] = []

    @model_validator(mode="after")
    def _some_families(self) -> BenchmarkModel:
        own, other = ("family", "lmi_family") if self.contest == "allocation" else ("lmi_family", "family")
        if getattr(self, other):
            raise ValueError(f"[[{other}]] is not for the contest {self.contest!r}")
        names = [one.name for one in getattr(self, own)]
        if not names:
            raise ValueError(f"the set is empty; give at least one [[{own}]]")
        if len(set(names)) < len(names):
            raise ValueError("two families have the same name")
        return self


def load_set(name: str | Path, contest: str) -> tuple[str, BenchmarkModel, Path]:
    """Return name, content and folder of a set, given by path or shipped name ("benchmarks/..." or short).

    Raises
    ------
    ProblemError, BenchmarkError
        For a file that is none, or a set of another contest.
    """
    short = f"benchmarks/{name}"
    document = read_kind(short if short in shipped() else name, "benchmark")
    model: BenchmarkModel = document.validated(BenchmarkModel)
    if model.contest != contest:
        raise BenchmarkError(f"{document.path.name} is a set for `bench {model.contest}`, not for `bench {contest}`")
    return document.path.stem, model, document.folder
