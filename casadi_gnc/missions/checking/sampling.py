"""Can the loop be run at this sample time, or by this integrator?"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from casadi_gnc.checks import Check
from casadi_gnc.errors import LawError
from casadi_gnc.missions.checking.linear import LinearLoop, spectral_radius
from casadi_gnc.missions.mission import Mission, Scheme

#: An eigenvalue on the unit circle (an integrator, an estimate that nothing excites) is no instability.
ROUNDING = 1e-6


def checks(mission: Mission, scheme: Scheme) -> Iterator[Check]:
    """Yield the stability of the linearised loop at both ends of the flight, and with a sample of delay."""
    yield from _hold(scheme)
    if not mission.target:
        return
    loops = [LinearLoop(mission, scheme, t) for t in (0.0, mission.timing.duration)]
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
        poles: Any = np.concatenate([_eigenvalues(loop.matrix) for loop in loops])
        yield Check(
            "sampling.closed_loop",
            float(poles.real.max(initial=-np.inf)),
            ROUNDING,
            "1/s",
            "fail",
            "A mode of the loop grows although nothing is saturated.",
            "Change the gains until every pole lies on the left.",
            "linearisation at the target, begin and end of the flight",
        )
        yield Check(
            "sampling.runge_kutta",
            float(np.abs(amplification(poles[poles.real <= 0] * h)).max(initial=0.0)),
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
        max(spectral_radius(loop.matrix) for loop in loops),
        1 + ROUNDING,
        "-",
        "fail",
        f"Held for {h:g} s, the loop's own commands make it grow.",
        "Sample faster, or lower the gains of the fastest part.",
        "spectral radius of the sampled loop at the target, begin and end of the flight",
    )
    yield Check(
        "sampling.delay",
        max(spectral_radius(loop.delayed) for loop in loops),
        1 + ROUNDING,
        "-",
        "note",
        f"A computation that takes a whole sample ({h:g} s) more would make the loop unstable.",
        "Command the actuators in the sample in which they are computed, or sample faster.",
        "spectral radius with the actuators one sample late",
    )


def amplification(z: np.ndarray) -> np.ndarray:
    """Return R(z), by which the classical Runge-Kutta method multiplies a mode of h s = z in a step."""
    return 1 + z * (1 + z / 2 * (1 + z / 3 * (1 + z / 4)))


def _eigenvalues(matrix: np.ndarray) -> Any:
    return np.linalg.eigvals(matrix) if np.isfinite(matrix).all() else np.array([complex(np.nan)])


def _hold(scheme: Scheme) -> Iterator[Check]:
    """Yield a failure where the law itself refuses its sample time."""
    try:
        scheme.law.check_hold()
    except LawError as error:
        yield Check(
            "sampling.hold",
            scheme.law.hold,
            0.0,
            "s",
            "fail",
            f"{error}.",
            "Sample faster, or take a law that bears the hold.",
            "the law's own limit",
        )
