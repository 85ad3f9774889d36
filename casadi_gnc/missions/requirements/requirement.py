"""A requirement: a bound on a metric, or a formula over the signals of a flight, and the share of flights that meet it.

One table means the same wherever it is asked: robustness is the margin to the bound, or that of the formula; a flight
meets the requirement where it is at least 0. Of many flights, `share` must meet it, to be shown with `confidence`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from casadi_gnc.errors import RequirementError, offer
from casadi_gnc.missions.requirements import evaluating, syntax
from casadi_gnc.missions.requirements.normal import Bound, bind
from casadi_gnc.missions.requirements.parsing import parse
from casadi_gnc.missions.requirements.tokens import shortened
from casadi_gnc.missions.requirements.tree import BEYOND
from casadi_gnc.signals import Layout, Signal

if TYPE_CHECKING:
    from casadi_gnc.missions.flight import Flight

#: What an id may be: it stands in tables, in files' names and, its signs as _, in C.
ID = r"^[A-Za-z][A-Za-z0-9._-]{0,62}$"


@dataclass(frozen=True)
class Requirement:
    """Ask something of every flight.

    Parameters
    ----------
    id : of the requirement: letters, digits, ., _ and -, the first a letter.
    text : in words, for whoever reads the verdict.
    metric : name of a metric of the mission, with one or both of
    at_most, at_least : its bounds, in the metric's unit; or
    formula : a condition over signals and time (docs/requirements.md).
    share : of flights that must meet it, above 0 and up to 1.
    confidence : with which that share must be shown, between 0 and 1.

    Raises
    ------
    RequirementError
        For a field that does not fit; its `key` says which.

    Examples
    --------
    >>> import numpy as np
    >>> slow = Requirement("ACS-3", formula="always[0, 2](norm(rate) <= 0.01)")
    >>> record = {"time": np.arange(4.0), "rate": np.array([[0.003, 0.004], [0.0, 0.006], [0.0, 0.0], [1.0, 1.0]])}
    >>> f"{slow.robustness(record):.3f}"
    '0.004'
    >>> Requirement("ACS-4", metric="settling_time", at_most=600.0).verdict({"settling_time": 640.0}).word
    'not met'
    """

    id: str
    text: str = ""
    metric: str = ""
    at_most: float | None = None
    at_least: float | None = None
    formula: str = ""
    share: float = 1.0
    confidence: float = 0.9

    def __post_init__(self) -> None:
        if not isinstance(self.id, str) or not re.fullmatch(ID, self.id):
            raise RequirementError(
                f"a requirement has the id {self.id!r}, expected letters, digits, ., _ and -, the first a letter", "id"
            )
        if bool(self.metric) == bool(self.formula):
            told = "both; keep one of them" if self.metric else "neither"
            raise RequirementError(f"{self.id} has {told}: a metric with at_most or at_least, or a formula")
        for key in ("at_most", "at_least"):
            value = getattr(self, key)
            if value is not None and not math.isfinite(value):
                raise RequirementError(f"{key} of {self.id} is {value}, expected a finite number", key)
        if self.formula:
            if self.at_most is not None or self.at_least is not None:
                key = "at_least" if self.at_most is None else "at_most"
                raise RequirementError(f"{self.id} has a formula, which holds its own bounds; leave {key} out", key)
            _ = self.condition
        elif self.at_most is None and self.at_least is None:
            raise RequirementError(f"{self.id} bounds {self.metric} by nothing; give at_most or at_least", "metric")
        elif self.at_most is not None and self.at_least is not None and self.at_least > self.at_most:
            raise RequirementError(
                f"at_least {self.at_least:g} of {self.id} is above at_most {self.at_most:g}: nothing can meet both",
                "at_least",
            )
        if not 0 < self.share <= 1:
            raise RequirementError(
                f"share of {self.id} is {self.share}, expected a number above 0 and up to 1", "share"
            )
        if not 0 < self.confidence < 1:
            raise RequirementError(
                f"confidence of {self.id} is {self.confidence}, expected a number between 0 and 1", "confidence"
            )

    @cached_property
    def condition(self) -> syntax.Condition:
        """The formula as a tree; raise `RequirementError` where the requirement is a bound on a metric."""
        if not self.formula:
            raise RequirementError(f"{self.id} bounds the metric {self.metric} and has no formula", "formula")
        try:
            return parse(self.formula)
        except RequirementError as error:
            raise RequirementError(f"{self.id}: {error}", error.key) from None

    @property
    def asked(self) -> str:
        """What is asked, on one line."""
        if self.formula:
            return " ".join(self.formula.split())
        least = "" if self.at_least is None else f"{self.at_least:g} <= "
        return f"{least}{self.metric}" + ("" if self.at_most is None else f" <= {self.at_most:g}")

    def bind(self, layout: Layout, column: Any, period: float) -> Bound:
        """Return what the formula says of a column with a layout and a period [s]; errors as for `normal.bind`."""
        try:
            return bind(self.condition, self.formula, layout, column, period)
        except RequirementError as error:
            raise RequirementError(f"{self.id}: {error}", error.key) from None

    def robustness(self, of: Flight | Mapping[str, Any]) -> float:
        """Return by how much the requirement is met; below 0 by how much it is not.

        Parameters
        ----------
        of : a flight; or the values of metrics by name; or, for a formula, a record: `time`, (K,), [s], and signals by
            name, (K,) or (K, n), in the units of the formula. Intervals count from the first sample.

        Returns
        -------
        float
            In the unit of the metric, or of what the formula compares; -inf for a metric that has no value and for a
            flight that diverged, +-inf where an interval has no sample.

        Raises
        ------
        RequirementError
            For a metric or a signal that is not there, and a record whose samples are not equally apart.
        """
        if not isinstance(of, Mapping):
            known = of.verdicts.get(self.id)
            if known is not None and known.requirement == self:
                return known.robustness
            if of.diverged:
                return -math.inf
            of = of.metrics if self.metric else of.signals
        if self.metric:
            return float(self.margins(of))
        layout, samples, period = record_of(of, self.id)
        return robustness_of(self, layout, samples, period)

    def verdict(self, of: Flight | Mapping[str, Any], unit: str = "") -> Verdict:
        """Return whether a flight, or a record, meets the requirement; as for `robustness`."""
        if not isinstance(of, Mapping) and self.id in of.verdicts and of.verdicts[self.id].requirement == self:
            return of.verdicts[self.id]
        return Verdict(self, self.robustness(of), unit)

    def margins(self, table: Mapping[str, Any]) -> np.ndarray:
        """Return the margin of the metric to its bound for every case of a table.

        Parameters
        ----------
        table : of each metric the values, (cases,) or one number; None and NaN where it has none.

        Returns
        -------
        array, (cases,)
            At least 0 where the requirement is met; -inf where the metric has no value.
        """
        if not self.metric:
            raise RequirementError(
                f"{self.id} is a formula over signals; its margins are not those of metrics", "formula"
            )
        if self.metric not in table:
            raise RequirementError(
                f"{self.id} bounds {self.metric!r}, which is no metric; {offer(self.metric, table)}", "metric"
            )
        values = np.asarray(table[self.metric], dtype=float)
        above = np.inf if self.at_most is None else self.at_most - values
        below = np.inf if self.at_least is None else values - self.at_least
        least = np.minimum(above, below)
        return np.where(np.isnan(least), -np.inf, least)


@dataclass(frozen=True)
class Verdict:
    """Say whether a flight met a requirement.

    Parameters
    ----------
    requirement : which.
    robustness : by how much, below 0 by how much not; +-inf where nothing bounds it.
    unit : of the robustness, "" where it has none or several.
    """

    requirement: Requirement
    robustness: float
    unit: str = ""

    @property
    def met(self) -> bool:
        """Whether it was met."""
        return self.robustness >= 0

    @property
    def word(self) -> str:
        """The word of the verdict."""
        return "met" if self.met else "not met"

    @property
    def margin(self) -> str:
        """The robustness as a reader is told it, with its sign and unit."""
        unit = "" if self.unit in ("", "-") or not math.isfinite(self.robustness) else f" {self.unit}"
        return f"{self.robustness:+.4g}{unit}"

    def as_data(self) -> dict[str, Any]:
        """Return the verdict as plain data; a robustness that is not finite becomes a word."""
        asked = self.requirement
        finite = math.isfinite(self.robustness)
        return {
            "id": asked.id,
            "text": asked.text,
            "asked": asked.asked,
            "robustness": self.robustness if finite else str(self.robustness),
            "unit": self.unit,
            "verdict": self.word,
        }


def robustness_of(requirement: Requirement, layout: Layout, samples: np.ndarray, period: float) -> float:
    """Return the robustness of a formula at the first sample of a record.

    Parameters
    ----------
    requirement : with a formula.
    layout, samples : columns, and one row a sample, (K, columns).
    period : from sample to sample [s].
    """
    column = layout.symbol("row")
    bound = requirement.bind(layout, column, period)
    return unbounded(evaluating.robustness(bound.tree, margins_of(bound, layout, column)(samples))[0])


def margins_of(bound: Bound, layout: Layout, column: ca.SX) -> Any:
    """Return the function from rows, (K, columns), to the margins of a formula's comparisons, (M, K)."""
    read = [i for name in sorted(bound.names) for i in range(*layout.place(name).indices(layout.size))]
    tape = ca.Function("margins", [column[read]], [ca.densify(ca.vertcat(*bound.margins))])

    def evaluate(samples: np.ndarray) -> np.ndarray:
        shape = (len(bound.margins), len(samples))
        if not len(samples):
            return np.zeros(shape)
        # Of comparisons of constants alone CasADi returns one column.
        return np.broadcast_to(np.array(ca.DM(tape(ca.DM(np.ascontiguousarray(samples[:, read].T))))), shape)

    return evaluate


