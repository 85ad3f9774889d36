"""The smallest gamma first, then the largest solution a little above it: the first is seldom attained."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.errors import SynthesisError
from casadi_gnc.synthesis.answer import LmiAnswer
from casadi_gnc.synthesis.gains import GainStatus, Synthesis, failed
from casadi_gnc.synthesis.lmis import Lmis


def two_steps(
    pose: Callable[[Lmis, Any], Any],
    build: Callable[[LmiAnswer, float], Synthesis],
    gamma: float | None,
    slack: float,
    backend: Any,
    options: dict[str, Any],
) -> Synthesis:
    """Return the gains of the second step, or of the first if only that succeeds.

    Parameters
    ----------
    pose : states the inequalities for a gamma, unknown or a number, and returns the matrix whose
        trace is maximised in the second step.
    build : certifies the gains of an answer for a gamma.
    gamma : bound to hold; None for (1 + slack) times the smallest.
    slack : positive.
    backend, options : of `Lmis.solve`.
    """
    if not (np.isfinite(slack) and slack > 0) or (gamma is not None and not (np.isfinite(gamma) and gamma > 0)):
        raise SynthesisError(f"gamma is {gamma} and slack {slack}; expected positive numbers")
    first = None
    if gamma is None:
        smallest = Lmis()
        unknown = smallest.scalar("gamma")
        pose(smallest, unknown)
        smallest.minimize(unknown)
        answer = smallest.solve(backend, **options)
        if not answer.status.holds:
            return failed(answer)
        least = float(answer["gamma"][0, 0])
        first, gamma = build(answer, least), (1 + slack) * least
    above = Lmis()
    above.minimize(-ca.trace(pose(above, gamma)))
    answer = above.solve(backend, **options)
    second = build(answer, gamma) if answer.status.holds else failed(answer)
    if first is None or second.is_certified:
        return second
    if first.is_certified and first.lmis.far:  # nor is there a largest solution a little above it
        return replace(first, status=GainStatus.RUNS_AWAY)
    return first if first.is_certified or not second.lmis.status.holds else second
