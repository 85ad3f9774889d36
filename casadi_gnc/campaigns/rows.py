"""The rows of a shard: what was flown, what came out, a column each."""

from __future__ import annotations

import math

import numpy as np

from casadi_gnc.campaigns.cases import Cases, Drawn
from casadi_gnc.campaigns.program import Flown
from casadi_gnc.campaigns.store import Columns, has_arrow
from casadi_gnc.missions import metrics
from casadi_gnc.missions.requirements import Requirement
from casadi_gnc.status import StepStatus


def rows_of(cases: Cases, drawn: Drawn, good: np.ndarray, flights: Flown, margins: Columns) -> Columns:
    """Return the table of some cases: parameters, metrics, statuses; nothing but the former of those refused.

    `margins` are those of requirements that no tally carries, by id, of each flight.
    """
    mission, tapes = cases.varied.nominal, cases.varied.tapes
    count = len(drawn.numbers)
    columns: Columns = {"case": drawn.numbers.astype(np.int64), "noise_seed": drawn.seeds, "weight": drawn.weights}
    columns |= {key: drawn.values[:, i] for i, key in enumerate(cases.varied.parameters.keys)}
    columns["refused"] = np.array(drawn.refused, dtype=object if has_arrow() else str)
    period, last = mission.timing.sample_period, (mission.timing.samples - 1) * mission.timing.sample_period
    values = metrics.read_many(tuple(mission.metrics), tapes.tally, flights.tally, last, period)
    for name, numbers in values.items():
        columns[f"metric.{name}"] = _spread(numbers, good, math.nan)
    for one in mission.requirements:
        columns[f"requirement.{one.id}"] = _spread(_margins(cases, one, values, flights, margins), good, math.nan)
    for bit in StepStatus:
        raised = flights.tally[:, tapes.tally.place(f"count_{bit.name}")][:, 0]
        first = flights.tally[:, tapes.tally.place(f"first_{bit.name}")][:, 0]
        columns[f"samples.{bit.name}"] = _spread(raised, good, 0.0).astype(np.int64)
        columns[f"first.{bit.name}"] = _spread(np.where(raised > 0, first, math.nan), good, math.nan)
    assert all(len(column) == count for column in columns.values())
    return columns


def _margins(cases: Cases, one: Requirement, values: Columns, flights: Flown, known: Columns) -> np.ndarray:
    """Return by how much each flight meets a requirement, below 0 by how much it does not."""
    if one.metric:
        return one.margins(values)
    tapes = cases.varied.tapes
    if one.id in known:
        found = known[one.id]
    else:
        watch = next(watch for watch in tapes.watches if watch.requirement == one)
        found = watch.read(flights.tally[:, tapes.tally.place(watch.name)])
    diverged = flights.tally[:, tapes.tally.place(f"count_{StepStatus.DIVERGED.name}")][:, 0] > 0
    return np.where(diverged, -math.inf, found)


def _spread(numbers: np.ndarray, good: np.ndarray, otherwise: float) -> np.ndarray:
    column = np.full(len(good), otherwise)
    column[good] = numbers
    return column
