"""Numbers asked of a flight, each a fold over its samples.

===========  ================================================================================
kind         value
===========  ================================================================================
settling     time from `after` on until the norm of the signal stays below `threshold` to the end of
             the window, [s]; none if it never does
reaching     time from `after` on until the norm is below `threshold`, [s]; none if it never is
peak, least  largest and smallest norm in the window
final        norm at the last sample of the window
mean         mean of the norm over the samples of the window
sample_sum   sum of the norm over the samples of the window, without a time step (as papers print
             "accumulated" torque and force)
===========  ================================================================================

The norm is the largest magnitude ("max") or the 2-norm ("two"); the window goes from `after` to
`until`, both included; without them it is the whole flight.

Requirements over signals are folded beside the metrics (`casadi_gnc.missions.requirements`).

The folds are CasADi functions like everything else: every engine computes them from every sample,
however few samples are kept. Status bits are counted in the same way, and their first times kept.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from casadi_gnc.mathematics import bounds
from casadi_gnc.missions.requirements import Watch
from casadi_gnc.signals import Layout, Signal
from casadi_gnc.status import StepStatus

if TYPE_CHECKING:
    from casadi_gnc.missions.scheme import Metric

#: "Not yet": no flight has a time below zero.
NEVER = -1.0


def fold(metrics: Sequence[Metric], row: Layout, watches: Sequence[Watch] = ()) -> tuple[Layout, ca.Function]:
    """Return the layout of the tally and the function (row, tally) -> tally."""
    counts = tuple(Signal(f"count_{bit.name}") for bit in StepStatus)
    firsts = tuple(Signal(f"first_{bit.name}", 1, "s") for bit in StepStatus)
    layout = Layout(
        (*(Signal(_column(metric)) for metric in metrics), *counts, *firsts, *(one.signal for one in watches))
    )
    sample, tally = row.symbol("row"), layout.symbol("tally")
    now, so_far = row.split(sample), layout.split(tally)
    parts: dict[str, Any] = {
        _column(metric): _next(metric, getattr(now, metric.signal), now.time, getattr(so_far, _column(metric)))
        for metric in metrics
    }
    rest = now.status
    for bit in StepStatus:  # in the order of the bits, each the parity of what the lower ones left
        half = ca.floor(rest / 2)
        raised, rest = rest - 2 * half, half
        count, first = getattr(so_far, f"count_{bit.name}"), getattr(so_far, f"first_{bit.name}")
        parts[f"count_{bit.name}"] = count + raised
        parts[f"first_{bit.name}"] = ca.if_else(ca.logic_and(raised, first < 0), now.time, first)
    for one in watches:
        parts[one.name] = one.step(sample, getattr(so_far, one.name))
    result = ca.cse([ca.SX(layout.pack(**parts))])
    return layout, ca.Function("tally", [sample, tally], result, ["row", "tally"], ["tallied"])


def unflagged(fold: ca.Function, row: Layout) -> ca.Function:
    """Return the fold of a sample whose status is 0: the same words without the operations on its bits."""
    sample, tally = row.symbol("row"), ca.SX.sym("tally", fold.numel_in("tally"))
    quiet = ca.SX(sample)
    quiet[row.place("status")] = 0
    result = ca.cse([ca.SX(fold(quiet, tally))])
    return ca.Function("tally_unflagged", [sample, tally], result, ["row", "tally"], ["tallied"])


def _column(metric: Metric) -> str:
    """Return the name of a metric's place in the tally, apart from all others."""
    return f"metric_{metric.name}"


def _next(metric: Metric, signal: Any, time: Any, so_far: Any) -> Any:
    size = ca.sqrt(ca.sumsqr(signal)) if metric.norm == "two" else bounds.largest(ca.fabs(signal))
    fresh_one = so_far < 0  # NEVER: norms and times are not negative
    value = {
        "settling": ca.if_else(size < metric.threshold, so_far, time),
        "reaching": ca.if_else(ca.logic_and(fresh_one, size < metric.threshold), time, so_far),
        "peak": bounds.maximum(size, so_far),
        "least": ca.if_else(fresh_one, size, bounds.minimum(size, so_far)),
        "final": size,
        "mean": so_far + size,
        "sample_sum": so_far + size,
    }[metric.kind]
    conditions = [time >= metric.after] if metric.after > 0 else []
    conditions += [time <= metric.until] if metric.until < math.inf else []
    for condition in conditions:
        value = ca.if_else(condition, value, so_far)
    return value


