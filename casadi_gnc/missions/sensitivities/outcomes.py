"""One number of a flight from what is asked of its samples, and how much each sample counts in it.

An outcome names quantities of a row of the record. From their values at every sample it says the number, the same that
the flight tells, and the derivatives of the number by these values; at a temperature above 0, those of a smooth
companion, and how far it may be from the number itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import casadi as ca
import numpy as np

from casadi_gnc.errors import FlightError
from casadi_gnc.mathematics.soft import slack, soft_maximum, soft_minimum
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.requirements import Requirement
from casadi_gnc.missions.requirements.requirement import unbounded
from casadi_gnc.missions.scheme import Metric
from casadi_gnc.missions.sensitivities.robustness import weighed_robustness
from casadi_gnc.signals import Layout


@dataclass(frozen=True, eq=False)
class Weighed:
    """Hold a number, its derivatives by what was asked, (K, Q), and how far it may be from the exact number."""

    value: float
    weights: np.ndarray
    slack: float = 0.0


class Outcome(Protocol):
    """Say one number of a flight."""

    @property
    def quantities(self) -> ca.Function:
        """Row of the record -> what is asked of every sample, (Q,)."""
        ...

    #: What the number is of a flight that diverged.
    diverged: float

    def weigh(self, asked: np.ndarray, temperature: float) -> Weighed:
        """Return the number from what was asked of every sample, (K, Q)."""
        ...


def outcome_of(mission: Mission, layout: Layout, of: str | Requirement) -> Outcome:
    """Return the outcome of a metric by name, or of a requirement or its id.

    Raises
    ------
    FlightError, RequirementError
        For a name that the mission does not have, and a requirement that does not fit its signals.
    """
    known = {one.id: one for one in mission.requirements}
    metrics = {metric.name: metric for metric in mission.metrics}
    period = mission.timing.sample_period
    requirement = of if isinstance(of, Requirement) else known.get(of)
    if requirement is not None and requirement.formula:
        return _OfFormula(requirement, layout, period)
    name = of if requirement is None else requirement.metric
    if name not in metrics:
        raise FlightError(
            f"{mission.name} has no metric and no requirement {name!r}; there is "
            f"{', '.join([*metrics, *known]) or 'none of them'}"
        )
    metric = _OfMetric(metrics[str(name)], layout, period)
    return metric if requirement is None else _OfBound(requirement, metric)


class _OfMetric:
    diverged = math.nan

    def __init__(self, metric: Metric, layout: Layout, period: float) -> None:
        self._metric, self._period = metric, period
        row = layout.symbol("row")
        self.quantities = ca.Function("quantities", [row], [row[layout.place(metric.signal)]])

    def weigh(self, asked: np.ndarray, temperature: float) -> Weighed:
        """Return the metric, as `casadi_gnc.missions.metrics` defines it; `Outcome.weigh`.

        Times of settling and reaching are those of samples, which do not move a little: their companion is where the
        straight line between two samples crosses the threshold, within a sample period.
        """
        metric, count = self._metric, len(asked)
        time = np.arange(count) * self._period
        inside = np.flatnonzero((time >= metric.after) & (time <= metric.until))
        crossing = metric.kind in ("settling", "reaching")
        sizes, slopes, bound = self._sizes(asked, 0.0 if crossing else temperature)
        if crossing:
            value, counts = self._crossing(sizes, inside, temperature)
            return Weighed(value, counts[:, None] * slopes, self._period if temperature > 0 else 0.0)
        counts = np.zeros(count)
        if not len(inside):
            return Weighed(math.nan, 0 * slopes)
        within = sizes[inside]
        if metric.kind in ("peak", "least"):
            best = soft_maximum if metric.kind == "peak" else soft_minimum
            value, counts[inside] = best(within, temperature)
            bound += slack(len(inside), temperature)
        elif metric.kind == "final":
            value, counts[inside[-1]] = within[-1], 1.0
        else:
            share = 1.0 / len(inside) if metric.kind == "mean" else 1.0
            value, counts[inside] = float(within.sum()) * share, share
            bound *= 1 if metric.kind == "mean" else len(inside)
        return Weighed(float(value), counts[:, None] * slopes, bound)

    def _sizes(self, asked: np.ndarray, temperature: float) -> tuple[np.ndarray, np.ndarray, float]:
        """Return the norm at every sample, (K,), its derivatives, (K, Q), and the bound of its error."""
        if self._metric.norm == "two":
            sizes = np.sqrt((asked * asked).sum(axis=1))
            return sizes, np.divide(asked, sizes[:, None], out=np.zeros_like(asked), where=sizes[:, None] > 0), 0.0
        both, n = np.hstack([asked, -asked]), asked.shape[1]
        at = np.argmax(both, axis=1)
        largest = both[range(len(both)), at]
        if not temperature > 0:
            taken = np.arange(2 * n) == at[:, None]
            return largest, taken[:, :n].astype(float) - taken[:, n:], 0.0
        with np.errstate(under="ignore"):
            shares = np.exp((both - largest[:, None]) / temperature)
        total = shares.sum(axis=1)
        slopes = (shares[:, :n] - shares[:, n:]) / total[:, None]
        return largest + temperature * np.log(total), slopes, slack(2 * n, temperature)

    def _crossing(self, sizes: np.ndarray, inside: np.ndarray, temperature: float) -> tuple[float, np.ndarray]:
        """Return when the norm crosses the threshold for good, or for the first time, and its derivatives."""
        counts, threshold = np.zeros(len(sizes)), self._metric.threshold
        is_below = sizes[inside] < threshold
        if not is_below.any():
            return math.nan, counts
        start, after = int(inside[0]), int(inside[np.argmax(is_below)])
        if self._metric.kind == "settling":
            above = inside[~is_below]
            after = int(above[-1]) + 1 if len(above) else start
            if after >= inside[-1]:
                return math.nan, counts
        before, begin = after - 1, self._metric.after
        if not temperature > 0 or before < start or sizes[before] < threshold:
            return after * self._period - begin, counts
        fall = sizes[before] - sizes[after]
        share = (sizes[before] - threshold) / fall
        counts[before], counts[after] = self._period * (1 - share) / fall, self._period * share / fall
        return (before + share) * self._period - begin, counts


class _OfBound:
    diverged = -math.inf

    def __init__(self, requirement: Requirement, metric: _OfMetric) -> None:
        self._requirement, self._metric = requirement, metric
        self.quantities = metric.quantities

    def weigh(self, asked: np.ndarray, temperature: float) -> Weighed:
        """Return the margin of the metric to its bound; `Outcome.weigh`."""
        metric, asks = self._metric.weigh(asked, temperature), self._requirement
        if math.isnan(metric.value):
            return Weighed(-math.inf, metric.weights)
        sides = [(asks.at_most - metric.value, -1.0)] if asks.at_most is not None else []
        sides += [(metric.value - asks.at_least, 1.0)] if asks.at_least is not None else []
        value, shares = soft_minimum(np.array([margin for margin, _ in sides]), temperature)
        slope = float(sum(share * sign for share, (_, sign) in zip(shares, sides, strict=True)))
        return Weighed(value, slope * metric.weights, metric.slack + slack(len(sides), temperature))


class _OfFormula:
    diverged = -math.inf

    def __init__(self, requirement: Requirement, layout: Layout, period: float) -> None:
        row = layout.symbol("row")
        bound = requirement.bind(layout, row, period)
        self._tree = bound.tree
        self.quantities = ca.Function("quantities", [row], [ca.densify(ca.vertcat(*bound.margins))])

    def weigh(self, asked: np.ndarray, temperature: float) -> Weighed:
        """Return the robustness of the formula; `Outcome.weigh`."""
        value, counts, bound = weighed_robustness(self._tree, np.ascontiguousarray(asked.T), temperature)
        return Weighed(unbounded(value), np.ascontiguousarray(counts.T), bound)
