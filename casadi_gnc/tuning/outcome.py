"""What a tuning came to: gains, cost, metrics, requirements and checks, before beside after."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from casadi_gnc.tuning.conditions import verdicts_of
from casadi_gnc.tuning.gain_flights import Case, Flights

if TYPE_CHECKING:
    from casadi_gnc.checks import Verdict
    from casadi_gnc.missions.mission import Mission


@dataclass(frozen=True)
class Moved:
    """Hold one number before and after, NaN where there is none.

    Parameters
    ----------
    name, unit : of it.
    before, after : at nominal.
    worst_before, worst_after : of all cases; those of the nominal case where there is no other.
    """

    name: str
    unit: str
    before: float
    after: float
    worst_before: float
    worst_after: float


@dataclass(frozen=True, eq=False)
class Tuned:
    """Hold what a tuning came to.

    Parameters
    ----------
    mission, title, scheme, against, cost : what was tuned, for what.
    gains : each free one, by its name below the law, before and after; `worst_...` are its bounds.
    keys : of the gains, whole paths in a problem file.
    cost_before, cost_after : the largest cost of all cases, or of a campaign their mean; of both over the same cases.
    terms : of the cost, each in its unit. metrics : of the mission.
    requirements : robustness of each, below 0 by how much it is not met.
    course : cost after each iteration, and how it was reached.
    cases : those that were flown, the nominal one first unless they are a campaign's.
    checks_before, checks_after : gravest verdict of each check.
    flights : that were flown.
    disagreement : largest relative difference between the cost as it was promised and that of flights from the file
        that was written, by other code; NaN where no file was written.
    file : that was written, "" if none.
    """

    mission: str
    title: str
    scheme: str
    against: str
    cost: str
    gains: tuple[Moved, ...]
    keys: tuple[str, ...]
    cost_before: float
    cost_after: float
    terms: tuple[Moved, ...]
    metrics: tuple[Moved, ...]
    requirements: tuple[Moved, ...]
    course: tuple[tuple[float, str], ...]
    cases: tuple[Case, ...]
    checks_before: dict[str, Verdict]
    checks_after: dict[str, Verdict]
    flights: int
    disagreement: float = math.nan
    file: str = ""

    @property
    def values(self) -> dict[str, float]:
        """The gains that were found, by whole path."""
        return dict(zip(self.keys, (one.after for one in self.gains), strict=True))

    @property
    def ratio(self) -> float:
        """How many times smaller the cost is."""
        return self.cost_before / self.cost_after if self.cost_after > 0 else math.nan

    @property
    def iterations(self) -> int:
        """Iterations that changed the gains."""
        return sum(how in ("spread", "slope", "evolution", "sampling") for _, how in self.course)

    @property
    def searched(self) -> bool:
        """Whether it ended because nothing better was found nearby, or steps no longer lowered the cost."""
        return not self.course[-1][1].startswith("a worse") and self.settled

    @property
    def settled(self) -> bool:
        """Whether the last iterations changed the cost by less than they are meant to find."""
        last = [value for value, how in self.course if how != "a worse case"][-2:]
        return self.course[-1][1] == "nothing better nearby" or (
            len(last) == 2 and abs(last[0] - last[1]) < 1e-3 * abs(last[1])
        )

    @property
    def worse(self) -> tuple[Moved, ...]:
        """The requirements that moved the wrong way, at nominal or in the worst case."""
        return tuple(one for one in self.requirements if one.after < one.before or one.worst_after < one.worst_before)

    def sentence(self) -> str:
        """Return what was found, on one line."""
        where = {"nominal": "", "worst": "worst ", "campaign": "mean "}[self.against]
        if self.cost_after >= self.cost_before:
            return f"no better gains were found: the {where}cost stays {self.cost_before:.4g}"
        times = f", {self.ratio:.3g} times smaller," if self.ratio > 0 else ""
        return (
            f"the {where}cost went from {self.cost_before:.4g} to {self.cost_after:.4g}{times} in {self.iterations} "
            f"iterations and {self.flights} flights"
        )

    def data(self) -> dict[str, Any]:
        """Return it as plain data; numbers that are not finite are None."""

        def plain(value: Any) -> Any:
            return None if isinstance(value, float) and not math.isfinite(value) else value

        def rows(many: Sequence[Moved]) -> list[dict[str, Any]]:
            return [{key: plain(value) for key, value in vars(one).items()} for one in many]

        gains = [
            {"name": g.name, "key": key, "unit": g.unit, "before": g.before, "after": g.after, "low": g.worst_before,
             "high": g.worst_after}
            for g, key in zip(self.gains, self.keys, strict=True)
        ]  # fmt: skip
        return {
            "problem": self.mission, "scheme": self.scheme, "against": self.against, "cost": self.cost,
            "cost_before": plain(self.cost_before), "cost_after": plain(self.cost_after), "gains": gains,
            "terms": rows(self.terms), "metrics": rows(self.metrics), "requirements": rows(self.requirements),
            "worse": [one.name for one in self.worse],
            "course": [[plain(value), how] for value, how in self.course], "flights": self.flights,
            "checks_before": self.checks_before, "checks_after": self.checks_after,
            "disagreement": plain(self.disagreement), "file": self.file,
        }  # fmt: skip


def outcome(
    mission: Mission, scheme: str, flights: Flights, cases: Sequence[Case], values: np.ndarray, against: str,
    course: Sequence[tuple[float, str]], before: dict[str, Verdict],
) -> Tuned:  # fmt: skip
    """Return what gains, (P,), came to beside those of the mission: both are flown once more in all cases."""
    gains, cost = flights.gains, flights.cost
    start = np.array([one.value for one in gains.each])
    every = cases if cases[0] is flights.nominal else [flights.nominal, *cases]
    table = flights.table(np.vstack([start, values]), every)
    terms = cost.values(table).reshape(2, len(every), -1)
    totals = cost.total(terms, flights.scales)[:, -len(cases) :]
    merits = totals.mean(axis=1) if against == "campaign" else totals.max(axis=1)

    def moved(name: str, unit: str, column: np.ndarray, *, least: bool = False) -> Moved:
        rows = np.asarray(column, dtype=float).reshape(2, len(every))
        worst = rows.min(axis=1) if least else rows.max(axis=1)
        return Moved(name, unit, *map(float, (rows[0, 0], rows[1, 0], *worst)))

    chosen = flights.objective.cases.varied.at(np.concatenate([values, flights.nominal.values]))
    return Tuned(
        mission=mission.name,
        title=mission.title,
        scheme=scheme,
        against=against,
        cost=cost.text,
        gains=tuple(
            Moved(g.name, g.unit, g.value, float(v), g.low, g.high) for g, v in zip(gains.each, values, strict=True)
        ),
        keys=tuple(g.key for g in gains.each),
        cost_before=float(merits[0]),
        cost_after=float(merits[1]),
        terms=tuple(moved(one.text, one.unit, terms[:, :, i]) for i, one in enumerate(cost.terms)),
        metrics=tuple(
            moved(one.name, one.unit, table[f"metric.{one.name}"], least=one.kind == "least") for one in mission.metrics
        ),
        requirements=tuple(
            moved(one.id, "", table[f"requirement.{one.id}"], least=True) for one in mission.requirements
        ),
        course=tuple(course),
        cases=tuple(every),
        checks_before=before,
        checks_after=verdicts_of(chosen, scheme),
        flights=flights.count,
    )
