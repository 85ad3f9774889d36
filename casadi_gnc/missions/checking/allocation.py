"""Does the allocation turn a wanted effort into one that points the right way, whatever the truth?

The map from wanted to made effort is T = B K: K the allocation's slope at rest, B the effectiveness
as it may truly be (a craft lists its errors and faults, `Craft.truths`). An eigenvalue of T with a
negative real part turns a stabilising command into a destabilising one.
"""

from __future__ import annotations

from collections.abc import Iterator

import casadi as ca
import numpy as np

from casadi_gnc.checks import Check
from casadi_gnc.missions import tapes
from casadi_gnc.missions.mission import Mission, Scheme

#: Commands at which the slope is taken, as a share of the limits.
_SMALL = 1e-3


def checks(mission: Mission, scheme: Scheme) -> Iterator[Check]:
    """Yield the worst eigenvalue over the true effectivenesses, for actuators that push both ways."""
    truths = mission.truths(mission, scheme)
    lower, upper = np.array(scheme.actuation.lower), np.array(scheme.actuation.upper)
    if not truths or not np.all((lower < 0) & (upper > 0)):
        return
    slope = allocation_slope(mission, scheme)
    scale = np.diag(np.array(scheme.actuation.limit_above))
    found = {
        name: float(np.linalg.eigvals(np.linalg.solve(scale, truth @ slope @ scale)).real.min())
        for name, truth in truths.items()
    }
    worst = min(found, key=lambda name: found[name])
    yield Check(
        "allocation.sign",
        found[worst],
        0.0,
        "-",
        "fail",
        f"With {worst} some wanted effort comes out turned around: the loop drives itself away.",
        "Lower the accuracy weight, allocate by the pseudo-inverse, or tell the allocation of the fault.",
        "least real part of an eigenvalue of (true effectiveness) x (slope of the allocation)",
        at_least=True,
    )


def allocation_slope(mission: Mission, scheme: Scheme) -> np.ndarray:
    """Return dF/du at rest, (N, R), by central differences of what flies."""
    actuation, count = scheme.actuation, mission.truth.inputs.size
    lower, upper, rest = np.array(actuation.lower), np.array(actuation.upper), np.zeros(count)
    if actuation.is_symbolic:
        s = tapes.Symbols(mission, scheme)
        told = tapes.allocated(mission, scheme, s.y, s.limited, s.actuators, s.lower, s.upper)
        expression = ca.Function("allocate", [s.y, s.limited, s.actuators, s.lower, s.upper], [told])
        y = ca.DM(mission.truth.measure(0.0, ca.DM(mission.start), ca.DM.zeros(mission.truth.noise.size)))

        def allocate(u: np.ndarray) -> np.ndarray:
            return np.array(ca.DM(expression(y, u, rest, lower, upper)).full()).ravel()  # type: ignore[arg-type]
    else:
        solve = actuation.allocator.start()

        def allocate(u: np.ndarray) -> np.ndarray:
            return np.array(solve(u, rest.copy(), lower, upper)[0])

    columns = []
    for row, limit in enumerate(actuation.limit_above):
        u = np.zeros(len(actuation.limit_above))
        u[row] = _SMALL * limit
        columns.append((allocate(u) - allocate(-u)) / (2 * u[row]))
    return np.array(columns).T
