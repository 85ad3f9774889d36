"""Does the allocation turn a wanted effort into one that points the right way, whatever the truth?

The map from wanted to made effort is T = B K: K the allocation's slope at rest, B the effectiveness
as it may truly be (a craft lists its errors and faults, `Craft.true_effectivenesses`). An eigenvalue of T with a
negative real part turns a stabilising command into a destabilising one.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import casadi as ca
import numpy as np

from casadi_gnc.allocation import OnlineInFlight, PseudoInverse, leaves_none_out
from casadi_gnc.allocation.online import BRIEF
from casadi_gnc.checks import Check
from casadi_gnc.missions.loop import Loop
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.scheme import Scheme

#: Commands at which the slope is taken, as a share of the limits.
_SMALL = 1e-3
#: An effort that is lost altogether is not turned around.
ROUNDING = 1e-6


def checks(mission: Mission, scheme: Scheme) -> Iterator[Check]:
    """Yield the worst eigenvalue over the true effectivenesses, and what a rate limit leaves of a turning effort."""
    yield from _rate(mission, scheme)
    if not mission.craft.true_effectivenesses(mission, scheme) or not pushes_both_ways(scheme):
        return
    found = least_real_parts(mission, scheme, allocation_slope(mission, scheme))
    worst = min(found, key=lambda name: found[name])
    yield Check(
        "allocation.sign",
        found[worst],
        -ROUNDING,
        "-",
        "fail",
        f"With {worst} some wanted effort comes out turned around: the loop drives itself away.",
        "Lower the accuracy weight, allocate by the pseudo-inverse, or tell the allocation of the fault.",
        "least real part of an eigenvalue of (true effectiveness) x (slope of the allocation)",
        at_least=True,
    )


def _rate(mission: Mission, scheme: Scheme) -> Iterator[Check]:
    """Yield whether rate-limited actuators follow an effort that stands still while the craft turns under it."""
    actuation, plant = scheme.actuation, mission.truth
    turns = plant.state.of_kind("rate")
    if not np.isfinite(actuation.rate) or not turns:
        return
    turning = max(float(np.linalg.norm(np.array(mission.start)[plant.state.place(each.name)])) for each in turns)
    stroke = float((np.array(actuation.upper) - np.array(actuation.lower)).max())
    yield Check(
        "allocation.rate",
        turning * stroke / 2,
        actuation.rate,
        "1/s",
        "fail",
        "While the craft turns as at the start, the actuators cannot follow an effort that is fixed in space: what "
        "they make lags behind and may drive the turn.",
        "Take actuators that change faster, or limit the effort until the turn is slower.",
        "initial rate times half the stroke of an actuator, units of the actuators per second",
    )


def pushes_both_ways(scheme: Scheme) -> bool:
    """Return whether every actuator pushes and pulls, so that the allocation has a slope at rest."""
    lower, upper = np.array(scheme.actuation.lower), np.array(scheme.actuation.upper)
    return bool(np.all((lower < 0) & (upper > 0)))


def least_real_parts(mission: Mission, scheme: Scheme, slope: np.ndarray) -> dict[str, float]:
    """Return the least real part of the torque map's eigenvalues by what is true."""
    above = np.array(scheme.actuation.limit_above)
    scale = np.diag(np.where(above > 0, above, 1.0))
    return {
        name: float(np.linalg.eigvals(np.linalg.solve(scale, truth @ slope @ scale)).real.min())
        for name, truth in mission.craft.true_effectivenesses(mission, scheme).items()
    }


@lru_cache(maxsize=32)
def allocation_slope(mission: Mission, scheme: Scheme) -> np.ndarray:
    """Return dF/du at rest, (N, R), by central differences of what flies; asked again, the same.

    Where the actuators leave an effort out there is no pseudo-inverse to fly; then that of least squares.
    """
    actuation, allocator, count = scheme.actuation, scheme.actuation.allocator, mission.truth.inputs.size
    matrix = actuation.matrix(mission.truth.measurement.split(mission.first_measurement()))
    if isinstance(actuation.allocator, PseudoInverse) and not leaves_none_out(matrix):
        return np.linalg.pinv(np.array(ca.DM(matrix)))
    lower, upper, rest = np.array(actuation.lower), np.array(actuation.upper), np.zeros(count)
    if actuation.is_symbolic:
        loop = Loop(mission, scheme)
        s = loop.symbols()
        told = loop.allocated(s.y, s.limited, s.actuators, s.lower, s.upper)
        expression = ca.Function("allocate", [s.y, s.limited, s.actuators, s.lower, s.upper], [told])
        y = mission.first_measurement()

        def allocate(u: np.ndarray) -> np.ndarray:
            return np.array(ca.DM(expression(y, u, rest, lower, upper)).full()).ravel()  # type: ignore[arg-type]
    else:
        solve = allocator.start(BRIEF) if isinstance(allocator, OnlineInFlight) else allocator.start()

        def allocate(u: np.ndarray) -> np.ndarray:
            return np.array(solve(u, rest.copy(), lower, upper)[0])

    columns = []
    for row, limit in enumerate(actuation.limit_above):
        u = np.zeros(len(actuation.limit_above))
        u[row] = _SMALL * (limit or 1.0)
        columns.append((allocate(u) - allocate(-u)) / (2 * u[row]))
    return np.array(columns).T
