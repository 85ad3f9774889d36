"""Percentiles with bounds that hold for every distribution.

Counting makes them: the number of flights below the true percentile is binomial, so two order statistics enclose it
with a known confidence, whatever the metric is distributed like. Thompson (1936), doi:10.1214/aoms/1177732502; David
and Nagaraja, Order Statistics (2003), section 7.1, doi:10.1002/0471722162.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.stats import binom

from casadi_gnc.campaigns.statistics.estimate import Estimate, check_confidence, check_share, numbers


@dataclass(frozen=True)
class Percentile(Estimate):
    """Hold a percentile: its estimate is the value of a flight that was flown.

    Parameters
    ----------
    share : of all flights that stay at or below it.
    place : index of that flight among the values given.
    """

    share: float
    place: int


def percentile(values: np.ndarray, share: float, confidence: float = 0.9) -> Percentile:
    """Return the value that a share of all flights stays at or below, with bounds.

    Parameters
    ----------
    values : (n,), one a flight; infinite ones count as the largest or smallest, such as what is never reached.
    share : 0.5 for the median.
    confidence : that the bounds enclose the true percentile, at least; half of what is left on each side.

    Raises
    ------
    CampaignError
        For NaN among the values, and a share or a confidence that is none.

    Examples
    --------
    >>> found = percentile(range(1, 101), 0.5, confidence=0.95)
    >>> found.value, found.low, found.high
    (50.0, 40.0, 61.0)
    """
    check_share(share)
    check_confidence(confidence)
    given = numbers(values)
    count = len(given)
    order = np.argsort(given, kind="stable")
    rank = min(max(math.ceil(count * share * (1 - 1e-15)), 1), count)
    below, above = ranks(count, share, confidence)
    low = float(given[order[below - 1]]) if below >= 1 else -math.inf
    high = float(given[order[above - 1]]) if above <= count else math.inf
    place = int(order[rank - 1])
    return Percentile(float(given[place]), low, high, confidence, share, place)


def ranks(count: int, share: float, confidence: float) -> tuple[int, int]:
    """Return ranks, from 1, of the order statistics that enclose a percentile; 0 and count + 1 stand for no bound."""
    outside = 0.5 * (1.0 - confidence)
    return int(binom.ppf(outside, count, share)), int(binom.ppf(1.0 - outside, count, share)) + 1