def unbounded(robustness: Any) -> float:
    """Return a robustness with infinity in the place of what stands for it."""
    value = float(robustness)
    return math.copysign(math.inf, value) if abs(value) >= BEYOND else value


def record_of(signals: Mapping[str, Any], whose: str) -> tuple[Layout, np.ndarray, float]:
    """Return layout, rows and period of a record given by signals."""
    if "time" not in signals:
        raise RequirementError(
            f"{whose} needs a record with the signal time, and there is {', '.join(signals) or 'none'}"
        )
    time = np.asarray(signals["time"], dtype=float).ravel()
    steps = np.diff(time)
    if len(time) < 2 or not steps[0] > 0:
        raise RequirementError(f"{whose} needs a record of two samples or more, at times that rise")
    if not np.abs(steps - steps[0]).max() <= 1e-6 * steps[0] + 4 * np.spacing(np.abs(time).max()):
        raise RequirementError(
            f"{whose} needs samples that are equally apart; theirs are {steps.min():g} to {steps.max():g} s apart"
        )
    parts, blocks = [], []
    for name, values in signals.items():
        block = np.asarray(values, dtype=float)
        if block.ndim not in (1, 2) or len(block) != len(time):
            raise RequirementError(f"the signal {name} has the shape {block.shape}, and there are {len(time)} times")
        blocks.append(block.reshape(len(time), -1))
        parts.append(Signal(name, blocks[-1].shape[1]))
    return Layout(tuple(parts)), np.hstack(blocks), float((time[-1] - time[0]) / (len(time) - 1))


def described(requirement: Requirement) -> str:
    """Return what a requirement is called in a sentence: its id, and its text or what it asks."""
    return f"{requirement.id} ({shortened(requirement.text or requirement.asked)[1:-1]})"
