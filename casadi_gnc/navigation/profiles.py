"""Attitudes by time alone: a slew about one axis, and a table.

Source of the slew's profile: the time-optimal turn of one axis, bang, coast, bang. The table's spline is the natural
cubic one (de Boor, A Practical Guide to Splines (1978), chapter IV), of each element of the quaternion.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import casadi as ca

from casadi_gnc.errors import LawError, ProblemError
from casadi_gnc.mathematics import exact
from casadi_gnc.mathematics.exact import array
from casadi_gnc.mechanics import quaternions
from casadi_gnc.navigation._navigation import Reference, Wanted
from casadi_gnc.system import csv_file

#: Most rows of a table: each costs time in every sample.
MOST_ROWS = 200
#: Columns of a file that `Table.read` reads.
COLUMNS = ["t", "q0", "q1", "q2", "q3"]


def _flaw(times: Sequence[float], rows: Sequence[Sequence[float]], i: int) -> str:
    """Return what is wrong with row i of a table, or nothing."""
    row = rows[i]
    if not math.isfinite(times[i]):
        return f"row {i + 1} of the table is at {times[i]:g} s, expected a time"
    if len(row) != 4 or not abs(sum(each * each for each in row) - 1) < 1e-5:
        return f"row {i + 1} of the table, {list(row)}, is no unit quaternion of four numbers, scalar first"
    if i == 0:
        return ""
    if not times[i] > times[i - 1]:
        return f"row {i + 1} of the table is at {times[i]:g} s, not after row {i}, {times[i - 1]:g} s"
    near = abs(sum(a * b for a, b in zip(row, rows[i - 1], strict=True)))
    if near < math.cos(math.pi / 4):
        turn = math.degrees(2 * math.acos(min(1.0, near)))
        return (
            f"the table jumps by {turn:.0f} degrees from {times[i - 1]:g} s to {times[i]:g} s, "
            "expected at most 90 from row to row; give rows in between"
        )
    return ""


@dataclass(frozen=True, eq=False)
class Slew(Reference):
    """Turn from one attitude to another about their common axis, at most at a rate and with an acceleration.

    The rate is a trapezoid, or a triangle where the turn is short: constant acceleration, constant rate, constant
    deceleration. Before the start and after the end the attitude stands.

    Parameters
    ----------
    first, last : quaternions, (4,), of the wanted frame from inertial.
    rate : largest, [rad/s].
    acceleration : largest, [rad/s^2].
    start : time at which it begins, [s].
    """

    first: Sequence[float]
    last: Sequence[float]
    rate: float
    acceleration: float
    start: float = 0.0

    def __post_init__(self) -> None:
        for name in ("rate", "acceleration"):
            if not getattr(self, name) > 0:
                raise LawError(f"the slew's {name} is {getattr(self, name):g}, expected more than 0")

    @property
    def turn(self) -> tuple[list[float], float]:
        """Axis, (3,), and angle, [rad], of the turn, the short way."""
        turn = quaternions.short_way(quaternions.relative(ca.DM(list(self.last)), ca.DM(list(self.first))))
        sine = exact.sqrt(float(ca.sumsqr(turn[1:])))
        if sine == 0.0:
            return [1.0, 0.0, 0.0], 0.0
        return [float(turn[i]) / sine for i in (1, 2, 3)], 2 * exact.angle(float(turn[0]), sine)

    @property
    def times(self) -> tuple[float, float]:
        """How long it speeds up, and how long it lasts, [s]."""
        angle = self.turn[1]
        rising = min(self.rate / self.acceleration, exact.sqrt(angle / self.acceleration))
        return rising, (angle / (self.acceleration * rising) + rising if angle > 0 else 0.0)

    def at(self, t: Any, known: Any) -> Wanted:
        """Return what is wanted at time t [s]."""
        (axis, angle), (rising, whole) = self.turn, self.times
        if angle == 0.0:
            return Wanted(array(list(self.first)))
        fast, since = self.acceleration * rising, t - self.start
        left = whole - since
        early, late = since < rising, left < rising
        gone = ca.if_else(
            since <= 0,
            0.0,
            ca.if_else(
                left <= 0,
                angle,
                ca.if_else(
                    early,
                    self.acceleration * since * since / 2,
                    ca.if_else(late, angle - self.acceleration * left * left / 2, fast * (since - rising / 2)),
                ),
            ),
        )
        moving = ca.logic_and(since > 0, left > 0)
        speed = ca.if_else(early, self.acceleration * since, ca.if_else(late, self.acceleration * left, fast))
        push = ca.if_else(early, self.acceleration, ca.if_else(late, -self.acceleration, 0.0))
        about = ca.DM(axis)
        quaternion = quaternions.compose(
            ca.vertcat(ca.cos(gone / 2), about * ca.sin(gone / 2)), ca.SX(ca.DM(list(self.first)))
        )
        return Wanted(quaternion, about * ca.if_else(moving, speed, 0.0), about * ca.if_else(moving, push, 0.0))


@dataclass(frozen=True, eq=False)
class Table(Reference):
    """Follow a table of attitudes: a cubic spline through it, so that rate and acceleration are continuous.

    Before the first time and after the last one, the attitude stands.

    Parameters
    ----------
    times : K, rising, [s].
    quaternions : K rows of four numbers, scalar first, of unit length; q and -q are told apart for nearness alone.

    Raises
    ------
    LawError
        For times that do not rise, rows that are no attitude, and neighbours more than a quarter turn apart.
    """

    times: Sequence[float]
    quaternions: Sequence[Sequence[float]]

    def __post_init__(self) -> None:
        times, rows = [float(t) for t in self.times], [[float(each) for each in row] for row in self.quaternions]
        if not 2 <= len(times) == len(rows) <= MOST_ROWS:
            raise LawError(
                f"a table of {len(times)} times and {len(rows)} attitudes, expected as many, 2 to {MOST_ROWS} rows"
            )
        for i, row in enumerate(rows):
            flaw = _flaw(times, rows, i)
            if flaw:
                raise LawError(flaw)
            if i > 0 and sum(a * b for a, b in zip(row, rows[i - 1], strict=True)) < 0:
                rows[i] = [-each for each in row]
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "quaternions", rows)

    @classmethod
    def read(cls, path: str | Path) -> Table:
        """Return the table of a CSV file with the columns t, q0, q1, q2, q3: times [s] and quaternions, scalar first.

        Raises
        ------
        ProblemError
            For a file that cannot be read, another line of names, what is no number, and a row that is no attitude or
            does not follow the one before; with the line.
        LawError
            For too few rows, or too many.
        """
        table = csv_file.read_table(Path(path))
        if table.names != COLUMNS:
            told = f"has the columns {', '.join(table.names)}, expected {', '.join(COLUMNS)}"
            raise ProblemError(told, f"{table.path.name}, line {table.line}")
        rows = table.column_numbers(COLUMNS)
        for i, (line, _) in enumerate(table.rows):
            flaw = _flaw([row[0] for row in rows], [row[1:] for row in rows], i)
            if flaw:
                raise ProblemError(flaw, f"{table.path.name}, line {line}")
        return cls([row[0] for row in rows], [row[1:] for row in rows])

    def at(self, t: Any, known: Any) -> Wanted:
        """Return what is wanted at time t [s]."""
        inside = ca.logic_and(t > self.times[0], t < self.times[-1])
        now = ca.if_else(t > self.times[0], ca.if_else(inside, t, self.times[-1]), self.times[0])
        symbol = ca.SX.sym("t")
        path = quaternions.normalised(ca.vertcat(*(self._spline(symbol, i) for i in range(4))))
        moving = ca.jacobian(path, symbol)
        rate = 2 * (path[0] * moving[1:] - moving[0] * path[1:] - ca.cross(path[1:], moving[1:]))
        told = ca.substitute(ca.vertcat(path, rate, ca.jacobian(rate, symbol)), symbol, ca.SX(now))
        return Wanted(told[:4], ca.if_else(inside, told[4:7], 0.0), ca.if_else(inside, told[7:], 0.0))

    def _spline(self, t: Any, i: int) -> Any:
        """Return element i of the spline, inside the table."""
        values = [row[i] for row in self.quaternions]
        bends = _bends(self.times, values)
        found: Any = None
        for k in reversed(range(len(values) - 1)):
            h = self.times[k + 1] - self.times[k]
            a, b = (t - self.times[k]) / h, (self.times[k + 1] - t) / h
            curve = (a**3 - a) * bends[k + 1] + (b**3 - b) * bends[k]
            piece = a * values[k + 1] + b * values[k] + h * h / 6 * curve
            found = piece if found is None else ca.if_else(t < self.times[k + 1], piece, found)
        return found


def _bends(times: Sequence[float], values: Sequence[float]) -> list[float]:
    """Return the second derivatives of the natural cubic spline at its knots, by elimination."""
    count = len(times)
    upper, right, steps = [0.0] * count, [0.0] * count, [b - a for a, b in pairwise(times)]
    for k in range(1, count - 1):
        slope = (values[k + 1] - values[k]) / steps[k] - (values[k] - values[k - 1]) / steps[k - 1]
        pivot = 2 * (steps[k - 1] + steps[k]) - steps[k - 1] * upper[k - 1]
        upper[k], right[k] = steps[k] / pivot, (6 * slope - steps[k - 1] * right[k - 1]) / pivot
    bends = [0.0] * count
    for k in reversed(range(1, count - 1)):
        bends[k] = right[k] - upper[k] * bends[k + 1]
    return bends
