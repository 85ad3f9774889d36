"""Statistics of flights that do not count alike: those of a plan with importance.

Each flight stands for its weight, the density that is meant over the one it was drawn from. Shares use that the
weights' mean is known to be 1; percentiles are those of the weighted distribution function, their bounds those where it
crosses the share plus and minus its deviation (Woodruff 1952, doi:10.1080/01621459.1952.10483443). The bounds are
normal theory: they hold nearly, once `effective_flights` of those that matter is some tens.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.stats import beta, norm

from casadi_gnc.campaigns.statistics.estimate import (
    Estimate,
    check_confidence,
    check_share,
    numbers,
    within_a_factor,
)
from casadi_gnc.campaigns.statistics.percentiles import Percentile
from casadi_gnc.errors import CampaignError


def effective_flights(weights: np.ndarray) -> float:
    """Return how many flights of equal weight would say as much, (sum w)^2 / sum w^2; 0 of none.

    Kish, Survey Sampling (1965), section 11.2. Of the flights that fail, it says how far their share is to be trusted.
    """
    given = numbers(weights, finite=True, least=0)
    square = float(given @ given)
    return float(given.sum()) ** 2 / square if square > 0 else 0.0


def weighted_share(chosen: np.ndarray, weights: np.ndarray, confidence: float = 0.9) -> Estimate:
    """Return the share of all flights that those chosen stand for, with two-sided bounds.

    Bounds on a logarithmic scale, since small shares are uncertain by a factor. If none was chosen the lower bound is
    0, and the upper one follows from how few there can be among the flights drawn, each of the largest weight seen.

    Parameters
    ----------
    chosen : (n,) of bool; the rarer side, such as the flights that fail.
    weights : (n,), above 0, with mean 1 in the long run.
    """
    check_confidence(confidence)
    given, picked = _weights(weights), np.asarray(chosen, dtype=bool).ravel()
    if len(picked) != len(given):
        raise CampaignError(f"{len(picked)} flights with {len(given)} weights; expected one each")
    count = len(given)
    if not picked.any():
        most = float(beta.isf(0.5 * (1.0 - confidence), 1, count))
        return Estimate(0.0, 0.0, min(1.0, most * float(given.max())), confidence)
    parts = np.where(picked, given, 0.0)
    share = float(parts.mean())
    deviation = float(parts.std(ddof=1)) / math.sqrt(count) if count > 1 else math.inf
    return within_a_factor(share, deviation, count - 1, confidence)


def weighted_percentile(values: np.ndarray, weights: np.ndarray, share: float, confidence: float = 0.9) -> Percentile:
    """Return the value that a share of all flights stays at or below, with two-sided bounds.

    Parameters
    ----------
    values : (n,), one a flight; infinite ones count as the largest or smallest.
    weights : (n,), above 0.
    share, confidence : as of `percentile`.
    """
    check_share(share)
    check_confidence(confidence)
    given, weight = numbers(values), _weights(weights)
    if len(given) != len(weight):
        raise CampaignError(f"{len(given)} values with {len(weight)} weights; expected one each")
    order = np.argsort(given, kind="stable")
    part = weight[order] / weight.sum()
    below = np.cumsum(part)
    # From the nearer end: the few flights of a tail keep their digits.
    above = np.cumsum(part[::-1])[::-1]

    def place(level: float) -> int:
        if level <= 0.5:
            return int(np.searchsorted(below, level, side="left"))
        return int(np.count_nonzero(above > 1.0 - level)) - 1

    middle = min(max(place(share), 0), len(given) - 1)
    inside = np.arange(len(given)) <= middle
    spread = math.sqrt(float(np.sum(np.square(part * (inside - share)))))
    reach = float(norm.ppf(0.5 + 0.5 * confidence)) * spread
    lower, upper = (
        place(share - reach) if share > reach else -1,
        place(share + reach) if share + reach < 1 else len(given),
    )
    low = float(given[order[lower]]) if lower >= 0 else -math.inf
    high = float(given[order[upper]]) if upper < len(given) else math.inf
    return Percentile(float(given[order[middle]]), low, high, confidence, share, int(order[middle]))


def weighted_mean(values: np.ndarray, weights: np.ndarray, confidence: float = 0.9) -> Estimate:
    """Return the mean over all flights, sum w x / sum w, with two-sided bounds.

    Arguments are those of `weighted_percentile`; values are finite.
    """
    check_confidence(confidence)
    given, weight = numbers(values, finite=True, least=2), _weights(weights)
    if len(given) != len(weight):
        raise CampaignError(f"{len(given)} values with {len(weight)} weights; expected one each")
    part = weight / weight.sum()
    mean = float(part @ given)
    spread = math.sqrt(float(np.sum(np.square(part * (given - mean)))) * len(given) / (len(given) - 1))
    reach = float(norm.ppf(0.5 + 0.5 * confidence)) * spread
    return Estimate(mean, mean - reach, mean + reach, confidence)


def _weights(weights: np.ndarray) -> np.ndarray:
    given = numbers(weights, finite=True)
    if given.min() <= 0:
        raise CampaignError(f"a weight of {given.min():g}; expected numbers above 0")
    return given
