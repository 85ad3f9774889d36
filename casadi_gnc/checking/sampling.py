"""Can the loop be run at this sample time, or by this integrator?"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.checking.linear import HELD, held, loop_at, spectral_radius
from casadi_gnc.checks import Check
from casadi_gnc.errors import LawError
from casadi_gnc.laws import Law
from casadi_gnc.missions.loop import Loop
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.scheme import Scheme

#: An eigenvalue on the unit circle (an integrator, an estimate that nothing excites) is no instability.
ROUNDING = 1e-6
#: Shortest sample period [s] that is looked at, and the part to which the longest is found.
_SHORTEST, _FINE = 1e-5, 0.01
#: Steps that are searched for jumps at most, and the part of a step within which a jump is at its end.
_MOST_STEPS, _AT_END = 1_000_000, 1e-6


def checks(mission: Mission, scheme: Scheme) -> Iterator[Check]:
    """Yield jumps inside steps, and the stability of the linearised loop at both ends of the flight and delayed."""
    yield from _hold(scheme)
    yield from _jumps(mission, scheme)
    still, own = held(mission, scheme)
    if still.target:
        for each in _linear(still, own):
            yield each if still is mission else replace(each, source=f"{each.source}; {HELD}")


def _linear(mission: Mission, scheme: Scheme) -> Iterator[Check]:
    loops = [loop_at(mission, scheme, t) for t in (0.0, settled(mission))]
    # Printed laws may have gains beyond all numbers late in the flight: that is a finding, not a gap.
    if not loops[0].exists:
        yield Check(
            "sampling.linearisation",
            float("nan"),
            0.0,
            "-",
            "note",
            "The law has no slope at its target, so nothing linear can be said of it.",
            "Fly it, with noise and at several sample times.",
            "Jacobian of the loop at the target",
        )
        return
    h = mission.timing.sample_period
    if mission.timing.mode == "continuous":
        poles: Any = np.concatenate([_eigenvalues(loop.moving) for loop in loops])
        yield Check(
            "sampling.closed_loop",
            float(poles.real.max()) if poles.size else -np.inf,
            ROUNDING,
            "1/s",
            "fail",
            "A mode of the loop grows although nothing is saturated.",
            "Change the gains until every pole lies on the left.",
            "linearisation at the target, at the begin and when funnels have stopped narrowing",
        )
        yield Check(
            "sampling.runge_kutta",
            _amplified(poles, h),
            1 + ROUNDING,
            "-",
            "fail",
            f"A step of {h:g} s makes a decaying mode grow: that growth is the integrator's, not the loop's.",
            "Shorten sample_period_s, or take the part of the law out whose gain grows.",
            "stability polynomial of the Runge-Kutta method of order 4",
        )
        return
    yield Check(
        "sampling.closed_loop",
        max(spectral_radius(loop.moving) for loop in loops),
        1 + ROUNDING,
        "-",
        "fail",
        f"Held for {h:g} s, the loop's own commands make it grow.",
        "Sample faster, or lower the gains of the fastest part.",
        "spectral radius of the sampled loop at the target, at the begin and when funnels have stopped narrowing",
    )
    yield Check(
        "sampling.delay",
        max(spectral_radius(loop.delayed_moving) for loop in loops),
        1 + ROUNDING,
        "-",
        "note",
        f"A computation that takes a whole sample ({h:g} s) more would make the loop unstable.",
        "Command the actuators in the sample in which they are computed, or sample faster.",
        "spectral radius with the actuators one sample late",
    )


def settled(mission: Mission) -> float:
    """Return the end of the flight [s], or a later time at which the funnels have their last width within 0.1 %.

    In between a loop may be unstable for a while that is too short to matter.
    """
    times = [mission.timing.duration]
    for funnel in mission.funnels:
        start, floor, decay = (
            np.array(ca.DM(each)) for each in (funnel.bounds.start, funnel.bounds.floor, funnel.bounds.decay)
        )
        times += list((np.log(1e3 * np.maximum(start / floor, 1.0)) / decay).ravel())
    return float(max(times))


def _amplified(poles: Any, h: float) -> float:
    """Return the largest factor by which a step multiplies a mode that should not grow; NaN where a pole is none."""
    if np.isnan(poles).any():
        return float("nan")
    return float(np.abs(amplification(poles[poles.real <= ROUNDING] * h)).max(initial=0.0))


def amplification(z: np.ndarray) -> np.ndarray:
    """Return R(z), by which the classical Runge-Kutta method multiplies a mode of h s = z in a step."""
    return 1 + z * (1 + z / 2 * (1 + z / 3 * (1 + z / 4)))


def _eigenvalues(matrix: np.ndarray) -> Any:
    return np.linalg.eigvals(matrix) if np.isfinite(matrix).all() else np.array([complex(np.nan)])


def _longest(law: Law) -> float:
    """Return the longest sample period [s] that a law accepts, which refuses its own; 0 if there is none."""

    def accepts(hold: float) -> bool:
        try:
            replace(law, hold=hold).check_hold()
        except LawError:
            return False
        return True

    low, high = law.hold / 2, law.hold
    while not accepts(low):
        low, high = low / 2, low
        if high < _SHORTEST:
            return 0.0
    while high - low > _FINE * high:
        middle = (low + high) / 2
        low, high = (middle, high) if accepts(middle) else (low, middle)
    return low


def _jumps(mission: Mission, scheme: Scheme) -> Iterator[Check]:
    """Yield in how many steps of the integrator a decision on time turns, if there are decisions on time."""
    t, timing = ca.SX.sym("t"), mission.timing
    decisions = Loop(mission, scheme).decisions(t)
    if not decisions.numel():
        return
    h = timing.sample_period / timing.substeps
    begins = h * np.arange(min((timing.samples - 1) * timing.substeps, _MOST_STEPS))
    of = ca.Function("decisions", [t], [decisions])

    def decided(times: np.ndarray) -> np.ndarray:
        return np.array(of.map(times.size)(times[None, :]))

    turned = decided(begins + _AT_END * h) != decided(begins + (1 - _AT_END) * h)
    told = "A fault or profile changes"
    if turned.any():
        which, step = np.argwhere(turned)[np.argmin(np.argwhere(turned)[:, 1])]
        low, high = begins[step], begins[step] + h
        before = decided(np.array([low + _AT_END * h]))[which]
        while high - low > _AT_END * h:
            middle = (low + high) / 2
            low, high = (middle, high) if decided(np.array([middle]))[which] == before else (low, middle)
        told += f" at {high:.6g} s"
    yield Check(
        "sampling.jumps",
        float(turned.any(axis=0).sum()),
        0.0,
        "-",
        "warn",
        f"{told}, inside a step of {h:g} s: the flight has it at an end of the step, and the step is of order 1.",
        "Move it to a multiple of the step, or take sample_period_s or plant_substeps that put one there.",
        "steps of the integrator inside which plant or law decide otherwise",
    )


def _hold(scheme: Scheme) -> Iterator[Check]:
    """Yield a failure where the law itself refuses its sample time."""
    try:
        scheme.law.check_hold()
    except LawError as error:
        yield Check(
            "sampling.hold",
            scheme.law.hold,
            _longest(scheme.law),
            "s",
            "fail",
            f"{str(error)[:1].upper()}{str(error)[1:]}.",
            "Sample faster, or take a law that bears the hold.",
            "the law's own limit",
        )
