"""One finding before a flight: a number, its limit, what follows from it and what to do.

Only a condition that is *necessary*, or a linear or simulated fact, may fail. A condition that is
merely sufficient (most conditions of theorems) and does not hold is a note: the theorem promises
nothing, the flight may still be good.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

Verdict = Literal["ok", "note", "warn", "fail"]
#: From harmless to grave.
VERDICTS: tuple[Verdict, ...] = ("ok", "note", "warn", "fail")


@dataclass(frozen=True)
class Check:
    """Compare a value with its limit.

    Parameters
    ----------
    name : family and subject, "sampling.closed_loop".
    value, limit : what was computed and what it may be at most (or, with `at_least`, at least).
    unit : of both.
    otherwise : verdict if the limit is not kept, or if the value is no number.
    consequence, remedy : one sentence each: what happens then, what to do.
    source : equation, paper or method the limit comes from.
    at_least : whether the value must be at least the limit, instead of at most.
    strict : whether the limit itself is no longer good.
    scheme : name of the scheme it is about, "" if about all.
    """

    name: str
    value: float
    limit: float
    unit: str
    otherwise: Verdict
    consequence: str
    remedy: str
    source: str = ""
    at_least: bool = False
    scheme: str = ""
    strict: bool = False

    @property
    def margin(self) -> float:
        """What is left to the limit, in the value's unit; negative if it is not kept."""
        return self.value - self.limit if self.at_least else self.limit - self.value

    @property
    def holds(self) -> bool:
        """Whether the limit is kept; a value that is no number keeps none."""
        return not math.isnan(self.value) and (self.margin > 0 if self.strict else self.margin >= 0)

    @property
    def verdict(self) -> Verdict:
        """The word `ok`, or that of `otherwise`."""
        return "ok" if self.holds else self.otherwise

    def of(self, scheme: str) -> Check:
        """Return the check with the scheme's name."""
        return replace(self, scheme=scheme)


def sufficient(name: str, value: float, limit: float, unit: str, source: str) -> Check:
    """Return a condition that a theorem asks for, value >= limit: sufficient, so at worst a note."""
    return Check(
        name,
        value,
        limit,
        unit,
        "note",
        "The theorem promises nothing for these gains.",
        "Change the gains if the promise is needed; the other checks and flights decide whether they work.",
        source,
        at_least=True,
    )


def worst(checks: list[Check]) -> Verdict:
    """Return the gravest verdict of several checks."""
    return VERDICTS[max((VERDICTS.index(check.verdict) for check in checks), default=0)]
