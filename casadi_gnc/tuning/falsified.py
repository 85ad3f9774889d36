"""What a search for a break came to: the break, or the margin that is left with how hard was tried."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from casadi_gnc.missions.requirements import Requirement
from casadi_gnc.tuning.broken_case import Break, Moved
from casadi_gnc.tuning.certificate import Certificate
from casadi_gnc.tuning.descending import Effort
from casadi_gnc.tuning.flights import Step
from casadi_gnc.tuning.reach import Reach


@dataclass(frozen=True, eq=False)
class Falsified:
    """Tell what a search for a break came to.

    Parameters
    ----------
    mission, scheme, requirement, unit : what was flown and asked, and the unit of the robustness.
    nominal : robustness of the mission as it is.
    reach : where was searched.
    broken : the smallest break found, None for none.
    minimal : a break with as few dispersions as were found to do.
    proved : what is proved of the linear loop, None where a break was found.
    path : where the search was, from the nominal to the smallest break.
    way : distance and robustness at eighths of the straight way to the smallest break; empty without.
    first : flights until the first break; None without.
    left, left_at, left_distance : the least robustness of all flights, what differs there, and how far away it is.
    flights, known : in all, and how many of them an earlier run had flown.
    effort : what was tried.
    notes : sentences on what could not be flown, or is special.
    """

    mission: str
    scheme: str
    requirement: Requirement
    unit: str
    nominal: float
    reach: Reach
    broken: Break | None
    minimal: Break | None
    proved: Certificate | None
    path: tuple[Step, ...]
    way: tuple[tuple[float, float], ...]
    first: int | None
    left: float
    left_at: tuple[Moved, ...]
    left_distance: float
    flights: int
    known: int
    effort: Effort
    notes: tuple[str, ...]

    @property
    def sentence(self) -> str:
        """What was found, or how hard was tried."""
        done, one = self.effort, self.requirement.id
        slopes = f"{done.derivatives} slopes by derivatives, {done.differences} by differences"
        tried = f"{self.flights} flights: a plan of {done.plan}, {done.descents} descents, {slopes}"
        tried += f", {done.sampled} times sampling where no slope led on" if done.sampled else ""
        if self.broken is not None:
            return (
                f"{one} breaks at {self.broken.distance:.3g} standard deviations: {self.broken.verdict.margin}, "
                f"nominal {self.nominal:+.4g}; first found after {self.first} flights, {self.flights} in all; {slopes}"
            )
        where = {"contour": "the density's contour", "box": "the box", "ellipsoid": "the ellipsoid"}[self.reach.kind]
        return (
            f"no break of {one} found within {where} of {self.reach.radius:g} standard deviations; {self.left:+.4g} "
            f"is left, nominal {self.nominal:+.4g}. That is effort, not proof: {tried}"
        )

    def as_data(self) -> dict[str, Any]:
        """Return all of it as data that JSON can hold; what is not finite becomes a word."""
        return {
            "mission": self.mission,
            "scheme": self.scheme,
            "requirement": {
                "id": self.requirement.id,
                "text": self.requirement.text,
                "asked": self.requirement.asked,
                "unit": self.unit,
            },
            "verdict": "no break found" if self.broken is None else "broken",
            "sentence": self.sentence,
            "nominal_robustness": _word(self.nominal),
            "set": {"kind": self.reach.kind, "radius": self.reach.radius},
            "broken": None if self.broken is None else self.broken.as_data(),
            "minimal": None if self.minimal is None else self.minimal.as_data(),
            "least": {
                "robustness": _word(self.left),
                "distance": self.left_distance,
                "moved": [{"key": each.key, "value": each.value, "nominal": each.nominal} for each in self.left_at],
            },
            "certificate": None if self.proved is None else self.proved.as_data(),
            "effort": {
                "flights": self.flights,
                "flights_at_first_break": self.first,
                "plan": self.effort.plan,
                "descents": self.effort.descents,
                "slopes_by_derivatives": self.effort.derivatives,
                "slopes_by_differences": self.effort.differences,
                "sampled_without_slope": self.effort.sampled,
            },
            "path": [
                {
                    "did": each.did,
                    "flights": each.flights,
                    "robustness": _word(each.robustness),
                    "distance": each.distance,
                }
                for each in self.path
            ],
            "way": [{"distance": distance, "robustness": _word(value)} for distance, value in self.way],
            "notes": list(self.notes),
        }


def _word(value: float) -> float | str:
    return value if math.isfinite(value) else str(value)
