"""The closed loop, linearised at its target with actuators that do what they are told.

What a craft regulates (`Mission.target`), what swings beside it (`Mission.swinging`) and the law's memory are the
state; everything else of the plant stays as at the start. A target that moves is held still where it is at the start
(`held`). Sampled, one step of the map is one sample period; continuous, the slope is that of plant and law together.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import casadi as ca
import numpy as np
from scipy import linalg

from casadi_gnc.missions.linear_plant import rows_of, target_state, unlimited
from casadi_gnc.missions.loop import Loop
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.scheme import Scheme

#: What is said of a check that looks at a target which does not move as it does in flight.
HELD = "the reference held still as it is at the start"


@lru_cache(maxsize=4)
def _still(mission: Mission) -> Mission:
    return mission.craft.held(mission) or mission


def held(mission: Mission, scheme: Scheme) -> tuple[Mission, Scheme]:
    """Return what is linearised: the mission and its scheme, or those with a target that moves held still."""
    still = _still(mission)
    return (mission, scheme) if still is mission else (still, still.scheme(scheme.name))


#: Steps with which a continuous loop is followed at most; exact for a load that is held over each.
_SAMPLES = 4_000
#: Magnitude at which a growing state is held.
_HUGE = 1e150
#: Loops of this many (mission, scheme, time) are kept: several families look at the same ones.
_KEPT = 16


def moving_states(mission: Mission) -> list[int]:
    """Return the rows of the plant's state that the linear loop has: what is regulated, then what swings."""
    places = [mission.truth.state.place(name) for name in mission.swinging]
    return rows_of(mission) + [row for place in places for row in range(place.start, place.stop)]


def state_at_rest(mission: Mission) -> np.ndarray:
    """Return the plant's state at the target with what swings at rest."""
    x = target_state(mission)
    for name, values in mission.swinging.items():
        x[mission.truth.state.place(name)] = values
    return x


@lru_cache(maxsize=_KEPT)
def loop_at(mission: Mission, scheme: Scheme, t: float) -> LinearLoop:
    """Return the linear loop at time t [s]; asked again, the same."""
    return LinearLoop(mission, scheme, t)


