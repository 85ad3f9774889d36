"""Can the funnels be kept, whatever the law?

Near its target a tracked signal s obeys s'' = c(t) + G F with the actuators F inside their bounds.
On a grid of times the least share of the bounds with which some F(t) keeps every tracked signal
inside its funnel is a linear program; a share above 1 says that no controller keeps it. G is that of the
start or of the target, whichever is larger. The commands held over an interval of the grid and G on the
way leave the share uncertain by some hundredths, which the limit allows for.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.checking import flown, programs
from casadi_gnc.checking.authority import believed
from casadi_gnc.checking.linear import driven_at_the_end
from casadi_gnc.checks import Check
from casadi_gnc.missions.linear_plant import target_state
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.scheme import Funnel, Scheme

#: Intervals of the grid, over the time in which the funnel comes within 1 % of its floor.
_GRID = 80
#: Share of a funnel that is as good as infinite.
_BEYOND = 1e12
#: Share above which the grid of times and the one G leave no doubt.
_CERTAIN = 1.05
#: Widest start of a funnel of MRPs whose corners are still less than half a turn away.
_HALF_TURN = 3**-0.5


def checks(mission: Mission, scheme: Scheme) -> Iterator[Check]:
    """Yield, for every funnel, the share of the actuators that keeping it takes at least."""
    for funnel in mission.funnels:
        # A law that does not know the funnel promises nothing about it: a baseline that is watched.
        otherwise = "fail" if scheme.law.keeps(funnel.signal) else "note"
        if funnel.signal in mission.truth.state and funnel.signal in mission.target:
            share = needed_share(mission, scheme, funnel)
            yield Check(
                f"funnel.authority.{funnel.signal}",
                share,
                _CERTAIN,
                "-",
                "note" if np.isnan(share) else otherwise,
                "No controller keeps the signal inside: the actuators are too weak for how fast the funnel narrows.",
                "Widen the funnel's start, let it narrow more slowly, or add authority.",
                "least share of actuator bounds over all commands, linearised, best gain on the way",
            )
            yield Check(
                f"funnel.floor.{funnel.signal}",
                floor_use(mission, scheme, funnel),
                1.0,
                "-",
                otherwise,
                "The disturbance alone drives the signal through the funnel's last width.",
                "Widen the floor, sample faster, or let the observer estimate the disturbance sooner.",
                "linearised loop at the end of the flight under the plant's own disturbance, last half of the flight",
            )
            if scheme.law.keeps(funnel.signal) and flown.can_fly(mission, scheme):
                yield _flown(mission, scheme, funnel)
        if _is_attitude(mission, funnel):
            yield from attitude_range(mission, funnel)


def _is_attitude(mission: Mission, funnel: Funnel) -> bool:
    return mission.truth.measurement.signal(funnel.signal).kind == "mrp"


def attitude_range(mission: Mission, funnel: Funnel) -> Iterator[Check]:
    """Yield whether MRPs start, and may go, less than half a turn away: in a funnel they cannot change sets."""
    y = mission.first_measurement()
    start = float(ca.norm_2(y[mission.truth.measurement.place(funnel.signal)]))
    yield Check(
        f"funnel.half_turn.{funnel.signal}",
        start,
        1.0,
        "-",
        "fail",
        "The attitude starts more than half a turn away: the law turns the long way round, or the other set of MRPs "
        "that the plant changes to lies outside the funnel.",
        "Give the same attitude as minus the vector over its square, and fit the funnel to that.",
        "norm of the MRPs at the start",
    )
    bounds = funnel.bounds
    widest = float(np.array(ca.DM(bounds.start * ca.fmax(bounds.below, bounds.above))).max())
    yield Check(
        f"funnel.corner.{funnel.signal}",
        widest,
        _HALF_TURN,
        "-",
        "note",
        "A corner of the funnel lies beyond half a turn: the funnel alone does not keep the attitude from there.",
        "Narrow the funnel's start if the manoeuvre allows it.",
        "half width at the start against 1/sqrt(3)",
    )


def _flown(mission: Mission, scheme: Scheme, funnel: Funnel) -> Check:
    """Return the largest share of a funnel in the flight without noise, through the scheme's own allocation."""
    times, states = flown.path(mission, scheme)
    t, signal = ca.SX.sym("t"), states[:, mission.truth.state.place(funnel.signal)]
    walls: Any = ca.Function("walls", [t], list(funnel.bounds.walls(t))).map(len(times))(times[None, :])
    lower, upper = (np.array(wall).T for wall in walls)
    use = np.maximum(signal / upper, signal / lower).max(axis=1)
    left = ~(use <= 1)
    when = f"leaves its funnel at {times[left.argmax()]:g} s" if left.any() else "leaves its funnel"
    return Check(
        f"funnel.flown.{funnel.signal}",
        float(np.where(use < _BEYOND, use, np.inf).max()),
        1.0,
        "-",
        "fail",
        f"Through this allocation the signal {when}, without noise already.",
        "Take an allocation that makes what the law asks, feed back what was made, or widen the funnel there.",
        "the flight itself, without noise",
    )


