"""The share of all flights that keep a requirement: bounds, a verdict, and how many more flights one needs.

Counted flights are binomial: exact bounds of Clopper and Pearson (1934), doi:10.1093/biomet/26.4.404. They hold for a
number of flights that was chosen beforehand. Who looks, adds flights and looks again until it is decided takes the
bounds that hold at all times at once: a mixture of likelihood ratios is a martingale, so it exceeds 1/(1 - confidence)
with at most 1 - confidence (Robbins 1970, doi:10.1214/aoms/1177696786, after Ville).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

from scipy.optimize import brentq
from scipy.special import betainccinv, betaincinv, betaln, xlog1py

from casadi_gnc.campaigns.statistics.estimate import Estimate, check_confidence, check_share
from casadi_gnc.errors import CampaignError

#: Further flights beyond which no number is told.
_MOST = 1e12


class Verdict(StrEnum):
    """What flights say about a requirement."""

    MET = "met"
    NOT_MET = "not met"
    UNDECIDED = "undecided"


@dataclass(frozen=True)
class Judgement:
    """Hold the verdict on a requirement.

    Parameters
    ----------
    verdict : met if the share is at least the required one with the confidence, not met if it is below with it.
    share : of the flights flown, with a lower and an upper bound each of which holds with the confidence by itself.
    more_if_all_pass : further flights after which it is met if all of them pass; 0 if it is met.
    more_at_this_rate : further flights after which it is decided if they pass as often as those flown; 0 if it is
        decided, None if that rate is (nearly) the required one, where no number decides.
    """

    verdict: Verdict
    share: Estimate
    more_if_all_pass: int
    more_at_this_rate: int | None


def share_bounds(passed: int, flights: int, confidence: float = 0.9) -> Estimate:
    """Return the share of flights that pass, with two-sided bounds; the confidence is at least what it says.

    Parameters
    ----------
    passed : 0 to `flights`.
    flights : 1 or more.

    Examples
    --------
    >>> found = share_bounds(852, 852, confidence=0.8)
    >>> f"{found.low:.4f} {found.high}"
    '0.9973 1.0'
    """
    _check(passed, flights, confidence)
    outside = 0.5 * (1.0 - confidence)
    return Estimate(passed / flights, _lower(passed, flights, outside), _upper(passed, flights, outside), confidence)


def bounds_at_all_times(passed: float, flights: float, confidence: float = 0.9) -> Estimate:
    """Return the share of flights that pass, with two-sided bounds that hold after every flight at once.

    Wider than `share_bounds`; for whoever stops when the bounds please. Arguments as of `share_bounds`.
    """
    _check(passed, flights, confidence)
    failed = flights - passed
    low, high = _mixed_lower(passed, failed, confidence), 1.0 - _mixed_lower(failed, passed, confidence)
    return Estimate(passed / flights, low, high, confidence)


def _mixed_lower(passed: float, failed: float, confidence: float) -> float:
    """Return the share below which the mixture of likelihood ratios, by Jeffreys' prior, exceeds 1/(1 - confidence)."""
    if passed <= 0:
        return 0.0
    mixed = betaln(0.5 + passed, 0.5 + failed) - betaln(0.5, 0.5) + math.log1p(-confidence)

    def outside(logarithm: float) -> float:
        return float(mixed - passed * logarithm - xlog1py(failed, -math.exp(logarithm)))

    best = math.log(passed / (passed + failed))
    if failed <= 0:
        return math.exp(min(mixed / passed, 0.0))
    return math.exp(float(brentq(outside, best - 700.0, best, xtol=1e-13)))  # pyright: ignore[reportArgumentType]


def judge(passed: int, flights: int, share: float, confidence: float, *, at_all_times: bool = False) -> Judgement:
    """Return whether at least a share of all flights passes, at a confidence.

    Parameters
    ----------
    passed, flights : counted.
    share : that is required, between 0 and 1.
    confidence : of the verdict, whichever it is.
    at_all_times : flights were or will be added until it is decided.

    Examples
    --------
    >>> judge(851, 851, 0.9973, 0.9).verdict, judge(851, 851, 0.9973, 0.9).more_if_all_pass
    (<Verdict.UNDECIDED: 'undecided'>, 1)
    """
    _check(passed, flights, confidence)
    check_share(share)

    def decided(passing: float, count: float) -> Verdict:
        low, high = _sides(passing, count, confidence, at_all_times)
        return Verdict.MET if low >= share else Verdict.NOT_MET if high < share else Verdict.UNDECIDED

    verdict = decided(passed, flights)
    low, high = _sides(passed, flights, confidence, at_all_times)
    all_pass = _fewest(lambda more: decided(passed + more, flights + more) is Verdict.MET)
    rate = passed / flights
    at_rate = _fewest(lambda more: decided(passed + rate * more, flights + more) is not Verdict.UNDECIDED)
    assert all_pass is not None  # enough flights that pass meet any share below 1
    return Judgement(verdict, Estimate(rate, low, high, confidence), all_pass, at_rate)


def flights_needed(share: float, confidence: float, failed: int = 0) -> int:
    """Return the fewest flights of which so many may fail and the requirement is met.

    Examples
    --------
    >>> flights_needed(0.9973, 0.9), flights_needed(0.9973, 0.9, failed=1)
    (852, 1440)
    """
    check_share(share)
    check_confidence(confidence)
    if failed < 0:
        raise CampaignError(f"{failed} flights fail; expected 0 or more")
    more = _fewest(lambda passed: _lower(passed, passed + failed, 1.0 - confidence) >= share)
    assert more is not None
    return more + failed


def _sides(passed: float, flights: float, confidence: float, at_all_times: bool) -> tuple[float, float]:
    if at_all_times:
        found = bounds_at_all_times(passed, flights, confidence)
        return found.low, found.high
    return _lower(passed, flights, 1.0 - confidence), _upper(passed, flights, 1.0 - confidence)


def _lower(passed: float, flights: float, outside: float) -> float:
    return 0.0 if passed <= 0 else float(betaincinv(passed, flights - passed + 1, outside))


def _upper(passed: float, flights: float, outside: float) -> float:
    return 1.0 if passed >= flights else float(betainccinv(passed + 1, flights - passed, outside))


def _fewest(holds: Callable[[int], bool]) -> int | None:
    """Return the smallest whole number for which something holds that goes on to hold; None beyond what is told."""
    if holds(0):
        return 0
    low, high = 0, 1
    while not holds(high):
        low, high = high, 2 * high
        if high > _MOST:
            return None
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high


def _check(passed: float, flights: float, confidence: float) -> None:
    check_confidence(confidence)
    if not (flights >= 1 and 0 <= passed <= flights):
        raise CampaignError(f"{passed} of {flights} flights pass; expected 1 flight or more, and 0 to all of them")