@dataclass(frozen=True, eq=False)
class LinearLoop:
    """Linearise the loop of one scheme at time `t` [s]."""

    mission: Mission
    scheme: Scheme
    t: float

    @property
    def sampled(self) -> bool:
        """Whether `matrix` is a map from sample to sample; else it is a slope [1/s]."""
        return self.mission.timing.mode == "sampled"

    @cached_property
    def matrix(self) -> np.ndarray:
        """The Jacobian over what is regulated, then what swings, then the memory."""
        return self._jacobians[0]

    @property
    def moving(self) -> np.ndarray:
        """The `matrix` without memory that nothing moves, to first order: estimates that rest at the target."""
        return _without_still(self.matrix, self.sampled)

    @property
    def delayed_moving(self) -> np.ndarray:
        """The `delayed` map without memory that nothing moves."""
        return _without_still(self.delayed, self.sampled)

    @property
    def exists(self) -> bool:
        """Whether the loop has a slope at its target; laws with roots of the error have none."""
        return all(np.isfinite(each).all() for each in self._jacobians)

    @cached_property
    def memory_when_saturated(self) -> np.ndarray:
        """The Jacobian of the memory alone, of what moves, while measurement and achieved effort stand still."""
        return _without_still(self._jacobians[1], self.sampled)

    @cached_property
    def delayed(self) -> np.ndarray:
        """The sampled map with one more sample period between measurement and actuators."""
        a, b, c, d = self._jacobians[2:6]
        # State: (regulated, memory, actuators still on their way); these act on the plant now.
        n, k = a.shape[0], b.shape[1]
        top = np.hstack([a, b])
        return np.vstack([top, np.hstack([c, d])]) if n + k else np.zeros((0, 0))

    @property
    def pushed_by_actuators(self) -> np.ndarray:
        """What actuators do beside what was asked, of which the law hears: to regulated states and memory, (n, N)."""
        return self._jacobians[6]

    @property
    def pushed_by_efforts(self) -> np.ndarray:
        """What a held effort does of which the law does not hear: to regulated states and memory, (n, R).

        NaN where the actuators do not make every effort.
        """
        pushed, effectiveness = self._jacobians[3], self._jacobians[7]
        if np.linalg.matrix_rank(effectiveness) < len(effectiveness):
            return np.full((len(pushed), len(effectiveness)), np.nan)
        return pushed @ np.linalg.pinv(effectiveness)

    def held_by(self, push: np.ndarray) -> np.ndarray:
        """Return where pushes that last, (n, k), hold regulated states and memory, (n, k); NaN where nothing rests."""
        moves = moving_rows(self.matrix, self.sampled)
        inner = self.matrix[np.ix_(moves, moves)]
        growth = spectral_radius(inner if self.sampled else linalg.expm(inner))
        found = np.full(push.shape, 0.0 if growth < 1 else np.nan)
        if growth < 1:
            found[moves] = np.linalg.solve((np.eye(len(inner)) if self.sampled else 0.0) - inner, push[moves])
        return found

    @cached_property
    def _jacobians(self) -> tuple[np.ndarray, ...]:
        (x0, m0), (_, point) = self.target, _functions(self.mission, self.scheme)
        told, late = (np.zeros(point.size1_in(i)) for i in (3, 4))
        found: Any = point(self.t, x0, m0, told, late)
        return tuple(np.array(ca.DM(each).full()) for each in found)

    @cached_property
    def target(self) -> tuple[np.ndarray, np.ndarray]:
        """The plant's state at the target, and the memory that a law starts with there."""
        mission = self.mission
        x0 = state_at_rest(mission)
        y0 = ca.DM(mission.truth.measure(self.t, ca.DM(x0), mission.quiet()))
        m0 = ca.DM(Loop(mission, self.scheme).started(ca.DM(self.t), y0))
        return x0, np.array(m0).ravel()

    @lru_cache(maxsize=1)  # noqa: B019 - loops are few and kept by `loop_at` anyway
    def pushed(self, samples: int) -> np.ndarray:
        """Return where what depends on time drives the loop from its target: regulated states, (samples, n)."""
        mission, rows = self.mission, moving_states(self.mission)
        x0, m0 = self.target
        h = mission.timing.duration / samples
        times = np.arange(samples) * h
        closed, _ = _functions(mission, self.scheme)
        t = ca.SX.sym("t")
        folded = ca.cse(closed(t, ca.DM(x0), ca.DM(m0)))  # all but time is a number
        at_rest = ca.Function("at_rest", [t], [folded])
        moved = np.array(at_rest.map(samples)(times + (0 if self.sampled else h / 2))).T
        size = self.matrix.shape[0]
        if self.sampled:
            step, push = self.matrix, moved - np.concatenate([x0[rows], m0])
        else:
            # exp of [[A, I], [0, 0]] h holds the exact step and the exact effect of a held push.
            joint = linalg.expm(h * np.block([[self.matrix, np.eye(size)], [np.zeros((size, 2 * size))]]))
            step, push = joint[:size, :size], moved @ joint[:size, size:].T
        return driven(step, push)[:, : len(rows_of(mission))]


def driven_at_the_end(mission: Mission, scheme: Scheme, part: float) -> np.ndarray | None:
    """Return where the disturbance drives the regulated states in the last part of the flight, (K, n).

    None where the loop has no slope at its target.
    """
    loop = loop_at(mission, scheme, mission.timing.duration)
    samples = mission.timing.samples - 1 if loop.sampled else min(mission.timing.samples - 1, _SAMPLES)
    if not np.isfinite(loop.matrix).all():
        return None
    with np.errstate(over="ignore", invalid="ignore"):
        return loop.pushed(samples)[samples - int(part * samples) :]


