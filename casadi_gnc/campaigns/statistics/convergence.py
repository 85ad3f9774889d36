"""How an estimate and its bounds went on as flights were added."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from casadi_gnc.campaigns.statistics.estimate import Estimate
from casadi_gnc.errors import CampaignError


@dataclass(frozen=True)
class Convergence:
    """Hold an estimate after growing numbers of flights: arrays of one length."""

    flights: np.ndarray
    value: np.ndarray
    low: np.ndarray
    high: np.ndarray


def convergence(flights: int, estimate: Callable[[int], Estimate], first: int = 10, steps: int = 40) -> Convergence:
    """Return an estimate of the first n flights for n from `first` to all of them, in equal ratios.

    Parameters
    ----------
    flights : how many there are.
    estimate : from a number of flights to the estimate that the first so many give, such as
        ``lambda n: percentile(values[:n], 0.99)``.
    first : the smallest number.
    steps : how many numbers, at most.

    Raises
    ------
    CampaignError
        For no flights or no steps.
    """
    if flights < 1 or steps < 1:
        raise CampaignError(f"convergence of {flights} flights in {steps} steps; expected 1 or more of each")
    counts = np.unique(np.rint(np.geomspace(min(max(first, 1), flights), flights, steps)).astype(int))
    found = [estimate(int(count)) for count in counts]
    value, low, high = (np.array([getattr(each, name) for each in found]) for name in ("value", "low", "high"))
    return Convergence(counts, value, low, high)
