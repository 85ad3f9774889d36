"""What a tuning makes small: a sum of terms, each a number of a flight with its unit.

=====================  ==========================================================  ==================
term                   value                                                       unit
=====================  ==========================================================  ==================
integral(SIGNAL)       time integral of the 2-norm of a recorded signal            the signal's, s
KIND(SIGNAL)           a metric made for the cost: peak, least, final, mean        the signal's
settling(SIGNAL, X)    time after which the largest magnitude stays below X; also  s
                       reaching(SIGNAL, X)
NAME                   a metric of the mission                                     the metric's
requirement(ID)        the robustness of a requirement, turned: less is better     of what it bounds
=====================  ==========================================================  ==================

A term may have a weight, `0.1 integral(achieved)`. Each is divided by its magnitude at the first gains without
dispersion, so that terms of different units can be added and a weight is a share.

A settling or reaching that never comes counts as the duration of the flight, times how often the last magnitude exceeds
the threshold: it goes on falling as a flight comes nearer to settling.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from casadi_gnc.errors import TuningError
from casadi_gnc.missions import metrics
from casadi_gnc.missions.loop import Loop
from casadi_gnc.missions.recording import row_of
from casadi_gnc.missions.scheme import Metric
from casadi_gnc.signals import Layout
from casadi_gnc.tables.complaints import near_key

if TYPE_CHECKING:
    from casadi_gnc.campaigns.store import Columns
    from casadi_gnc.missions.mission import Mission
    from casadi_gnc.missions.scheme import MetricKind

_TERM = re.compile(
    r"\s*(?:(?P<weight>\d+\.?\d*(?:[eE][+-]?\d+)?)\s*\*?\s*)?(?P<name>[A-Za-z_]\w*)"
    r"\s*(?:\(\s*(?P<inner>[\w.-]+)\s*(?:,\s*(?P<threshold>[^)]*?))?\s*\))?\s*"
)
_TIMED: tuple[MetricKind, ...] = ("settling", "reaching")
_OTHER: tuple[MetricKind, ...] = ("peak", "least", "final", "mean")
#: Metrics that are made for terms have names that begin so.
_OWN = "tuned_"


@dataclass(frozen=True)
class Term:
    """Hold one term of a cost.

    Parameters
    ----------
    text : as it was written, without weight.
    weight : its share.
    unit : of its value.
    column : of a campaign's table, `metric.NAME` or `requirement.ID`.
    factor : from that column to the value: the duration for an integral, -1 for a robustness.
    metric : that of the column, None for a requirement.
    last : column with the last magnitude, for a settling or reaching.
    """

    text: str
    weight: float
    unit: str
    column: str
    factor: float = 1.0
    metric: Metric | None = None
    last: str = ""


@dataclass(frozen=True)
class Cost:
    """Hold the terms of a cost, and how long a flight is [s]."""

    terms: tuple[Term, ...]
    duration: float

    @property
    def text(self) -> str:
        """The cost as a user writes it."""
        return " + ".join(f"{one.weight:g} {one.text}" if one.weight != 1.0 else one.text for one in self.terms)

    def values(self, table: Columns) -> np.ndarray:
        """Return the value of each term in its unit, (n, T), infinite for a flight that has none."""
        return np.column_stack([self._value(one, table) for one in self.terms])

    def _value(self, term: Term, table: Columns) -> np.ndarray:
        value = term.factor * np.asarray(table[term.column], dtype=float)
        if term.last:
            assert term.metric is not None
            beyond = np.maximum(1.0, np.asarray(table[term.last], dtype=float) / term.metric.threshold)
            value = np.where(np.isnan(value), self.duration * beyond, value)
        return np.where(np.isnan(value), math.inf, value)

    def scales(self, first: np.ndarray) -> np.ndarray:
        """Return by what each term is divided, (T,), from the values at the first gains, (T,).

        Raises
        ------
        TuningError
            Where a flight with these gains has no such value.
        """
        for one, value in zip(self.terms, first, strict=True):
            if not math.isfinite(value):
                raise TuningError(
                    f"the cost has no value at the first gains: {one.text} is that of a flight that diverges; begin "
                    "with gains that fly"
                )
        return np.where(first == 0.0, 1.0, np.abs(first))

    def total(self, values: np.ndarray, scales: np.ndarray) -> np.ndarray:
        """Return the cost, (n,), of values of the terms, (n, T)."""
        weights = np.array([one.weight for one in self.terms])
        return (values / scales) @ weights


def cost_of(text: str | None, mission: Mission, scheme: str) -> tuple[Cost, Mission]:
    """Return a cost, and the mission with the metrics that it takes.

    Parameters
    ----------
    text : terms joined by +; None for the integrals of what the craft regulates, rates only where there is nothing
        else, and a tenth of that of the effort.
    mission, scheme : what flies.

    Raises
    ------
    TuningError
        For a text that is no cost, a signal, metric or requirement that is not there; one sentence.
    """
    row = row_of(Loop(mission, mission.scheme(scheme)))
    duration = (mission.timing.samples - 1) * mission.timing.sample_period
    parts = _default(mission, row) if text is None else text.split("+")
    made = [_term(part, text or "", mission, row, duration) for part in parts]
    terms, own = tuple(term for term, _ in made), [metric for _, metrics in made for metric in metrics]
    own = list({metric.name: metric for metric in own}.values())
    wider = replace(mission, metrics=(*mission.metrics, *own)) if own else mission
    known = {metric.name: metric for metric in wider.metrics}
    full = tuple(
        one if one.metric is None else replace(one, metric=known[one.metric.name], unit=_unit(one, known))
        for one in terms
    )
    return Cost(full, duration), wider.read_from(mission.origin)


def _unit(term: Term, known: dict[str, Metric]) -> str:
    """Return the unit of a term's value; the metrics of a mission know theirs."""
    assert term.metric is not None
    own = known[term.metric.name].unit
    if not term.text.startswith("integral("):
        return own
    return own.removesuffix("/s") if own.endswith("/s") else "s" if own in ("", "-") else f"{own} s"


