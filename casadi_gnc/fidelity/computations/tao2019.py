"""Numbers of Tao, Zhang (2019), doi:10.16356/j.1005-1120.2019.04.008, that no flight answers alone."""

from __future__ import annotations

import json
import math
from functools import cache
from typing import Any

import casadi as ca
import numpy as np

import casadi_gnc
from casadi_gnc.checking.funnels import needed_share
from casadi_gnc.laws.drag_free import PRINTED_THRESHOLD
from casadi_gnc.missions.flight import Flight

Changes = dict[str, Any]
_PRINTED = "tao2019/as_printed"


@cache
def _flown(problem: str, scheme: str, changes: str) -> Flight:
    """Return the first and the last sample of a flight."""
    metric = {"name": "largest_force", "kind": "peak", "signal": "wanted_force"}
    mission = casadi_gnc.load(problem, {**json.loads(changes), "metric": [metric]})
    return casadi_gnc.fly(mission, scheme, decimation=mission.timing.samples - 1)


def _end(problem: str, scheme: str, changes: Changes | None) -> Flight:
    return _flown(problem, scheme, json.dumps(changes or {}, sort_keys=True))


def final_error(problem: str, scheme: str, signal: str, axis: int, changes: Changes | None = None) -> float:
    """Return the magnitude of an element of a signal at the end of a flight; axes from 1.

    Parameters
    ----------
    signal : "position" [m] or "mrp".
    """
    return float(abs(_end(problem, scheme, changes)[signal][-1, axis - 1]))


def final_ratio(problem: str, scheme: str, signal: str, changes: Changes) -> float:
    """Return the norm of a signal at the end of a flight over that with changes."""
    sizes = [np.linalg.norm(_end(problem, scheme, each)[signal][-1]) for each in (None, changes)]
    return float(sizes[0] / sizes[1])


def command_ratio(problem: str, scheme: str, over: str, duration_s: float) -> float:
    """Return the largest force that one scheme asks for over that of another."""
    peaks = [_end(problem, name, {"timing.duration_s": duration_s}).metrics["largest_force"] for name in (scheme, over)]
    return math.nan if None in peaks else float(peaks[0] / peaks[1])  # type: ignore[operator]


def held_error(axis: int, time_s: float) -> float:
    """Return the position error, [m], that holds against the disturbance force at a time; axes from 1.

    At rest in the narrowest funnel the force of (77) is -R_p' R_p r, R_p = pi/2/rho.
    """
    mission = casadi_gnc.load(_PRINTED)
    plant: Any = mission.truth
    law: Any = mission.scheme("corrected").law
    force = float(ca.DM(plant.disturbance.effort(time_s, plant.orbit.rate))[axis - 1])
    return abs(force) * (2 * float(ca.DM(law.position_funnel.width(time_s))[axis - 1]) / math.pi) ** 2


def threshold_ratio(motion: str) -> float:
    """Return b_1 over b_2 of Table 1, which the proof asks to be 1 or more.

    Parameters
    ----------
    motion : "attitude" or "position".
    """
    law: Any = casadi_gnc.load(_PRINTED).scheme("corrected").law
    first = PRINTED_THRESHOLD if motion == "attitude" else float(law.gain_threshold)
    return first / float(law.gain_softness)


def needed_force() -> float:
    """Return a force limit, [N], below which nothing keeps the position funnel."""
    mission = casadi_gnc.load(_PRINTED)
    scheme = mission.scheme("corrected")
    funnel = next(each for each in mission.funnels if each.signal == "position")
    return needed_share(mission, scheme, funnel) * float(scheme.actuation.upper[0])