def floor_use(mission: Mission, scheme: Scheme, funnel: Funnel) -> float:
    """Return the largest share of the funnel's last width that the disturbance takes."""
    path = driven_at_the_end(mission, scheme, 0.5)
    if path is None:
        return float("inf")
    names = [name for name, values in mission.target.items() for _ in values]
    signal = path[:, [name == funnel.signal for name in names]]
    lower, upper = (np.array(ca.DM(wall)).ravel() for wall in funnel.bounds.walls(mission.timing.duration))
    share = float(np.maximum(signal / upper, signal / lower).max())
    return share if share < _BEYOND else float("inf")


def needed_share(mission: Mission, scheme: Scheme, funnel: Funnel) -> float:
    """Return the least share of the actuators' bounds and effort limits that keeps the funnel."""
    actuation, matrix = scheme.actuation, believed(mission, scheme)
    box = (actuation.lower, actuation.upper, actuation.limit_below, actuation.limit_above)
    return _needed_share(mission, funnel, matrix.tobytes(), matrix.shape, *(tuple(each) for each in box))


@lru_cache(maxsize=8)
def _needed_share(
    mission: Mission, funnel: Funnel, data: bytes, shape: tuple[int, int], *box: tuple[float, ...]
) -> float:
    """Return the share for one believed effectiveness and one box; schemes often have the same."""
    from scipy import sparse  # a flight does without

    matrix = np.frombuffer(data).reshape(shape)
    most_below, most_above, limit_below, limit_above = (np.array(each) for each in box)
    times, drift, gain, place, speed = _second_order(mission, funnel)
    bounds = funnel.bounds
    walls = [np.array([np.array(ca.DM(wall)).ravel() for wall in bounds.walls(t)]) for t in times]
    axes, count, steps = gain.shape[0], gain.shape[1], len(times) - 1
    h = times[1] - times[0]
    # With s'' held between grid points, s_(k+1) - 2 s_k + s_(k-1) = h^2 (s''_k + s''_(k-1)) / 2, and the first step has
    # s_1 = place + h speed + h^2 s''_0 / 2. Signals inside their walls are bounds, and few numbers stand in a row.
    now, before = np.eye(steps), np.eye(steps, k=-1)
    second, mean = now - 2 * before + np.eye(steps, k=-2), (now + before) / 2
    known = h**2 * (mean @ drift)
    known[0] += place + h * speed
    known[1:2] -= place
    lower, upper = (np.array([wall[side] for wall in walls[1:]]).ravel() for side in (0, 1))
    if np.isnan([lower, upper]).any():
        return float("nan")  # widths that overflow: the program would take such a wall for none
    eye, each = sparse.identity(steps), np.ones((steps, 1))
    inside = [
        sparse.hstack([sparse.identity(steps * count), -np.kron(each, np.c_[most_above])]),
        sparse.hstack([-sparse.identity(steps * count), np.kron(each, np.c_[most_below])]),
        sparse.hstack([sparse.kron(eye, matrix), -np.kron(each, np.c_[limit_above])]),
        sparse.hstack([-sparse.kron(eye, matrix), np.kron(each, np.c_[limit_below])]),
    ]
    bounded: Any = sparse.vstack(inside)
    moving = [sparse.kron(second, sparse.identity(axes)), -(h**2) * sparse.kron(mean, gain)]
    bare = steps * count + 1
    found = programs.least(
        np.r_[np.zeros(steps * (axes + count)), 1.0],
        sparse.hstack([sparse.csr_array((bounded.shape[0], steps * axes)), bounded], format="csr"),
        sparse.hstack([*moving, sparse.csr_array((steps * axes, 1))], format="csr"),
        known.ravel(),
        np.array([[*lower, *[-np.inf] * (bare - 1), 0.0], [*upper, *[np.inf] * bare]]),
    )
    # NaN where nothing is known: no reason to fail.
    return float("inf") if found is None else float(found[-1])


def _second_order(mission: Mission, funnel: Funnel) -> tuple[np.ndarray, ...]:
    """Return grid times, c(t), (K, n), G, (n, N), and value and speed of the signal at the start."""
    plant, size = mission.truth, mission.truth.state.size
    t, x, actuators = ca.SX.sym("t"), ca.SX.sym("x", size), plant.inputs.symbol("actuators")
    rate = ca.SX(plant.rate(t, x, actuators, ca.DM.zeros(plant.noise.size)))
    signal = rate[plant.state.place(funnel.signal)]
    second = ca.jtimes(signal, x, rate) + ca.jacobian(signal, t)
    gain = ca.jacobian(second, actuators)
    evaluate = ca.Function("second", [t, x], [ca.substitute(second, actuators, 0), gain, signal], {"allow_free": True})
    times = np.linspace(0.0, min(mission.timing.duration, _horizon(funnel)), _GRID + 1)
    start, target = np.array(mission.start, dtype=float), target_state(mission)
    calm = target.copy()
    calm[plant.state.place(funnel.signal)] = start[plant.state.place(funnel.signal)]
    drift = np.array([np.array(evaluate(at, target)[0]).ravel() for at in times[:-1]])
    gains = [np.array(ca.DM(evaluate(0.0, at)[1]).full()) for at in (calm, target)]
    gain_there = max(gains, key=lambda g: float(np.linalg.norm(g)))
    speed = np.array(evaluate(0.0, start)[2]).ravel()
    return times, drift, gain_there, start[plant.state.place(funnel.signal)], speed


def _horizon(funnel: Funnel) -> float:
    """Return the time [s] in which the funnel comes within 1 % of its narrowing."""
    return float(np.log(100.0) / np.array(ca.DM(funnel.bounds.decay)).min())
