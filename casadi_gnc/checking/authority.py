"""Can the actuators make what the law may ask for, and hold what pushes from outside?"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache

import casadi as ca
import numpy as np

from casadi_gnc.checking import programs, standing
from casadi_gnc.checking.allocation import allocation_slope, pushes_both_ways
from casadi_gnc.checks import Check
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.scheme import Scheme

#: Part of the load that may be left over where all of it is borne.
_BORNE = 1e-6
#: Share below which an effort counts as not made: what is left is the linear program's rounding.
_SPANNED = 1e-9
#: What is said where the effectiveness follows the measurement: it is another a moment later, so what one moment lacks
#: is no fault of the craft.
AT_FIRST = ", at the first measurement"
FOLLOWS = (
    "That changes with the measurement, as what coils make changes with the field; it calls for no actuator by itself. "
    "Let a flight show whether every effort is made in time."
)


def checks(mission: Mission, scheme: Scheme) -> Iterator[Check]:
    """Yield the share of the virtual-control box that is made, and what standing still at the target takes."""
    span, follows = spanned(mission, scheme), callable(scheme.actuation.effectiveness)
    yield Check(
        "authority.span",
        span,
        0.0,
        "-",
        "note" if np.isnan(span) or follows else "fail",
        f"The actuators cannot make some effort at all, however little of it{AT_FIRST}."
        if follows
        else "The actuators cannot make some effort at all, however little of it: the craft drifts off that way.",
        FOLLOWS if follows else "Add or turn an actuator so that every direction of effort can be made.",
        "least share of what all actuators make of a row of effort at most, with the other rows at zero",
        at_least=True,
        strict=True,
    )
    share = attainable_share(mission, scheme)
    yield Check(
        "authority.virtual_control",
        share,
        1.0,
        "-",
        "note",
        "The law may ask for efforts that the actuators cannot make; what is missing is then up to the allocation.",
        "Feed back the achieved effort: the share is that of the first measurement."
        if follows
        else "Shrink the limits of the effort to that share, or feed back the achieved effort.",
        "largest multiple of the box of limits, every corner of which the actuators can make",
        at_least=True,
    )
    demand = static_demand(mission, scheme)
    if np.isfinite(demand):
        yield Check(
            "authority.static_demand",
            demand,
            1.0,
            "-",
            "fail",
            "At rest at the target the disturbance alone needs more than the actuators and limits give.",
            "Raise the limits, add actuators, or accept that the target is not held.",
            "least share of actuator bounds and limits that cancels the plant's acceleration at the target, any time",
        )
    if mission.target and pushes_both_ways(scheme) and scheme.actuation.inverse is None:
        yield Check(
            "authority.allocated_demand",
            allocated_demand(mission, scheme, allocation_slope(mission, scheme)),
            1.0,
            "-",
            "fail",
            "As this allocation shares it out, standing still at times takes more than the limits: it drifts off.",
            "Raise the limits of the effort, or allocate against the errors and faults that take the effort away.",
            "effort that cancels disturbance and faults through (true effectiveness) x (slope of the allocation)",
        )


def believed(mission: Mission, scheme: Scheme) -> np.ndarray:
    """Return the believed effectiveness at the first measurement, (R, N)."""
    y = mission.first_measurement()
    return np.array(ca.DM(scheme.actuation.matrix(mission.truth.measurement.split(y))).full())


def spanned(mission: Mission, scheme: Scheme) -> float:
    """Return the least share of its reach that each row of effort can be made with, alone and on both sides.

    Efforts along both sides of every axis have zero inside their hull, so all directions can be made a little, or,
    where the share is 0, some cannot at all: actuators that push to one side of a plane.
    """
    matrix = believed(mission, scheme)
    lower, upper = np.array(scheme.actuation.lower), np.array(scheme.actuation.upper)
    reach = np.abs(matrix) @ np.maximum(np.abs(lower), np.abs(upper))
    if not np.isfinite(matrix).all() or not (reach > 0).all():
        return 0.0
    scaled = matrix / reach[:, None]
    rows = len(scaled)
    corners = np.vstack([np.eye(rows), -np.eye(rows)])
    least = float(programs.largest_shares(scaled, corners, lower, upper).min())
    return least if least > _SPANNED or np.isnan(least) else 0.0


def attainable_share(mission: Mission, scheme: Scheme) -> float:
    """Return the largest s such that all corners of s times the box of limits can be made."""
    matrix, actuation = believed(mission, scheme), scheme.actuation
    corners = np.stack(
        np.meshgrid(*zip(actuation.limit_below, actuation.limit_above, strict=True), indexing="ij"), axis=-1
    )
    wanted = np.unique(corners.reshape(-1, matrix.shape[0]), axis=0)
    return float(programs.largest_shares(matrix, wanted, actuation.lower, actuation.upper).min())


def static_demand(mission: Mission, scheme: Scheme) -> float:
    """Return the largest share, over the flight, of bounds and limits needed to stand still at the target."""
    if not mission.target:
        return float("nan")
    actuation, matrix = scheme.actuation, believed(mission, scheme)
    lower, upper, below, above = (
        tuple(each) for each in (actuation.lower, actuation.upper, actuation.limit_below, actuation.limit_above)
    )
    return _static_demand(mission, matrix.tobytes(), matrix.shape, lower, upper, below, above)


@lru_cache(maxsize=8)
def _static_demand(mission: Mission, data: bytes, shape: tuple[int, int], *box: tuple[float, ...]) -> float:
    """Return the share for one believed effectiveness and one box; schemes often have the same."""
    matrix = np.frombuffer(data).reshape(shape)
    lower, upper, below, above = (np.array(each) for each in box)
    _, drift, gain = standing.loads(mission)
    kept = standing.lasting(gain)
    if not kept.any():
        return float("nan")
    n = shape[1]
    # Of actuators and s: bounds and limits grow with s.
    grown = np.vstack(
        [
            np.column_stack([np.eye(n), -upper]),
            np.column_stack([-np.eye(n), lower]),
            np.column_stack([matrix, -above]),
            np.column_stack([-matrix, below]),
        ]
    )
    # The share is convex in the load, so its largest may lie between the extremes of single rows: every time counts.
    return float(programs.least_shares(grown, gain[kept], drift[kept]).max())


def _share(taken: np.ndarray, bounds: Sequence[float]) -> np.ndarray:
    """Return what is taken over its bounds: of none, nothing is no share and anything all there is."""
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = taken / np.array(bounds)
    return np.where(taken == 0, 0.0, shares)


def allocated_demand(mission: Mission, scheme: Scheme, slope: np.ndarray) -> float:
    """Return the largest share of bounds and limits that standing still takes through an allocation F = slope u."""
    _, drift, gain = standing.loads(mission)
    kept = standing.lasting(gain)
    wanted = standing.efforts(mission, slope)[kept]
    made = wanted @ slope.T
    left = np.einsum("kij,kj->ki", gain[kept], made) + drift[kept]
    if np.abs(left).max(initial=0.0) > _BORNE * np.abs(drift).max(initial=0.0):
        return float("inf")
    actuation = scheme.actuation
    shares = [_share(wanted, actuation.limit_above), _share(wanted, actuation.limit_below)]
    shares += [_share(made, actuation.upper), _share(made, actuation.lower)]
    return float(np.hstack(shares).max(initial=0.0))
