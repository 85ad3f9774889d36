"""A mission's plant, linearised at its target, from efforts to what is regulated: the A and B of a synthesis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from casadi_gnc.allocation import leaves_none_out
from casadi_gnc.errors import FlightError
from casadi_gnc.missions.loop import Loop
from casadi_gnc.missions.scheme import Scheme
from casadi_gnc.signals import Layout

if TYPE_CHECKING:
    from casadi_gnc.missions.mission import Mission


@dataclass(frozen=True, eq=False)
class LinearPlant:
    """Hold d' = A d + B u for small deviations d of what is regulated from its target.

    Parameters
    ----------
    A : (n, n), [1/s]. B : (n, m), by effort.
    states : (n,), names of what is regulated, such as "position 1".
    efforts : (m,), names of the efforts, such as "force 1".
    target : (n,), the values about which d is counted.
    """

    A: np.ndarray
    B: np.ndarray
    states: tuple[str, ...]
    efforts: tuple[str, ...]
    target: np.ndarray


def linear_plant(mission: Mission, scheme: Scheme, t: float) -> LinearPlant:
    """Return the plant at its target at a time [s], with actuators that make the effort that is asked, unlimited.

    What is not regulated stays as at the start, and so does a target that moves.

    Raises
    ------
    FlightError
        Where the mission has no target, or the plant no slope there.
    """
    still = mission.craft.held(mission)
    if still is not None:
        mission, scheme = still, still.scheme(scheme.name)
    if not mission.target:
        raise FlightError(f"{mission.name} says no target at which its plant could be linearised")
    loop, rows = Loop(mission, scheme, averaged=True), rows_of(mission)
    s, quiet = loop.symbols(), mission.quiet()
    effort = ca.SX.sym("effort", scheme.actuation.effort.size)
    actuators = unlimited(mission, scheme, loop.sensed(s.t, s.x, quiet), effort)
    rate = loop.moved(s.t, s.x, actuators, quiet)[rows]
    slopes = ca.substitute([ca.jacobian(rate, s.x[rows]), ca.jacobian(rate, effort)], [effort], [0 * effort])
    x = target_state(mission)
    found: Any = ca.Function("slopes", [s.t, s.x], slopes)(t, x)
    A, B = (np.array(ca.DM(each).full()) for each in found)
    if not (np.isfinite(A).all() and np.isfinite(B).all()):
        raise FlightError(
            f"the plant of {mission.name} has no slope at its target, so nothing linear can be said of it"
        )
    state = np.array(names_of(mission.truth.state))
    return LinearPlant(A, B, tuple(state[rows].tolist()), tuple(names_of(scheme.actuation.effort)), x[rows])


def names_of(layout: Layout) -> list[str]:
    """Return a name for every row of a layout."""
    return [
        f"{signal.name} {row + 1}" if signal.size > 1 else signal.name
        for signal in layout.signals
        for row in range(signal.size)
    ]


def rows_of(mission: Mission) -> list[int]:
    """Return the rows of the plant's state that the laws regulate."""
    places = [mission.truth.state.place(name) for name in mission.target]
    return [row for place in places for row in range(place.start, place.stop)]


def target_state(mission: Mission) -> np.ndarray:
    """Return the plant's state at the target: what is regulated there, the rest as at the start."""
    x = np.array(mission.start, dtype=float)
    for name, values in mission.target.items():
        x[mission.truth.state.place(name)] = values
    return x


def unlimited(mission: Mission, scheme: Scheme, y: Any, wanted: Any) -> Any:
    """Return the least actuator commands that make the wanted effort, or come nearest to it, bounds left out."""
    matrix = scheme.actuation.matrix(mission.truth.measurement.split(y))
    if not leaves_none_out(matrix):
        return ca.mtimes(ca.DM(np.linalg.pinv(np.array(ca.DM(matrix)))), wanted)
    return ca.mtimes(matrix.T, ca.solve(ca.mtimes(matrix, matrix.T), wanted))
