"""The verdicts of a flight on its requirements: from its tally, its metrics, and, where it must be, every sample."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from casadi_gnc.missions import metrics, tapes
from casadi_gnc.missions.requirements import Judge, Verdict
from casadi_gnc.status import StepStatus

if TYPE_CHECKING:
    from casadi_gnc.missions.mission import Mission


def judges_of(mission: Mission, built: tapes.Tapes) -> list[Judge]:
    """Return what judges those requirements over signals that are not in the tally; it needs every sample."""
    watched = [one.requirement for one in built.watches]
    rest = [one for one in mission.requirements if one.formula and one not in watched]
    return [Judge(one, built.row, mission.timing.sample_period) for one in rest]


def verdicts(
    mission: Mission, built: tapes.Tapes, tally: np.ndarray, values: dict[str, float | None], judges: list[Judge]
) -> dict[str, Verdict]:
    """Return the verdict of every requirement, by its id, in the mission's order; a flight that diverged meets none."""
    units = {metric.name: metric.unit for metric in mission.metrics}
    asked = [one for one in mission.requirements if one.metric]
    found = [Verdict(one, one.robustness(values), units[one.metric]) for one in asked]
    found += [
        Verdict(one.requirement, float(one.read(tally[built.tally.place(one.name)])), one.unit) for one in built.watches
    ]
    found += [judge.verdict() for judge in judges]
    if StepStatus.DIVERGED in metrics.statuses(built.tally, tally):
        found = [replace(verdict, robustness=-math.inf) for verdict in found]
    by_id = {verdict.requirement.id: verdict for verdict in found}
    return {one.id: by_id[one.id] for one in mission.requirements}
