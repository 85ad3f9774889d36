"""The best pulses of one sample, by mixed-integer programs: what the modulation on board is measured against.

For an effort impulse U that is wanted of a sample of h seconds, thrusters of forces F_max with widths t,

    e(t) = sum_r |U - A F_max t|_r,    p(t) = sum_i M1_i F_max,i t_i,
    t_i in {0} u {d} u {q, 2 q, ... beyond d} u {h},    some pairs never open together, at most n open at all,

first e is made least, then p among the pulses whose error is no larger; or e is held at a value that is given. Widths
are integers, so that no dual bound of ours proves the optimum: HiGHS's own bound of its branch and bound is told. What
is ours is the check of the widths against every rule (`PulseRules.broken`), and the error and the propellant, from the
data.

On the desk only: a branch and bound has no bounded time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from casadi_gnc.allocation.problem import AllocationProblem
from casadi_gnc.allocation.pulses import Pulse, Valves
from casadi_gnc.errors import AllocationError
from casadi_gnc.mathematics.arrays import real_array

_NEAR = 1e-9  # of the quantum or the period: rounding
_SLACK = 1e-9  # of the largest effort impulse: by how much the error may be above the least


@dataclass(frozen=True)
class PulseRules:
    """Say what pulses thrusters can make in one sample.

    Parameters
    ----------
    pulses : of each thruster, (N,); what is carried over is not looked at.
    period : h, [s].
    valves : which may be open together.

    Raises
    ------
    AllocationError
        For a least width above the period, or a quantum that fits in no width from there on.
    """

    pulses: Sequence[Pulse]
    period: float
    valves: Valves = Valves()

    def __post_init__(self) -> None:
        for number, pulse in enumerate(self.pulses, 1):
            pulse.check(number, self.period)
        self.valves.check(len(self.pulses))

    def broken(self, widths: ArrayLike) -> list[str]:
        """Return a sentence for each rule that widths (N,) [s] break."""
        told, t = [], np.asarray(widths, dtype=float)
        for number, (pulse, width) in enumerate(zip(self.pulses, t, strict=True), 1):
            if width == 0.0:
                continue
            near = _NEAR * self.period
            if not pulse.least_on - near <= width <= self.period + near:
                told.append(f"thruster {number}: {width:g} s is not from {pulse.least_on:g} to {self.period:g} s")
            steps = width / pulse.quantum if pulse.quantum else 0.0
            ends = min(abs(width - pulse.least_on), abs(width - self.period)) <= near
            if abs(steps - round(steps)) > 1e-6 and not ends:
                told.append(f"thruster {number}: {width:g} s is no multiple of {pulse.quantum:g} s")
        opened = t > 0
        told += [
            f"thrusters {i + 1} and {j + 1} are open together"
            for i, j in self.valves.never_together
            if opened[i] and opened[j]
        ]
        if self.valves.open_at_most is not None and opened.sum() > self.valves.open_at_most:
            told.append(f"{opened.sum()} valves are open, at most {self.valves.open_at_most} may")
        return told


@dataclass(frozen=True, eq=False)
class BestPulses:
    """Hold the best pulses of a sample.

    Parameters
    ----------
    widths : t, (N,), [s].
    error : e, effort impulse.
    propellant : p.
    bound : HiGHS's lower bound of the propellant.
    """

    widths: np.ndarray
    error: float
    propellant: float
    bound: float


def best_pulses(
    problem: AllocationProblem,
    impulse: ArrayLike,
    rules: PulseRules,
    *,
    error: float | None = None,
    time_limit: float = 10.0,
) -> BestPulses:
    """Return the pulses of least error, and of least propellant among them.

    Parameters
    ----------
    problem : effectiveness A, forces `upper` F_max and propellant per force `effort_weight`; errors of the geometry and
        all else is not looked at.
    impulse : U, (R,), effort times seconds.
    error : the error that is allowed; the least there is where it is left out.
    time_limit : of each program, [s].

    Raises
    ------
    AllocationError
        For wrong shapes, an error that no pulses keep, or a program that is not solved in time.
    """
    wanted = real_array("impulse", impulse, AllocationError)
    rows, count = problem.effectiveness.shape
    if wanted.shape != (rows,) or len(rules.pulses) != count or not np.all(np.isfinite(wanted)):
        raise AllocationError(
            f"impulse has shape {wanted.shape}, expected {rows} finite numbers; {len(rules.pulses)} pulses, "
            f"expected {count}"
        )
    program = _Program(problem, wanted, rules, time_limit)
    if error is None:
        least, _ = program.solve(program.error_cost, np.inf)
        error = program.error_of(least)
    widths, bound = program.solve(program.propellant_cost, error)
    return BestPulses(widths, program.error_of(widths), float(program.price @ widths), bound)


class _Program:
    """x = (steps k, open b, exactly d: a, all of h: f, errors e); widths t = q k + d a + h f, k = 0 unless b."""

    def __init__(self, problem: AllocationProblem, wanted: np.ndarray, rules: PulseRules, time_limit: float) -> None:
        self._rules, self._limit, self._wanted = rules, time_limit, wanted
        count, rows = problem.count, len(wanted)
        self._made = problem.effectiveness * problem.upper
        self.price = problem.effort_weights * problem.upper
        h = rules.period
        self._unit = max(float(np.abs(self._made).sum(axis=1).max()) * h, 1e-300)
        quantum = np.array([pulse.quantum or h for pulse in rules.pulses])
        least = np.array([pulse.least_on for pulse in rules.pulses])
        exact = np.array([bool(pulse.quantum) for pulse in rules.pulses])
        self._quantum, self._least = quantum, least
        low = np.where(exact, np.ceil(least / quantum - _NEAR), least / quantum)
        high = np.where(exact, np.floor(h / quantum + _NEAR), 1.0)
        low = np.where(exact, np.maximum(low, 1.0), low)
        self._count, self._rows = count, rows
        eye, none = np.eye(count), np.zeros((count, count))
        t = np.hstack([np.diag(quantum), none, np.diag(least), h * eye])
        self._width = t
        blocks = [  # low b <= k <= high b, b + a + f <= 1, rules
            (np.hstack([eye, -np.diag(high), none, none]), -np.inf, 0.0),
            (np.hstack([eye, -np.diag(low), none, none]), 0.0, np.inf),
            (np.hstack([none, eye, eye, eye]), -np.inf, 1.0),
        ]
        opened = np.hstack([none, eye, eye, eye])
        pairs = rules.valves.never_together
        if pairs:
            blocks.append((np.array([opened[i] + opened[j] for i, j in pairs]), -np.inf, 1.0))
        if rules.valves.open_at_most is not None:
            blocks.append((opened.sum(axis=0, keepdims=True), -np.inf, float(rules.valves.open_at_most)))
        self._blocks: list[tuple[np.ndarray, Any, Any]] = [
            (np.hstack([block, np.zeros((len(block), rows))]), lo, hi) for block, lo, hi in blocks
        ]
        effort = self._made @ t / self._unit
        for sign in (1.0, -1.0):  # e >= |U - made t|
            self._blocks.append((np.hstack([sign * effort, np.eye(rows)]), sign * wanted / self._unit, np.inf))
        self._upper = np.concatenate([high, np.ones(3 * count), np.full(rows, np.inf)])
        self._upper[2 * count : 3 * count] = least > 0  # a width of zero is no pulse
        self._integral = np.concatenate([exact, np.ones(3 * count), np.zeros(rows)])
        self.error_cost = np.concatenate([np.zeros(4 * count), np.ones(rows)])
        self._most = float(self.price.sum()) * h or 1.0
        self.propellant_cost = np.concatenate([self.price @ t / self._most, np.zeros(rows)])

    def error_of(self, widths: np.ndarray) -> float:
        return float(np.abs(self._wanted - self._made @ widths).sum())

    def solve(self, cost: np.ndarray, error: float) -> tuple[np.ndarray, float]:
        """Return widths, and HiGHS's bound of the cost in its unit."""
        from scipy.optimize import Bounds, LinearConstraint, milp

        rules: list[Any] = [LinearConstraint(block, lo, hi) for block, lo, hi in self._blocks]
        if np.isfinite(error):
            rules.append(LinearConstraint(self.error_cost[None], -np.inf, error / self._unit + _SLACK))
        lower: Any = np.zeros(len(cost))
        upper: Any = self._upper
        found = milp(
            cost,
            constraints=rules,
            integrality=self._integral,
            bounds=Bounds(lower, upper),
            options={"time_limit": self._limit, "mip_rel_gap": 1e-6},
        )
        if found.x is None:
            why = "no pulses keep this error" if found.status == 2 else "no answer in time; give a larger time_limit"
            raise AllocationError(f"the best pulses were not found: {why} (HiGHS: {found.message})")
        x = np.where(self._integral > 0, np.round(found.x), found.x)[: 4 * self._count]
        is_open = x[self._count :].reshape(3, -1).any(axis=0)
        return np.where(is_open, self._width @ x, 0.0), float(found.mip_dual_bound) * self._most
