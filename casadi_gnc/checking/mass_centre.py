"""How far off the true centre of mass may be before a loop, linearised at its target, is unstable.

What pushes a craft beside its centre of mass turns it: a thruster at r with direction e makes (r - c) x e about the
centre c, and the flight software shares its efforts out by the c that it knows. With the true one off by d,

    s(k+1) = A(d) s(k),   or   s' = A(d) s,

s the deviation of what is regulated, of what swings and of the law's memory. A is exact in d: it is evaluated as it is,
no slope by d is taken. Limits of actuators, and loads that shift where the loop rests, are left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.checking.linear import held, loop_at, moving_rows, moving_states
from casadi_gnc.checking.sampling import ROUNDING, settled
from casadi_gnc.errors import GncError
from casadi_gnc.missions.linear_plant import unlimited
from casadi_gnc.missions.loop import Loop
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.parameters import Varied, vary
from casadi_gnc.missions.scheme import Scheme

#: Distances that are looked at along an axis, [m], so many each factor of ten.
_NEAREST, _FARTHEST, _EACH_DECADE = 1e-4, 1e3, 12
#: Directions beside the axes in which a nearer bound is looked for, from this share of the nearest that is known.
_DIRECTIONS, _SHARE = 96, 0.03
#: A bound is found to this part of it, and the search for the nearest one ends after so many directions more.
_FINE, _REFINED = 1e-7, 40
#: Slopes that change by no more than this share, from no error to one of a metre, are the same.
_SAME = 1e-12


@dataclass(frozen=True, eq=False)
class MassCentreBounds:
    """Hold between which errors of the mass centre a linear loop is stable.

    Parameters
    ----------
    key : of a file, of the error, true minus known, (3,), [m]; "" where the craft has none.
    low, high : (3,), [m], ends along each axis of the key's frame, the other two without error; -inf and inf where it
        stays stable as far as a kilometre.
    nearest : the least distance at which it becomes unstable, of all directions that were looked at, [m]; inf for none.
    towards : (3,), that direction, a unit vector; NaN for none.
    why : why there is no bound at all, "" where there is one.
    """

    key: str
    low: tuple[float, ...] = (-math.inf,) * 3
    high: tuple[float, ...] = (math.inf,) * 3
    nearest: float = math.inf
    towards: tuple[float, ...] = (math.nan,) * 3
    why: str = ""


def mass_centre_bounds(mission: Mission, scheme: Scheme) -> MassCentreBounds:
    """Return the bounds of the mass centre for a scheme at its target, held still where it moves."""
    mission, scheme = held(mission, scheme)
    key = mission.craft.mass_centre_key()
    if not key:
        return MassCentreBounds("", why="no force acts beside the centre of mass")
    try:
        matrices = _matrices(vary(mission, [key], scheme.name), settled(mission))
    except GncError as error:  # of a craft that decides by the number
        return MassCentreBounds(key, why=str(error))
    first, moved = matrices(np.zeros((1, 3)))[0], matrices(np.eye(3))
    if not np.isfinite(first).all():
        return MassCentreBounds(key, why="the law has no slope at its target")
    if np.abs(moved - first).max(initial=0.0) <= _SAME * np.abs(first).max(initial=0.0):
        return MassCentreBounds(key, why="no force acts beside the centre of mass")
    sampled = mission.timing.mode == "sampled"
    # A state that nothing moves, with or without an error, has a pole on the boundary that never leaves it.
    kept = np.any([moving_rows(each, sampled) for each in (first, *moved)], axis=0)

    def unstable(errors: np.ndarray) -> np.ndarray:
        poles = np.linalg.eigvals(matrices(errors)[:, kept][:, :, kept])
        return np.max(np.abs(poles) - 1 if sampled else poles.real, axis=-1, initial=-math.inf) > ROUNDING

    if unstable(np.zeros((1, 3)))[0]:
        return MassCentreBounds(key, why="the loop is not stable where the mass centre is the known one")
    axes = np.vstack([-np.eye(3), np.eye(3)])
    ends = [reach(unstable, axis) for axis in axes]
    nearest, towards = _nearest(unstable, ends, axes)
    return MassCentreBounds(
        key, tuple(-end for end in ends[:3]), tuple(ends[3:]), nearest, tuple(float(each) for each in towards)
    )


def reach(
    unstable: Callable[[np.ndarray], np.ndarray],
    direction: np.ndarray,
    nearest: float = _NEAREST,
    farthest: float = _FARTHEST,
) -> float:
    """Return the first distance [m] in a direction, (3,), at which a loop is unstable; inf for none.

    Parameters
    ----------
    unstable : errors (n, 3) -> (n,).
    direction : (3,), a unit vector.
    nearest, farthest : between which distances are looked at, [m].
    """
    count = math.ceil(math.log10(farthest / nearest) * _EACH_DECADE) + 1
    distances = np.append(0.0, np.geomspace(nearest, farthest, count))
    outside = np.flatnonzero(unstable(distances[:, None] * direction))
    if not len(outside):
        return math.inf
    stable, beyond = float(distances[outside[0] - 1]), float(distances[outside[0]])
    while beyond - stable > _FINE * beyond:
        middle = 0.5 * (stable + beyond)
        stable, beyond = (stable, middle) if unstable(middle * direction[None, :])[0] else (middle, beyond)
    return stable


def _nearest(
    unstable: Callable[[np.ndarray], np.ndarray], ends: list[float], axes: np.ndarray
) -> tuple[float, np.ndarray]:
    """Return the least distance of all directions, refined about the least of many, and its direction."""
    from scipy import optimize  # a flight does without

    steps = np.arange(_DIRECTIONS) + 0.5  # a spiral with points evenly over the sphere
    height, turn = 1 - 2 * steps / _DIRECTIONS, math.pi * (3 - math.sqrt(5)) * steps
    flat = np.sqrt(1 - height**2)
    best, towards = min(ends), axes[int(np.argmin(ends))]
    for way in np.column_stack([flat * np.cos(turn), flat * np.sin(turn), height]):
        farthest = min(best, _FARTHEST)
        told = reach(unstable, way, _SHARE * farthest, farthest)
        if told < best:
            best, towards = told, way
    if math.isinf(best):
        return math.inf, np.full(3, math.nan)

    def distance(way: np.ndarray) -> float:
        told = reach(unstable, way / np.linalg.norm(way), _SHARE * best, 2 * best)
        return min(told, 2 * best)

    options = {"maxfev": _REFINED, "initial_simplex": towards + 0.15 * np.vstack([np.zeros(3), np.eye(3)])}
    found = optimize.minimize(distance, towards, method="Nelder-Mead", options=options)
    way = found.x / np.linalg.norm(found.x)
    return (float(found.fun), way) if found.fun < best else (best, towards)


def _matrices(varied: Varied, t: float) -> Callable[[np.ndarray], np.ndarray]:
    """Return errors (n, 3) -> A, (n, states, states)."""
    mission, scheme = varied.mission, varied.scheme
    loop, sampled = Loop(mission, scheme, averaged=True), mission.timing.mode == "sampled"
    s, quiet, rows = loop.symbols(), mission.quiet(), moving_states(mission)
    y = loop.sensed(s.t, s.x, quiet)
    seen = loop.seen(y)
    remembered, wanted = loop.commanded(s.t, seen, s.m)
    actuators = unlimited(mission, scheme, y, wanted)
    x = (loop.held if sampled else loop.moved)(s.t, s.x, actuators, quiet)
    later = (loop.advanced if sampled else loop.flowing)(s.t, seen, remembered, wanted, loop.made(y, actuators))
    slope = ca.densify(ca.SX(ca.jacobian(ca.vertcat(x[rows], later), ca.vertcat(s.x[rows], s.m))))
    nominal = varied.nominal
    x0, m0 = loop_at(nominal, nominal.schemes[0], t).target
    general = ca.Function("general", [varied.parameters.symbols, s.t, s.x, s.m], [slope])
    error = ca.SX.sym("error", 3)
    folded = ca.cse(general(error, ca.DM(t), ca.DM(x0), ca.DM(m0)))  # all but the error is a number
    function = ca.Function("slope", [error], [folded])
    size = slope.shape[0]

    def at(errors: np.ndarray) -> np.ndarray:
        found: Any = function.map(len(errors))(errors.T)
        return np.array(ca.DM(found)).reshape(size, len(errors), size).transpose(1, 0, 2)

    return at
