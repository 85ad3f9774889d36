"""The linear loop of a mission of which some numbers are known within intervals only.

s' = A(p) s + b(t, p), s the deviation from the target of what is regulated and of the law's memory, p what varies,
the same during a flight. Of p within its box, centre c and half widths,

    A(p) = A(c) + sum_i d_i A_i + E,     abs(d_i) <= 1, abs(E) <= `A.rest`,

and the same of b and of the start. A_i is the middle of the slopes by p_i over the whole box, by intervals, and the
rest is what their width leaves: where A is affine in p it is rounding.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.errors import FlightError
from casadi_gnc.mathematics.intervals import Interval, enclose
from casadi_gnc.missions.linear_plant import rows_of, unlimited
from casadi_gnc.missions.loop import Loop
from casadi_gnc.missions.parameters import Varied
from casadi_gnc.synthesis.contraction import UncertainMap

#: Share of the largest entry below which a difference is rounding.
_ROUNDING = 1e-11
#: Singular values of perturbations below this share of the largest go to the rest: inequalities stay small.
_SMALL = 0.03


@dataclass(frozen=True, eq=False)
class Cover:
    """Hold numbers that depend on what varies: `centre` + sum_i d_i `parts`[i] + what is within `rest`.

    Parameters
    ----------
    centre : (m, ...).
    parts : (P, m, ...).
    rest : (m, ...), at least 0.
    """

    centre: np.ndarray
    parts: np.ndarray
    rest: np.ndarray


@dataclass(frozen=True, eq=False)
class UncertainLoop:
    """Hold the loop, sampled.

    Parameters
    ----------
    A : (n n,), by columns. b : (n, K), at each sample. start : (n,), of s.
    target : (n,), where s is 0.
    regulated : rows of the plant's state that come first in s; then comes the memory.
    loop : the composed sample, with symbols for what varies.
    box : of these, (P,).
    exact : whether the loop is this one but for limits and noise: no slope depends on the state, on time, or on what
        is not in s and moves.
    """

    A: Cover
    b: Cover
    start: Cover
    target: np.ndarray
    regulated: tuple[int, ...]
    loop: Loop
    varied: Varied
    box: Interval
    exact: bool

    @property
    def size(self) -> int:
        """Number of states."""
        return len(self.target)

    def square(self, entries: np.ndarray) -> np.ndarray:
        """Return a matrix from its entries by columns."""
        return entries.reshape(self.size, self.size).T

    def as_map(self, units: np.ndarray) -> UncertainMap:
        """Return the map with s divided by units, (n,).

        It has a perturbation for each part that is not small, and for each row of the rest with what is small.
        """
        left, right = [], []

        def scaled(matrix: np.ndarray) -> np.ndarray:
            return matrix * units / units[:, None]

        nominal = scaled(self.square(self.A.centre))
        least = _ROUNDING * np.abs(nominal).max(initial=1.0)
        rest = scaled(self.square(self.A.rest))
        parts = [np.linalg.svd(scaled(self.square(entries))) for entries in self.A.parts]
        small = max(least, _SMALL * max((sizes.max(initial=0.0) for _, sizes, _ in parts), default=0.0))
        for u, sizes, v in parts:
            rank = int((sizes > small).sum())
            rest += np.abs((u[:, rank:] * sizes[rank:]) @ v[rank:])
            if rank:
                root = np.sqrt(sizes[:rank])
                left.append(u[:, :rank] * root)
                right.append(root[:, None] * v[:rank])
        for row in np.flatnonzero((rest > least).any(axis=1)):  # abs(E_row s) <= norm of sqrt(entries) (rest_row s)
            entries = rest[row] > least
            left.append(np.eye(self.size)[:, [row]])
            right.append((math.sqrt(entries.sum()) * np.diag(rest[row]))[entries])
        return UncertainMap(nominal, tuple(left), tuple(right))


def uncertain_loop(varied: Varied, low: np.ndarray, high: np.ndarray) -> UncertainLoop:
    """Return the linear loop of a sampled mission whose numbers vary within a box.

    Parameters
    ----------
    varied : the mission, with symbols for what varies.
    low, high : (P,), ends of each.

    Raises
    ------
    FlightError
        Where there is no linear loop, or what varies enters in a way that no interval bounds.
    """
    mission, scheme, p = varied.mission, varied.scheme, varied.parameters.symbols
    name = varied.nominal.name
    if not mission.target:
        raise FlightError(f"{name} says no target at which its loop could be linearised")
    if mission.timing.mode != "sampled":
        raise FlightError(f"{name} flies in continuous time, and what is proved is of a map from sample to sample")
    if varied.nominal.craft.held(varied.nominal) is not None:
        raise FlightError(f"the target of {name} moves")
    loop = Loop(mission, scheme, averaged=True)
    s, quiet, rows = loop.symbols(), mission.quiet(), rows_of(mission)
    y = loop.sensed(s.t, s.x, quiet)
    seen = loop.seen(y)
    memory, wanted = loop.commanded(s.t, seen, s.m)
    actuators = unlimited(mission, scheme, y, wanted)
    x = loop.held(s.t, s.x, actuators, quiet)
    later = loop.advanced(s.t, seen, memory, wanted, loop.made(y, actuators))
    state = ca.vertcat(s.x[rows], s.m)
    closed = ca.vertcat(x[rows], later)
    slope = ca.jacobian(closed, state)
    first = ca.vertcat(*mission.start)
    rest = [row for row in range(first.numel()) if row not in rows]
    moving = [row for row in rest if not ca.is_equal(x[row], s.x[row], 2)]
    outside = ca.vertcat(*[s.x[row] for row in moving], ca.SX(0, 1))
    exact = not (ca.depends_on(slope, ca.vertcat(s.t, state, outside)) or ca.depends_on(closed, outside))
    exact = exact and scheme.actuation.modulation is None

    at_target = ca.SX(first)
    for signal, values in mission.target.items():
        at_target[mission.truth.state.place(signal)] = ca.DM(values)
    begun = [loop.started(ca.SX(0), loop.sensed(ca.SX(0), each, quiet)) for each in (first, at_target)]
    centre, half = 0.5 * (low + high), 0.5 * (high - low)
    reference: Any = ca.Function("target", [p], [ca.vertcat(at_target[rows], begun[1])])(centre)
    target = np.array(ca.DM(reference)).ravel()
    here = ca.SX(at_target)
    here[rows] = ca.DM(target[: len(rows)])
    known = ca.vertcat(s.x, s.m), ca.vertcat(here, ca.DM(target[len(rows) :]))
    slope, pushed = ca.substitute([ca.vec(ca.densify(slope)), closed - ca.DM(target)], [known[0]], [known[1]])
    if ca.depends_on(slope, s.t):
        raise FlightError(f"the linear loop of {name} changes with time")
    times = mission.timing.sample_period * np.arange(mission.timing.samples)
    if not ca.depends_on(pushed, s.t):
        times = times[:1]
    keys = varied.parameters.keys
    b = _cover(pushed, s.t, p, keys, times, centre, half)
    count = mission.timing.samples
    return UncertainLoop(
        A=_first(_cover(slope, s.t, p, keys, times[:1], centre, half)),
        b=Cover(*(np.broadcast_to(each, (*each.shape[:-1], count)) for each in (b.centre, b.parts, b.rest))),
        start=_first(_cover(ca.vertcat(first[rows], begun[0]) - target, s.t, p, keys, times[:1], centre, half)),
        target=target,
        regulated=tuple(rows),
        loop=loop,
        varied=varied,
        box=Interval(low, high),
        exact=exact,
    )


def _first(cover: Cover) -> Cover:
    return Cover(cover.centre[..., 0], cover.parts[..., 0], cover.rest[..., 0])


def _cover(
    expression: Any, t: Any, p: Any, keys: tuple[str, ...], times: np.ndarray, centre: np.ndarray, half: np.ndarray
) -> Cover:
    """Return the cover of a column over the box, (m, K) at times, (K,)."""
    column = ca.densify(ca.SX(expression))
    value = ca.Function("value", [t, p], [column])
    slopes = ca.Function("slopes", [t, p], [ca.densify(ca.cse(ca.jacobian(column, p)))])
    m, count, width = column.numel(), len(keys), len(times)
    at = Interval.of(times[None, :])
    box = Interval(*(np.broadcast_to((centre + side * half)[:, None], (count, width)) for side in (-1, 1)))
    (whole,) = enclose(value, [at, box], smooth=True)
    (rate,) = enclose(slopes, [at, box], smooth=True)
    low, high = (each.reshape(count, m, width) for each in (rate.low, rate.high))
    wild = ~(np.isfinite(low) & np.isfinite(high)).all(axis=(1, 2))
    if wild.any():
        raise FlightError(f"how the loop depends on {keys[int(np.argmax(wild))]} is bounded by no interval")
    if whole.is_line.any():
        raise FlightError("the loop has no slope at its target, or jumps within what varies")
    point = Interval.of(np.broadcast_to(centre[:, None], (count, width)))
    (middle,) = enclose(value, [at, point])
    parts = 0.5 * (low + high) * half[:, None, None]
    rest = (0.5 * (high - low) * half[:, None, None]).sum(axis=0) + 0.5 * (middle.high - middle.low)
    return Cover(0.5 * (middle.low + middle.high), parts, rest)
