"""What a formula over time asks of each instant, along a flight."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from casadi_gnc.missions.requirements import evaluating
from casadi_gnc.missions.requirements.requirement import Requirement, margins_of, record_of
from casadi_gnc.missions.requirements.tree import Join, Margin, Node, Window

if TYPE_CHECKING:
    from casadi_gnc.missions.flight import Flight


@dataclass(frozen=True, eq=False)
class Instants:
    """Hold how far a flight is from breaking what is asked of an instant.

    Parameters
    ----------
    time, margin : (K,), [s] and unit of what is compared; below 0 where it is broken.
    asked : first and last time at which it is asked, [s].
    """

    time: np.ndarray
    margin: np.ndarray
    asked: tuple[float, float]


def instants(requirement: Requirement, flight: Flight) -> Instants | None:
    """Return the margin of each sample of a flight to what one interval asks of it.

    None for a bound on a metric, and for a formula that is more than one condition within one interval.
    """
    if not requirement.formula or flight.diverged:
        return None
    layout, samples, period = record_of(flight.signals, requirement.id)
    column = layout.symbol("row")
    bound = requirement.bind(layout, column, period)
    node, first, last = bound.tree, 0, 0
    if isinstance(node, Window):
        node, first, last = node.part, node.first, len(samples) - 1 if node.last is None else node.last
    if not _of_an_instant(node):
        return None
    margin = evaluating.robustness(node, margins_of(bound, layout, column)(samples))
    time = np.asarray(flight.time, dtype=float)
    ends = (min(one, len(time) - 1) for one in (first, last))
    low, high = (float(time[one]) for one in ends)
    return Instants(time, margin, (low, high))


def _of_an_instant(node: Node) -> bool:
    return isinstance(node, Margin) or (isinstance(node, Join) and all(map(_of_an_instant, node.parts)))
