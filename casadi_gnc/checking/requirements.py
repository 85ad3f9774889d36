"""What can be said of the mission's requirements before it flies.

Of a formula, the first sample of the state is known and how long the flight lasts. What follows from that alone,
whatever is flown, is necessary: it may fail. That a funnel ends wider than a bound is no more than a note: a law may do
better than its funnel asks.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import casadi as ca
import numpy as np

from casadi_gnc.checks import Check
from casadi_gnc.missions.loop import Loop
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.recording import row_of
from casadi_gnc.missions.requirements import Requirement
from casadi_gnc.missions.requirements.normal import Bound
from casadi_gnc.missions.requirements.tree import BEYOND, Held, Join, Margin, Node, Until, Window
from casadi_gnc.missions.scheme import Metric, Scheme

#: The least and the largest that a robustness can become.
_Range = tuple[float, float]
_ANY = (-BEYOND, BEYOND)


def checks(mission: Mission, scheme: Scheme) -> Iterator[Check]:
    """Yield what the start, the length of the flight and the funnels say of each requirement."""
    for one in mission.requirements:
        if one.formula:
            yield from _formula(mission, scheme, one)
        else:
            metric = next(metric for metric in mission.metrics if metric.name == one.metric)
            yield from _start(mission, one, metric)
            yield from _end(mission, one, metric)
            yield from _funnel(mission, one, metric)


def _formula(mission: Mission, scheme: Scheme, asked: Requirement) -> Iterator[Check]:
    row, timing = row_of(Loop(mission, scheme)), mission.timing
    column = row.symbol("row")
    bound = asked.bind(row, column, timing.sample_period)
    start = np.full(row.size, np.nan)
    start[row.place("time")] = 0.0
    for name in mission.truth.state.names:
        start[row.place(name)] = np.array(mission.start)[mission.truth.state.place(name)]
    known = _at_the_start(bound, column, start)
    least, most = _possible(bound.tree, 0, known, timing.samples - 1)
    unit = bound.unit or "-"
    if most < BEYOND:
        yield Check(
            f"requirement.start.{asked.id}",
            most if most > -BEYOND else -math.inf,
            0.0,
            unit,
            "fail",
            "No flight can meet the requirement, whatever the controller does.",
            "Change the start, the length of the flight or the formula.",
            "largest robustness that the state at the start and the length of the flight leave",
            at_least=True,
        )
    if least >= 0:
        yield Check(
            f"requirement.content.{asked.id}",
            math.inf,
            0.0,
            unit,
            "warn",
            "Every flight meets the requirement: its intervals hold no sample of the flight, or the start decides it.",
            "Look at the intervals, which are in seconds from where they begin, and at the length of the flight.",
            "least robustness that the state at the start and the length of the flight leave",
        )
    reach = _reach(bound.tree) * timing.sample_period
    if reach:
        yield Check(
            f"requirement.interval.{asked.id}",
            reach,
            (timing.samples - 1) * timing.sample_period,
            "s",
            "warn",
            "An interval ends after the flight: it is judged by what there is of it.",
            "Fly longer, or shorten the interval.",
            "seconds from the start of the flight to the end of the intervals inside each other",
        )


def _at_the_start(bound: Bound, column: ca.SX, start: np.ndarray) -> list[float | None]:
    """Return the margins at the first sample; None for those of what is not known before the flight (NaN)."""
    found, unknown = [], column[[i for i, value in enumerate(start) if math.isnan(value)]]
    for margin in bound.margins:
        value = None if ca.depends_on(margin, unknown) else ca.Function("margin", [column], [margin])(start)
        found.append(None if value is None else float(value))
    return found


def _possible(node: Node, k: int, start: Sequence[float | None], end: int) -> _Range:
    """Return the least and largest robustness at sample k that the first sample leaves; `end` is the last one."""
    if isinstance(node, Margin):
        value = start[node.number] if k == 0 else None
        return _ANY if value is None else (value, value)
    if isinstance(node, Join):
        parts = [_possible(part, k, start, end) for part in node.parts]
        pick = min if node.every else max
        return pick(low for low, _ in parts), pick(high for _, high in parts)
    if isinstance(node, Held):
        if k < node.samples:
            return (-BEYOND, -BEYOND) if node.every else (BEYOND, BEYOND)
        return _possible(node.part, k, start, end) if not node.samples else _ANY
    assert isinstance(node, (Window, Until))
    first, last = k + node.first, end if node.last is None else min(k + node.last, end)
    if isinstance(node, Window):
        if first > last:
            return (BEYOND, BEYOND) if node.every else (-BEYOND, -BEYOND)
        low, high = _possible(node.part, first, start, end)
        if first < last:  # of what lies between, nothing is said
            other = _possible(node.part, last, start, end)
            return (-BEYOND, min(high, other[1])) if node.every else (max(low, other[0]), BEYOND)
        return low, high
    return _until(node, k, first, last, start, end)


def _until(node: Until, k: int, first: int, last: int, start: Sequence[float | None], end: int) -> _Range:
    """Return the range of keep until goal, or of its contrary."""
    if first > last:
        return (BEYOND, BEYOND) if node.every else (-BEYOND, -BEYOND)
    keep, goal = (_possible(part, k, start, end) for part in (node.keep, node.goal))
    if first == last == k:
        return goal
    if node.every:  # the least of goals, each or a keep before it
        return (keep[0] if first > k else min(keep[0], goal[0])), BEYOND
    return -BEYOND, (keep[1] if first > k else max(keep[1], goal[1]))


def _reach(node: Node) -> int:
    """Return how many samples after an instant the intervals of a formula end, those up to the end left out."""
    if isinstance(node, Join):
        return max(map(_reach, node.parts))
    if isinstance(node, Held):
        return _reach(node.part)
    if isinstance(node, (Window, Until)):
        inner = max(map(_reach, (node.part,) if isinstance(node, Window) else (node.keep, node.goal)))
        return inner + (node.first if node.last is None else node.last)
    return 0


def _start(mission: Mission, asked: Requirement, metric: Metric) -> Iterator[Check]:
    """Yield whether the start alone breaks the bound of a largest or a least value."""
    state, bounded = mission.truth.state, {"peak": asked.at_most, "least": asked.at_least}.get(metric.kind)
    if bounded is None or metric.after > 0 or metric.signal not in state:
        return
    yield Check(
        f"requirement.start.{asked.id}",
        _size(metric, np.array(mission.start)[state.place(metric.signal)]),
        bounded,
        metric.unit or "-",
        "fail",
        "The mission starts outside the bound: no flight can meet the requirement.",
        "Change the start, give the metric an after_s, or change the bound.",
        "norm of the signal at the start",
        at_least=metric.kind == "least",
    )


def _end(mission: Mission, asked: Requirement, metric: Metric) -> Iterator[Check]:
    """Yield whether the flight is long enough for the metric to have a value that keeps the bound."""
    end = min(mission.timing.duration, metric.until)
    if metric.kind in ("settling", "reaching"):
        if asked.at_most is not None:
            yield Check(
                f"requirement.length.{asked.id}",
                metric.after + asked.at_most,
                end,
                "s",
                "warn",
                "The bound lies beyond the end of the flight, or of the metric's window: what is between is not seen.",
                "Fly longer, or look longer.",
                "bound of the time, and end of the flight or of the window",
                strict=True,
            )
        first = metric.after + (asked.at_least or 0.0)
    else:
        first = metric.after
    if first > 0:
        yield Check(
            f"requirement.window.{asked.id}",
            first,
            end,
            "s",
            "fail",
            "The flight ends before the metric can have a value that meets the requirement.",
            "Fly longer, or let the metric begin sooner.",
            "first time that counts, and length of the flight",
        )


def _funnel(mission: Mission, asked: Requirement, metric: Metric) -> Iterator[Check]:
    """Yield whether keeping a funnel is enough for the bound."""
    funnel = next((funnel for funnel in mission.funnels if funnel.signal == metric.signal), None)
    if funnel is None or asked.at_most is None or metric.kind not in ("peak", "final", "mean"):
        return
    bounds = funnel.bounds
    floor = np.array(ca.DM(bounds.floor * ca.fmax(bounds.below, bounds.above))).ravel()
    yield Check(
        f"requirement.floor.{asked.id}",
        _size(metric, floor),
        asked.at_most,
        metric.unit or "-",
        "note",
        "The funnel ends wider than the bound: a law that keeps the signal inside need not meet the requirement.",
        "Narrow the funnel's floor, or let flights decide.",
        "norm of the funnel's last half width",
    )


def _size(metric: Metric, signal: np.ndarray) -> float:
    return float(np.linalg.norm(signal)) if metric.norm == "two" else float(np.abs(signal).max())
