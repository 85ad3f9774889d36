"""The smallest gamma first, then the largest solution a little above it: the first is seldom attained.

The inequalities are asked for with a margin, and a margin raises the smallest gamma: the multipliers bound it from
below without any. Where the two are further apart than a quarter of the slack, the margin is made smaller.
"""

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

_FACTOR, _SMALLER = 100.0, 3  # by which a margin is made smaller, and how often


def with_small_margins(
    lmis: Lmis, margin: float, most: float, backend: Any, options: dict[str, Any]
) -> tuple[LmiAnswer, float]:
    """Return the answer with margins that cost little of the objective, and the largest of them.

    Parameters
    ----------
    lmis : with a positive objective. margin : the largest of its margins.
    most : share of the objective that the margins may cost; where they cost more they are made smaller.
    backend, options : of `Lmis.solve`.
    """
    answer, data = lmis.solve(backend, **options), lmis.data()
    for _ in range(_SMALLER):
        if answer.status.holds and answer.objective - answer.least <= most * answer.objective:
            break
        data = replace(data, blocks=tuple(replace(one, margin=one.margin / _FACTOR) for one in data.blocks))
        try:
            other = lmis.attempt(data, backend, **options)
        except SynthesisError:  # below that, rounding would decide
            break
        if not other.status.holds or (answer.status.holds and not other.objective < answer.objective):
            break
        answer, margin = other, margin / _FACTOR
    return answer, margin


def two_steps(
    pose: Callable[[Lmis, Any, float], Any],
    build: Callable[[LmiAnswer, float], Synthesis],
    gamma: float | None,
    slack: float,
    margin: float,
    backend: Any,
    options: dict[str, Any],
    attained: bool,
) -> Synthesis:
    """Return the gains of the second step, or of the first if only that succeeds.

    Parameters
    ----------
    pose : states the inequalities for a gamma, unknown or a number, with a margin, and returns the matrix whose
        trace is maximised in the second step.
    build : certifies the gains of an answer for a gamma.
    gamma : bound to hold; None for (1 + slack) times the smallest.
    slack : positive.
    margin : the first to be tried, and the largest; positive.
    backend, options : of `Lmis.solve`.
    attained : whether above the smallest gamma there is a largest solution, with finite gains: all commands are priced.
    """
    if not (np.isfinite(slack) and slack > 0) or (gamma is not None and not (np.isfinite(gamma) and gamma > 0)):
        raise SynthesisError(f"gamma is {gamma} and slack {slack}; expected positive numbers")
    first, between = None, None
    if gamma is None:
        smallest = Lmis()
        unknown = smallest.scalar("gamma")
        pose(smallest, unknown, margin)
        smallest.minimize(unknown)
        answer, margin = with_small_margins(smallest, margin, slack / 4, backend, options)
        if not answer.status.holds:
            return failed(answer)
        least = float(answer["gamma"][0, 0])
        between = (min(max(answer.least, 0.0), least), least)
        first, gamma = replace(build(answer, least), smallest=between), (1 + slack) * least
    above = Lmis()
    above.minimize(-ca.trace(pose(above, gamma, margin)))
    try:
        answer = above.solve(backend, **options)
    except SynthesisError:
        if first is None or not first.is_certified:
            raise
        return first  # there the margin, made smaller for the smallest gamma, drowns in rounding
    second = build(answer, gamma) if answer.status.holds else failed(answer)
    second = replace(second, smallest=between)
    if first is None or second.is_certified:
        return second
    if first.is_certified and first.lmis.far and not attained:  # nor is there a largest solution a little above it
        return replace(first, status=GainStatus.RUNS_AWAY)
    if first.is_certified or not (attained or second.lmis.status.holds):
        return first
    return second
