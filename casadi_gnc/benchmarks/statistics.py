"""Statistics of times that are short, skewed and disturbed.

A sample's time is the least of its passes: what disturbs a machine only ever adds. A failure is charged
the time limit. Means are shifted geometric ones, exp(mean(log(t + s))) - s: a shift s near the median
keeps neither a few long solves nor nanoseconds from deciding.

Intervals come from resampling: samples (the same of both that are compared) and passes are drawn with
replacement, so that both the choice of samples and the machine's noise are in the spread.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

#: Two that differ by less are called alike: what changes from run to run is of this size.
NOTABLE = 1.2
DRAWS = 400


@dataclass(frozen=True)
class Ratio:
    """Hold how many times as long one takes as another, and the 95 % interval of it."""

    value: float
    low: float
    high: float

    @property
    def differs(self) -> bool:
        """Whether the whole interval lies on one side of 1."""
        return self.low > 1 or self.high < 1

    @property
    def is_notable(self) -> bool:
        """Whether it differs, and by more than 20 %."""
        return self.differs and not 1 / NOTABLE <= self.value <= NOTABLE


def shifted_geometric_mean(seconds: np.ndarray, shift: float) -> float:
    """Return exp(mean(log(t + shift))) - shift of times (..., K); NaN without any.

    Examples
    --------
    >>> round(shifted_geometric_mean(np.array([1.0, 4.0]), 0.0), 12)
    2.0
    """
    if not seconds.size:
        return float("nan")
    return float(np.exp(np.mean(np.log(seconds + shift))) - shift)


def charged(passes: np.ndarray, good: np.ndarray, limit: float) -> np.ndarray:
    """Return each sample's time, (K,): the least of its passes; the limit where a pass failed or was late.

    Parameters
    ----------
    passes : (P, K), seconds; NaN where there was no answer, or no pass.
    good : (K,), whether every pass succeeded.
    """
    least = np.min(np.where(np.isnan(passes), np.inf, passes), axis=0)
    return np.where(good & (least <= limit), np.minimum(least, limit), limit)


def compare_times(
    one: list[tuple[np.ndarray, np.ndarray]],
    other: list[tuple[np.ndarray, np.ndarray]],
    *,
    limit: float,
    shift: float,
    seed: int = 0,
    draws: int = DRAWS,
) -> Ratio:
    """Return the ratio of the shifted geometric means, one over the other, with its interval.

    Parameters
    ----------
    one, other : for each family, passes (P, K) and success (K,); the families and their K must agree.
    """
    rng = np.random.default_rng(seed)
    value = _mean([charged(*family, limit) for family in one], shift)
    value /= _mean([charged(*family, limit) for family in other], shift)
    found = np.empty(draws)
    for draw in range(draws):
        top, bottom = [], []
        for (passes, good), (their_passes, their_good) in zip(one, other, strict=True):
            picked = rng.integers(good.size, size=good.size)
            top.append(_redrawn(passes, good, limit, rng)[picked])
            bottom.append(_redrawn(their_passes, their_good, limit, rng)[picked])
        found[draw] = _mean(top, shift) / _mean(bottom, shift)
    low, high = np.quantile(found, (0.025, 0.975))
    # The least of redrawn passes is never below the least of all, which may push the interval past the value.
    return Ratio(float(value), float(min(low, value)), float(max(high, value)))


def _redrawn(passes: np.ndarray, good: np.ndarray, limit: float, rng: np.random.Generator) -> np.ndarray:
    return charged(passes[rng.integers(len(passes), size=len(passes))], good, limit)


def _mean(families: list[np.ndarray], shift: float) -> float:
    return shifted_geometric_mean(np.concatenate(families), shift)


def performance_profile(times: dict[str, np.ndarray], limit: float, factors: np.ndarray) -> dict[str, np.ndarray]:
    """Return, for each contestant, the share of samples it solves within a factor of the fastest.

    Parameters
    ----------
    times : charged times by contestant, (K,) each, of the same samples.
    factors : (T,), at least 1.

    Source: Dolan and More (2002), Benchmarking optimization software with performance profiles,
    Mathematical Programming 91, doi:10.1007/s101070100263.
    """
    fastest = np.min(np.array(list(times.values())), axis=0)
    found = {}
    for name, seconds in times.items():
        ratio = np.where(seconds < limit, seconds / fastest, np.inf)
        found[name] = np.mean(ratio[None, :] <= factors[:, None], axis=1)
    return found
