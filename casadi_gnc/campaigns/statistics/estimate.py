"""A number with the bounds between which it lies with a stated confidence."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from casadi_gnc.errors import CampaignError


@dataclass(frozen=True)
class Estimate:
    """Hold an estimate and its bounds.

    Parameters
    ----------
    value : the estimate.
    low, high : bounds; infinite, or an end of the range, where the flights tell no more.
    confidence : in how many of many campaigns the bounds hold the truth, at least or nearly, as the maker says.
    """

    value: float
    low: float
    high: float
    confidence: float


def within_a_factor(value: float, deviation: float, freedom: int, confidence: float) -> Estimate:
    """Return a small share with bounds that are the same factor below and above it, the upper one at most 1.

    Normal theory of the logarithm: what is uncertain by a factor has no bound below zero.

    Parameters
    ----------
    value : above 0.
    deviation : of the value, estimated with so many degrees of freedom; infinite bounds for none.
    """
    if freedom < 1:
        return Estimate(value, 0.0, 1.0, confidence)
    factor = math.exp(min(float(student.ppf(0.5 + 0.5 * confidence, freedom)) * deviation / value, 700.0))
    return Estimate(value, value / factor, min(value * factor, 1.0), confidence)


def check_confidence(confidence: float) -> None:
    """Raise `CampaignError` for a confidence that is none."""
    if not 0.0 < confidence < 1.0:
        raise CampaignError(f"a confidence of {confidence:g}; expected a number between 0 and 1, such as 0.9")


def check_share(share: float) -> None:
    """Raise `CampaignError` for a share of flights that is none."""
    if not 0.0 < share < 1.0:
        raise CampaignError(f"a share of {share:g}; expected a number between 0 and 1, such as 0.9973")


def numbers(values: np.ndarray, *, finite: bool = False, least: int = 1) -> np.ndarray:
    """Return values of flights, (n,), as floats.

    Raises
    ------
    CampaignError
        For NaN, for infinite values where they have no meaning, and for fewer values than it takes.
    """
    found = np.asarray(values, dtype=float).ravel()
    if len(found) < least:
        raise CampaignError(f"{len(found)} flights; this takes at least {least}")
    bad = ~np.isfinite(found) if finite else np.isnan(found)
    if bad.any():
        first = int(np.argmax(bad))
        kind = "finite number" if finite else "number"
        raise CampaignError(
            f"{int(bad.sum())} of {len(found)} values are no {kind}, the first at place {first}; say what they count "
            "as, or leave these flights out"
        )
    return found