def fresh(metrics: Sequence[Metric], layout: Layout, watches: Sequence[Watch] = ()) -> np.ndarray:
    """Return the tally before the first sample."""
    tally = np.zeros(layout.size)
    for metric in metrics:
        tally[layout.place(_column(metric))] = 0.0 if metric.kind in ("sample_sum", "mean") else NEVER
    for bit in StepStatus:
        tally[layout.place(f"first_{bit.name}")] = NEVER
    for one in watches:
        tally[layout.place(one.name)] = one.initial
    return tally


def read(
    metrics: Sequence[Metric], layout: Layout, tally: np.ndarray, last: float, period: float
) -> dict[str, float | None]:
    """Return the values of the metrics after the sample at time `last` [s].

    None stands for "never" (a settling, a reaching), "nowhere" (an empty window), and for every metric of a
    flight that diverged: comparisons pass over what is not a number, so nothing can be said.
    """
    found = read_many(metrics, layout, tally[None, :], last, period)
    return {name: None if math.isnan(column[0]) else float(column[0]) for name, column in found.items()}


def read_many(
    metrics: Sequence[Metric], layout: Layout, tallies: np.ndarray, last: float, period: float
) -> dict[str, np.ndarray]:
    """Return the values of the metrics of many flights, (flights,) each, NaN in the place of None; else as `read`.

    Parameters
    ----------
    tallies : (flights, columns).
    """
    values: dict[str, np.ndarray] = {}
    diverged = tallies[:, layout.place(f"count_{StepStatus.DIVERGED.name}")][:, 0] > 0
    for metric in metrics:
        value = tallies[:, layout.place(_column(metric))][:, 0].copy()
        value[diverged | ~np.isfinite(value)] = math.nan
        first, end, count = _window(metric, last, period)
        if not count:
            value[:] = math.nan
        elif metric.kind == "settling":
            # The signal was above its threshold at `value` for the last time, or never.
            value = np.where(value >= 0, value + period, np.where(np.isnan(value), math.nan, first))
            value[value > end - period / 2] = math.nan
            value -= metric.after
        else:
            value[value < 0] = math.nan
            if metric.kind == "reaching":
                value -= metric.after
            elif metric.kind == "mean":
                value /= count
        values[metric.name] = value
    return values


def settled(time: np.ndarray, sizes: np.ndarray, threshold: float) -> float | None:
    """Return the time at which a recorded norm settles, [s], by the definition above; None if it never does.

    Parameters
    ----------
    time, sizes : (K,), of all samples of the window.
    """
    above = np.flatnonzero(~(sizes < threshold))
    first = int(above[-1]) + 1 if len(above) else 0
    return float(time[first]) if first < len(time) - 1 else None


def _window(metric: Metric, last: float, period: float) -> tuple[float, float, int]:
    """Return first and last time of the samples in the window, [s], and how many; by the fold's comparisons."""
    times = np.arange(round(last / period) + 1) * period
    inside = times[(times >= metric.after) & (times <= metric.until)]
    return (float(inside[0]), float(inside[-1]), len(inside)) if len(inside) else (math.nan, math.nan, 0)


def statuses(layout: Layout, tally: np.ndarray) -> dict[StepStatus, tuple[int, float]]:
    """Return for each status bit that was raised how many samples raised it and when first [s]."""
    raised = {}
    for bit in StepStatus:
        count = int(tally[layout.place(f"count_{bit.name}")][0])
        if count:
            raised[bit] = (count, float(tally[layout.place(f"first_{bit.name}")][0]))
    return raised
