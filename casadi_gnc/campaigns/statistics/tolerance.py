"""Tolerance limits: what a stated share of all flights stays within, with a stated confidence.

Without an assumption, order statistics serve: Wilks (1941), doi:10.1214/aoms/1177731788; of higher order, where some of
the most extreme values are passed over, as in Guba, Makai and Pal (2003), doi:10.1016/S0951-8320(03)00022-X. Where the
metric is normal, mean and deviation say more: limits mean +- k deviation with exact factors, Odeh and Owen, Tables for
Normal Tolerance Limits (1980); Krishnamoorthy and Mathew, Statistical Tolerance Regions (2009), chapter 2,
doi:10.1002/9780470473900.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from scipy.optimize import brentq
from scipy.stats import binom, chi2, nct, ncx2, norm

from casadi_gnc.campaigns.statistics.estimate import check_confidence, check_share, numbers
from casadi_gnc.errors import CampaignError

Side = Literal["upper", "lower", "both"]


def passed_over(flights: int, share: float, confidence: float) -> int:
    """Return how many of the most extreme values may lie outside the limits, plus one; 0 if there are too few flights.

    The greatest m for which, in at least the stated confidence, m or more of so many flights lie outside any given
    region that holds just the share: P(B >= m) >= confidence, B binomial with 1 - share.
    """
    found = int(binom.ppf(1.0 - confidence, flights, 1.0 - share))
    while found > 0 and binom.sf(found - 1, flights, 1.0 - share) < confidence:
        found -= 1
    return found


def flights_for_limits(share: float, confidence: float, side: Side = "upper", order: int = 1) -> int:
    """Return the fewest flights that give limits by Wilks.

    Parameters
    ----------
    share : of all flights that are to stay within.
    confidence : that they do.
    side : one limit, or one on each side.
    order : 1 takes the most extreme value as the limit, 2 the second, and so on.

    Examples
    --------
    >>> flights_for_limits(0.95, 0.95), flights_for_limits(0.95, 0.95, "both")
    (59, 93)
    """
    check_share(share)
    check_confidence(confidence)
    if order < 1:
        raise CampaignError(f"limits of order {order}; expected 1 or more")
    outside = 2 * order if side == "both" else order
    low, high = outside - 1, outside
    while binom.sf(outside - 1, high, 1.0 - share) < confidence:
        low, high = high, 2 * high
    while high - low > 1:
        middle = (low + high) // 2
        if binom.sf(outside - 1, middle, 1.0 - share) < confidence:
            low = middle
        else:
            high = middle
    return high


def limits(values: np.ndarray, share: float, confidence: float, side: Side = "upper") -> tuple[float, float]:
    """Return limits (low, high) within which the share of all flights stays, whatever the metric is distributed like.

    Infinite where no limit is asked for, or too few flights were flown to have one (`flights_for_limits`).

    Parameters
    ----------
    values : (n,), one a flight; infinite ones count as the largest or smallest.
    share, confidence, side : as of `flights_for_limits`.
    """
    check_share(share)
    check_confidence(confidence)
    ordered = np.sort(numbers(values))
    outside = passed_over(len(ordered), share, confidence)
    if side == "both":
        outside //= 2
    if outside == 0:
        return -math.inf, math.inf
    low = -math.inf if side == "upper" else float(ordered[outside - 1])
    high = math.inf if side == "lower" else float(ordered[-outside])
    return low, high


def factor(flights: int, share: float, confidence: float, side: Side = "upper") -> float:
    """Return k: mean +- k deviation of so many normal flights are limits for the share.

    Parameters
    ----------
    flights : 2 or more; the deviation divides by flights - 1.
    share, confidence, side : as of `flights_for_limits`.

    Examples
    --------
    >>> f"{factor(10, 0.95, 0.95):.3f} {factor(10, 0.95, 0.95, 'both'):.3f}"
    '2.911 3.393'
    """
    check_share(share)
    check_confidence(confidence)
    if flights < 2:
        raise CampaignError(f"{flights} flights; normal limits take at least 2")
    if side != "both":
        return float(nct.ppf(confidence, flights - 1, math.sqrt(flights) * norm.ppf(share))) / math.sqrt(flights)
    # Given a mean that is x off, half the width must reach r(x): the normal law holds the share within x +- r.
    places, weights = np.polynomial.legendre.leggauss(80)
    reach = 9.0 / math.sqrt(flights)
    x, weights = 0.5 * reach * (places + 1.0), reach * weights
    radius_squared = ncx2.ppf(share, 1, x * x)
    density = weights * norm.pdf(x, scale=1.0 / math.sqrt(flights))
    freedom = flights - 1

    def lacking(k: float) -> float:
        return float(density @ chi2.sf(freedom * radius_squared / (k * k), freedom)) - confidence

    low = 0.5 * float(norm.ppf(0.5 + 0.5 * share))
    high = 2.0 * low
    while lacking(high) < 0.0:
        high *= 2.0
    return float(brentq(lacking, low / 2, high, xtol=1e-12, rtol=1e-12))  # pyright: ignore[reportArgumentType]


def normal_limits(values: np.ndarray, share: float, confidence: float, side: Side = "upper") -> tuple[float, float]:
    """Return limits (low, high) within which the share of all flights stays if the metric is normal.

    They are closer than those of `limits` and exist for few flights, and they are wrong where the metric is not normal,
    in the tails above all.
    """
    given = numbers(values, finite=True, least=2)
    reach = factor(len(given), share, confidence, side) * float(given.std(ddof=1))
    mean = float(given.mean())
    return (-math.inf if side == "upper" else mean - reach), (math.inf if side == "lower" else mean + reach)