def _default(mission: Mission, row: Layout) -> list[str]:
    """Return the terms of the cost that is meant where none is given."""
    regulated = [name for name, goal in mission.target.items() if name in row and not any(goal)]
    if not regulated:
        raise TuningError(
            "the craft regulates no signal to zero, so there is no cost to take by itself; name one, such as "
            f"--cost 'integral(SIGNAL)'; recorded are {', '.join(row.names[1:-1])}"
        )
    errors = [name for name in regulated if not row.signal(name).unit.endswith("/s")] or regulated
    efforts = [name for name in row.names if name == "achieved" or name.startswith("achieved_")]
    return [*(f"integral({name})" for name in errors), *(f"0.1 integral({name})" for name in efforts)]


def _term(part: str, text: str, mission: Mission, row: Layout, duration: float) -> tuple[Term, Sequence[Metric]]:
    found = _TERM.fullmatch(part)
    if found is None:
        raise TuningError(
            f"the cost {text!r} has the term {part.strip()!r}; expected such as integral(rate), 0.1 integral(wanted), "
            "settling(rate, 1e-3), the name of a metric, or requirement(ID), joined by +"
        )
    weight = float(found["weight"] or 1.0)
    name, inner = found["name"], found["inner"]
    if inner is None:
        return _of_metric(name, weight, mission)
    if name == "requirement":
        ids = [one.id for one in mission.requirements]
        if inner not in ids:
            raise TuningError(f"the mission has no requirement {inner!r}; there is {', '.join(ids) or 'none'}")
        return Term(f"requirement({inner})", weight, "", f"requirement.{inner}", -1.0), ()
    if inner not in row:
        raise TuningError(f"no signal {inner!r} is recorded{near_key(inner, list(row.names))}")
    if name == "integral":
        metric = Metric(f"{_OWN}integral_{inner}", "mean", inner, norm="two")
        return Term(f"integral({inner})", weight, "", f"metric.{metric.name}", duration, metric), (metric,)
    return _made(name, inner, found["threshold"], weight)