def driven(step: np.ndarray, push: np.ndarray) -> np.ndarray:
    """Return the states s_0 = 0, s_(k+1) = step s_k + push_k, (K, n), as sqrt(K) paths that go on side by side.

    Each path begins at 0; then what it begins with in truth, the end of the one before, is carried through it.

    Parameters
    ----------
    step : (n, n).
    push : (K, n); the last one moves no state that is returned.
    """
    count, size = push.shape
    length = math.isqrt(count) + 1
    paths = -(-count // length)
    padded = np.zeros((paths * length, size))
    padded[1:count] = push[:-1]
    path = np.ascontiguousarray(padded.reshape(paths, length, size).transpose(1, 0, 2))  # step, path, state
    whole = np.eye(size)  # of the step, `length` times

    def moved(states: np.ndarray) -> np.ndarray:
        # An unstable part grows beyond all numbers; what it does not touch goes on.
        return np.clip(states @ step.T, -_HUGE, _HUGE)

    for k in range(length):
        path[k] += moved(path[k - 1]) if k else 0.0
        whole = moved(whole)
    begun = np.zeros((paths, size))
    for i in range(1, paths):
        begun[i] = np.clip(begun[i - 1] @ whole + path[-1, i - 1], -_HUGE, _HUGE)
    for k in range(length):
        begun = moved(begun)
        path[k] += begun
    return np.clip(path.transpose(1, 0, 2).reshape(-1, size)[:count], -_HUGE, _HUGE)


@lru_cache(maxsize=_KEPT)
def _functions(mission: Mission, scheme: Scheme) -> tuple[ca.Function, ca.Function]:
    """Return (t, x, m) -> regulated states and memory, moved, or their rates; and the Jacobians of that."""
    loop = Loop(mission, scheme, averaged=True)
    s, quiet, sampled = loop.symbols(), mission.quiet(), mission.timing.mode == "sampled"
    y = loop.sensed(s.t, s.x, quiet)
    seen = loop.seen(y)
    remembered, wanted = loop.commanded(s.t, seen, s.m)
    actuators = unlimited(mission, scheme, y, wanted)
    told = ca.SX.sym("told", wanted.numel())
    x = _moved(mission)(s.t, s.x, s.actuators)
    if sampled:
        later = loop.advanced(s.t, seen, remembered, wanted, told)
    else:
        later = loop.flowing(s.t, seen, remembered, wanted, told)
    made, effectiveness = loop.made(y, actuators), ca.SX(_effectiveness(loop, y))
    rows, late = moving_states(mission), s.actuators
    state = ca.vertcat(s.x[rows], s.m)
    closed = ca.vertcat(ca.substitute(x, late, actuators)[rows], ca.substitute(later, told, made))
    # With a sample of delay the actuators are a state: the plant feels the old, the law sets the new.
    waiting = ca.vertcat(x[rows], ca.substitute(later, told, made))
    slopes = [
        ca.jacobian(closed, state),
        ca.jacobian(later, s.m) if s.m.numel() else ca.SX(0, 0),
        ca.jacobian(waiting, state),
        ca.jacobian(waiting, late),
        ca.jacobian(actuators, state),
        ca.jacobian(actuators, late),
        ca.vertcat(ca.jacobian(x[rows], late), ca.mtimes(ca.jacobian(later, told), effectiveness)),
        effectiveness,
    ]
    return (
        ca.Function("closed", [s.t, s.x, s.m], [closed]),
        ca.Function("jacobians", [s.t, s.x, s.m, told, late], slopes),
    )


def _effectiveness(loop: Loop, y: Any) -> Any:
    """Return what the flight software believes that each actuator makes, (R, N)."""
    return loop.actuation.matrix(loop.plant.measurement.split(y))


@lru_cache(maxsize=_KEPT)
def _moved(mission: Mission) -> ca.Function:
    """Return (t, x, actuators) -> the plant's state one sample later, or its rate; the same for all schemes."""
    loop = Loop(mission, mission.schemes[0], averaged=True)
    s, moves = loop.symbols(), loop.held if mission.timing.mode == "sampled" else loop.moved
    return ca.Function("moved", [s.t, s.x, s.actuators], [moves(s.t, s.x, s.actuators, mission.quiet())])


def _without_still(matrix: np.ndarray, sampled: bool) -> np.ndarray:
    """Return the matrix without the states that stay what they are, whatever the others do."""
    moves = moving_rows(matrix, sampled)
    return matrix[np.ix_(moves, moves)]


def moving_rows(matrix: np.ndarray, sampled: bool) -> np.ndarray:
    """Return which states of a map, or a slope, do not stay what they are whatever the others do."""
    still = np.eye(len(matrix)) if sampled else np.zeros(matrix.shape)
    return np.any(~np.isclose(matrix, still, rtol=0.0, atol=1e-12), axis=1) if matrix.size else np.zeros(0, dtype=bool)


@lru_cache(maxsize=_KEPT)
def command_slope(mission: Mission, scheme: Scheme) -> tuple[np.ndarray, np.ndarray]:
    """Return d(command)/d(measurement) at the target at the end of the flight, and that measurement; kept."""
    loop, seen = Loop(mission, scheme), mission.truth.measurement.symbol("y")
    y = ca.DM(mission.truth.measure(0.0, ca.DM(target_state(mission)), mission.quiet()))
    memory = ca.DM(loop.started(ca.DM(0.0), y))
    _, wanted = loop.commanded(ca.DM(mission.timing.duration), loop.seen(seen), memory)
    command = ca.SX(wanted)
    slope = ca.Function("slope", [seen], [ca.jacobian(command, seen)])
    return np.array(ca.DM(slope(y)).full()), np.array(y).ravel()


def spectral_radius(matrix: np.ndarray) -> float:
    """Return the largest magnitude of an eigenvalue; 0 for an empty matrix, NaN where it has no number."""
    if not matrix.size:
        return 0.0
    return float(np.abs(np.linalg.eigvals(matrix)).max()) if np.isfinite(matrix).all() else float("nan")
