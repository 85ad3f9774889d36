"""Compare a printed number with ours."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from typing import Any

from casadi_gnc.fidelity.claims import ClaimModel


class Verdict(Enum):
    """What became of a claim; the values are the words that a reader sees."""

    REPRODUCED = "reproduced"
    UNDER_ASSUMPTION = "reproduced under assumption"
    NOT_REPRODUCED = "not reproduced"
    IMPOSSIBLE = "impossible"
    FAILED = "failed"


@dataclass(frozen=True)
class Answer:
    """Hold a claim, our number and what follows.

    Parameters
    ----------
    claim : what is printed.
    ours : our number; None where there is none (a signal that never settles).
    bound : number that no implementation can pass, if the claim has one.
    failure : sentence of the error where nothing could be computed.
    """

    claim: ClaimModel
    ours: float | None
    bound: float | None = None
    failure: str = ""

    @property
    def deviation(self) -> float | None:
        """(ours - printed) / printed, or the difference where zero is printed; None without a number."""
        if self.ours is None or not math.isfinite(self.ours):
            return None
        difference = self.ours - self.claim.printed
        return difference / abs(self.claim.printed) if self.claim.printed else difference

    @property
    def agrees(self) -> bool:
        """Whether our number is the printed one within the tolerance, or keeps the printed bound."""
        claim = self.claim
        if self.ours is None or math.isnan(self.ours):
            return False
        room = max(claim.tolerance * abs(claim.printed), claim.tolerance_absolute)
        if claim.relation == "at_most":
            return self.ours <= claim.printed + room
        if claim.relation == "at_least":
            return self.ours >= claim.printed - room
        return abs(self.ours - claim.printed) <= room

    @property
    def verdict(self) -> Verdict:
        """The verdict, from the numbers alone."""
        if self.failure:
            return Verdict.FAILED
        if self.agrees:
            return Verdict.UNDER_ASSUMPTION if self.claim.assumption else Verdict.REPRODUCED
        if self.bound is not None and self._passes(self.bound):
            return Verdict.IMPOSSIBLE
        return Verdict.NOT_REPRODUCED

    def _passes(self, bound: float) -> bool:
        """Return whether the printed number, with its tolerance, lies beyond what is possible."""
        claim = self.claim
        beyond = bound - claim.printed if claim.bound_is == "lowest" else claim.printed - bound
        return beyond > max(claim.tolerance * abs(claim.printed), claim.tolerance_absolute)

    def as_data(self) -> dict[str, Any]:
        """Return the row as plain data, ready for JSON."""
        claim = self.claim
        return {
            "id": claim.id,
            "text": claim.text,
            "where": claim.where,
            "printed": claim.printed,
            "relation": claim.relation,
            "unit": claim.unit,
            "ours": self.ours if self.ours is None or math.isfinite(self.ours) else str(self.ours),
            "bound": self.bound,
            "deviation": self.deviation,
            "assumption": claim.assumption,
            "verdict": self.verdict.value,
            "failure": self.failure,
        }