def _of_metric(name: str, weight: float, mission: Mission) -> tuple[Term, Sequence[Metric]]:
    metric = next((one for one in mission.metrics if one.name == name), None)
    if metric is None:
        known = ", ".join(one.name for one in mission.metrics) or "none"
        raise TuningError(f"the mission has no metric {name!r}; there is {known}")
    return _with_last(Term(name, weight, "", f"metric.{name}", metric=metric), metric, ())


def _made(kind: str, signal: str, threshold: str | None, weight: float) -> tuple[Term, Sequence[Metric]]:
    """Return a term whose metric is made for it."""
    chosen: MetricKind | None = next((one for one in (*_TIMED, *_OTHER) if one == kind), None)
    if chosen is None:
        known = ", ".join(("integral", *_OTHER, *_TIMED, "requirement"))
        raise TuningError(f"a cost knows no {kind}(...); there is {known}")
    if chosen in _OTHER:
        if threshold is not None:
            raise TuningError(f"{kind}({signal}, {threshold}) has a threshold; only {' and '.join(_TIMED)} take one")
        metric = Metric(f"{_OWN}{kind}_{signal}", chosen, signal)
        return Term(f"{kind}({signal})", weight, "", f"metric.{metric.name}", metric=metric), (metric,)
    try:
        below = float(threshold or "nan")
    except ValueError:
        below = math.nan
    if not below > 0:
        raise TuningError(f"{kind}({signal}) has the threshold {threshold or ''!r}, expected a number above 0")
    metric = Metric(f"{_OWN}{kind}_{signal}", chosen, signal, below)
    term = Term(f"{kind}({signal}, {below:g})", weight, "", f"metric.{metric.name}", metric=metric)
    return _with_last(term, metric, (metric,))


def _with_last(term: Term, metric: Metric, own: tuple[Metric, ...]) -> tuple[Term, Sequence[Metric]]:
    """Return a term with a metric of the last magnitude where its own may never come."""
    if metric.kind not in _TIMED:
        return term, own
    whole = not metric.after and metric.until == math.inf
    name = f"last_{metric.signal}_{metric.norm}" if whole else f"last_of_{metric.name}"
    last = Metric(_OWN + name, "final", metric.signal, after=metric.after, until=metric.until, norm=metric.norm)
    return replace(term, last=f"metric.{last.name}"), (*own, last)


def from_record(term: Term, time: np.ndarray, signal: np.ndarray, duration: float) -> float:
    """Return the value of a term of a metric from a record of all samples, by NumPy; NaN where it never comes.

    Parameters
    ----------
    time : (K,), [s]. signal : (K,) or (K, n), that of the metric. duration : of the flight, [s].
    """
    metric = term.metric
    assert metric is not None
    rows = signal.reshape(len(time), -1)
    sizes = np.linalg.norm(rows, axis=1) if metric.norm == "two" else np.abs(rows).max(axis=1)
    inside = sizes[(time >= metric.after) & (time <= metric.until)]
    times = time[(time >= metric.after) & (time <= metric.until)]
    below = np.flatnonzero(inside < metric.threshold)
    found = {
        "settling": lambda: metrics.settled(times, inside, metric.threshold),
        "reaching": lambda: float(times[below[0]]) if len(below) else None,
        "peak": inside.max,
        "least": inside.min,
        "final": lambda: inside[-1],
        "mean": inside.mean,
        "sample_sum": inside.sum,
    }[metric.kind]()
    if found is None:
        return duration * max(1.0, float(inside[-1]) / metric.threshold)
    if metric.kind in _TIMED:
        found -= metric.after
    return term.factor * float(found)
