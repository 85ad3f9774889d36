"""Rank correlations: which inputs a metric rises or falls with, whatever the shape of the curve."""

from __future__ import annotations

import math

import numpy as np
from scipy.stats import norm, rankdata

from casadi_gnc.campaigns.statistics.estimate import Estimate, check_confidence, numbers
from casadi_gnc.errors import CampaignError


def rank_correlations(inputs: np.ndarray, output: np.ndarray, confidence: float = 0.9) -> list[Estimate]:
    """Return Spearman's correlation of each input with the output, 1 where one always rises with the other.

    Bounds on Fisher's scale with the variance of Bonett and Wright (2000), doi:10.1007/BF02294183. An input or output
    that never changes has none: NaN.

    Parameters
    ----------
    inputs : (n, k), a column each.
    output : (n,); infinite ones count as the largest or smallest.
    confidence : that the bounds enclose the truth, nearly, from some tens of flights on.

    Raises
    ------
    CampaignError
        For NaN, fewer than 4 flights, and shapes that do not fit.
    """
    check_confidence(confidence)
    ranks = rankdata(numbers(output, least=4))
    columns = table(inputs, len(ranks))
    return [_correlation(rankdata(numbers(column)), ranks, confidence) for column in columns.T]


def table(inputs: np.ndarray, count: int) -> np.ndarray:
    """Return inputs as columns, (count, k); raise `CampaignError` where there is not a row for each flight."""
    found = np.asarray(inputs, dtype=float)
    found = found[:, None] if found.ndim == 1 else found
    if found.ndim != 2 or len(found) != count:
        raise CampaignError(f"inputs of shape {np.shape(inputs)} for {count} flights; expected a row for each flight")
    return found


def _correlation(first: np.ndarray, second: np.ndarray, confidence: float) -> Estimate:
    a, b = first - first.mean(), second - second.mean()
    size = math.sqrt(float(a @ a) * float(b @ b))
    if size == 0.0:
        return Estimate(math.nan, math.nan, math.nan, confidence)
    found = min(max(float(a @ b) / size, -1.0), 1.0)
    if abs(found) == 1.0:
        return Estimate(found, found, found, confidence)
    reach = float(norm.ppf(0.5 + 0.5 * confidence)) * math.sqrt((1.0 + 0.5 * found * found) / (len(a) - 3))
    middle = math.atanh(found)
    return Estimate(found, math.tanh(middle - reach), math.tanh(middle + reach), confidence)
