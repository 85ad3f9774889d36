"""What is compared, and on what: contestants, families of samples, our judgement of every answer."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Literal, Protocol

import numpy as np

from casadi_gnc.errors import BenchmarkError, offer

Accuracy = Literal["low", "mid", "high"]


@dataclass(frozen=True)
class Judgement:
    """Hold what an answer is worth, from the data.

    Parameters
    ----------
    claimed : whether the contestant says that it has solved the sample.
    good : whether our residuals are below the accuracy asked for.
    violation, gap : the two residuals; what they are relative to is the contest's to say. Infinite
        where there is no answer.
    own_seconds : the time that the contestant itself reports; NaN if it reports none.
    missed : a measure that decides nothing, `MISSED` of the contest says which; NaN if there is none.
    iterations : its count.
    """

    claimed: bool
    good: bool
    violation: float
    gap: float
    own_seconds: float = float("nan")
    iterations: int = 0
    missed: float = float("nan")


@dataclass(frozen=True, eq=False)
class Family:
    """Hold samples of one kind; it must be picklable, since contestants live in other processes.

    Parameters
    ----------
    name : unique in a run.
    group : name of the set it belongs to; a ranking is over one group.
    title : one line for the reader.
    count : number of samples.
    data : what the contest makes its runners from.
    digest : of the data; results of other data are never mixed with these.
    """

    name: str
    group: str
    title: str
    count: int
    data: Any
    digest: str


class Runner(Protocol):
    """One contestant, set up for one family.

    A runner may also have `calls`, the number of calls that one `run` makes (1 if it has none): times
    are divided by it.
    """

    def run(self, k: int) -> Any:
        """Return what the contestant says of sample k; this is what is timed."""
        ...

    def judge(self, k: int, said: Any) -> Judgement:
        """Return what it is worth; not timed."""
        ...


class Contest(Protocol):
    """A module of this room, found by `contest`.

    A contest may also have `appendix(families)`, a text in Markdown that is made once a run and stands
    in the report; `MISSED`, what its judgements' `missed` is; and `objective_of(contestant)`, what one minimises in the
    place of what the others do.

    Attributes
    ----------
    NAME, TITLE : of the contest.
    RESIDUALS : what `violation` and `gap` of its judgements are, in words.
    LIMITATIONS : sentences for the report.
    SETS : names of the sets that are run if none is named.
    """

    NAME: str
    TITLE: str
    RESIDUALS: tuple[str, str]
    LIMITATIONS: tuple[str, ...]
    SETS: tuple[str, ...]

    def contestants(self, wanted: list[str] | None) -> list[str]:
        """Return those wanted, or all that can take part here; raise `BenchmarkError` for an unknown one."""
        ...

    def absent(self) -> list[str]:
        """Return a sentence for each that cannot take part here."""
        ...

    def families(self, problems: list[str], samples: int | None) -> list[Family]:
        """Return the families of some sets or files, with at most so many samples each."""
        ...

    def able(self, contestant: str, family: Family) -> bool:
        """Return whether a contestant solves such a family at all."""
        ...

    def runner(self, contestant: str, family: Family, accuracy: Accuracy) -> Runner:
        """Return a contestant freshly set up; the time that takes is the set-up's."""
        ...

    def versions(self, contestant: str) -> dict[str, str]:
        """Return the versions of the packages that a contestant is made of."""
        ...


CONTESTS = ("allocation", "synthesis", "step", "flight")


def contest(name: str) -> Any:
    """Return a contest by name, a module; raise `BenchmarkError` naming those there are."""
    if name not in CONTESTS:
        raise BenchmarkError(f"no benchmark {name!r}; {offer(name, CONTESTS)}")
    return import_module(f"{__package__}.{name}")


def digest(*parts: Any) -> str:
    """Return a short hash of arrays, numbers and texts; the same data give the same one."""
    found = hashlib.sha256()
    for part in parts:
        if isinstance(part, (str, bytes)):
            found.update(part.encode() if isinstance(part, str) else part)
        else:
            array = np.ascontiguousarray(part, dtype=float)
            found.update(repr(array.shape).encode() + array.tobytes())
        found.update(b"\0")
    return found.hexdigest()[:16]
