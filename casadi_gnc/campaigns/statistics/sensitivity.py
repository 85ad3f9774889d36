"""What drives a metric: shares of its variance.

The first-order index of an input is the share of the variance that goes away, on average, when the input is known; the
total one is the share that is left when all others are known. First-order indices of inputs that act by themselves sum
to one; a total index well above the first-order one tells of interaction. Sobol (2001),
doi:10.1016/S0378-4754(00)00270-6. Two ways:

* `indices`, from a plan made for it (`casadi_gnc.campaigns.PickFreeze`): both indices, of groups of inputs too.
* `first_order`, from the flights of any plan without weights: first-order indices of single inputs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from casadi_gnc.campaigns.draws import Purpose, words
from casadi_gnc.campaigns.statistics.correlations import table
from casadi_gnc.campaigns.statistics.estimate import Estimate, check_confidence, numbers
from casadi_gnc.errors import CampaignError

#: Random numbers of the bootstrap that are held at a time.
_HELD = 4_000_000


@dataclass(frozen=True)
class Indices:
    """Hold the indices of each group of inputs."""

    first: list[Estimate]
    total: list[Estimate]


def indices(
    outputs: np.ndarray, groups: int, confidence: float = 0.9, *, resamples: int = 1000, seed: int = 0
) -> Indices:
    """Return first-order and total indices from the flights of a pick-freeze plan.

    First-order: Saltelli et al. (2010), doi:10.1016/j.cpc.2009.09.018, table 2 (b); total: Jansen (1999),
    doi:10.1016/S0010-4655(98)00154-4, the same table (f); outputs less their mean. Bounds are the percentiles of blocks
    drawn again and again from those flown (bootstrap: Archer, Saltelli, Sobol 1997, doi:10.1080/00949659708811825).
    Where the base plan is Sobol's they are wider than need be.

    Parameters
    ----------
    outputs : (blocks (groups + 2),), in the order of the plan's cases, whole blocks.
    groups : of the plan.
    confidence : that the bounds enclose the truth, nearly, from some hundred blocks on.
    resamples : how often blocks are drawn again.
    seed : of these draws.

    Raises
    ------
    CampaignError
        For outputs that are not finite, that never change, fewer than two blocks, or a block in part.
    """
    check_confidence(confidence)
    given = numbers(outputs, finite=True)
    if groups < 1 or len(given) % (groups + 2) or len(given) < 2 * (groups + 2):
        raise CampaignError(
            f"{len(given)} flights for {groups} groups; expected blocks of {groups + 2}, whole, and at least two"
        )
    blocks = given.reshape(-1, groups + 2)
    blocks = blocks - blocks[:, :2].mean()
    a, b, mixed = blocks[:, :1], blocks[:, 1:2], blocks[:, 2:]
    pair = [0.5 * (a + b), 0.5 * (a * a + b * b)]
    terms = np.hstack([*pair, b * (mixed - a), 0.5 * np.square(a - mixed)])
    found = _of_means(terms.mean(axis=0)[None])[0]
    if not np.isfinite(found).all():
        raise CampaignError("the outputs never change; nothing drives them")
    again = _of_means(_resampled(terms, resamples, seed))
    outside = 0.5 * (1.0 - confidence)
    low, high = np.nanquantile(again, [outside, 1.0 - outside], axis=0)
    told = [Estimate(float(v), float(lo), float(hi), confidence) for v, lo, hi in zip(found, low, high, strict=True)]
    return Indices(told[:groups], told[groups:])


def _of_means(means: np.ndarray) -> np.ndarray:
    """Return indices from means of terms: output, its square, then those over the variance."""
    variance = means[:, 1:2] - np.square(means[:, :1])
    with np.errstate(divide="ignore", invalid="ignore"):
        return means[:, 2:] / np.where(variance > 0, variance, np.nan)


def _resampled(terms: np.ndarray, resamples: int, seed: int) -> np.ndarray:
    """Return means of the terms over blocks drawn again, (resamples, terms)."""
    count = len(terms)
    found = np.empty((resamples, terms.shape[1]))
    for number in range(resamples):
        total = np.zeros(terms.shape[1])
        for start in range(0, count, _HELD):
            size = min(_HELD, count - start)
            drawn = words(seed, Purpose.RESAMPLING, np.arange(start, start + size), 1, part=number)[:, 0]
            total += np.bincount((drawn % np.uint64(count)).astype(np.int64), minlength=count) @ terms
        found[number] = total / count
    return found


def first_order(inputs: np.ndarray, output: np.ndarray, confidence: float = 0.9, *, seed: int = 0) -> list[Estimate]:
    """Return first-order indices of single inputs from flights of any plan without weights.

    The flights are put in the order of an input and cut into cells, as many as the cube root of the flights; a straight
    line in each cell is the part of the output that the input explains, and what it leaves, counted with the freedom
    that the lines take, is the rest. Cells: Plischke, Borgonovo, Smith (2013), doi:10.1016/j.ejor.2012.11.047; lines:
    Da Veiga, Wahl, Gamboa (2009), doi:10.1198/TECH.2009.08124. An input of few values has a cell for each, without
    line. Neighbours in a Sobol plan differ in the other inputs more than chance has it, so statistics of neighbours go
    wrong there; those of cells do not.

    The bounds follow from the influence of each flight on the index, and from the lines' freedom where the input
    explains nothing. They enclose the truth as often as they say or more often, from some hundred flights on. The upper
    one is not below the index without allowance for that freedom, which an even plan has no need of.

    Parameters
    ----------
    inputs : (n, k), a column each.
    output : (n,), finite.
    seed : of the order of flights whose input is equal.

    Raises
    ------
    CampaignError
        For values that are not finite, fewer than 10 flights, and shapes that do not fit. An output that never changes
        has no indices: NaN.
    """
    check_confidence(confidence)
    given = numbers(output, finite=True, least=10)
    columns = table(inputs, len(given))
    mixed = np.argsort(words(seed, Purpose.RESAMPLING, np.arange(len(given)), 1)[:, 0], kind="stable")
    given, columns = given[mixed] - given.mean(), columns[mixed]
    if not given.any():
        return [Estimate(math.nan, math.nan, math.nan, confidence)] * columns.shape[1]
    return [_explained(numbers(column, finite=True), given, confidence) for column in columns.T]


def _explained(column: np.ndarray, output: np.ndarray, confidence: float) -> Estimate:
    order = np.argsort(column, kind="stable")
    x, y = column[order], output[order]
    count = len(y)
    starts, taken = _cells(x)
    rest = _rest(x, y, starts, taken)
    variance = float(y @ y) / (count - 1)
    found = 1.0 - float(rest.mean()) / variance
    influence = ((1.0 - found) * y * y - rest) / variance
    freedom = taken * len(starts) - 1
    spread = math.sqrt(float(influence.var()) / count + 2.0 * freedom * ((1.0 - found) / count) ** 2)
    reach = float(norm.ppf(0.5 + 0.5 * confidence)) * spread
    unallowed = 1.0 - (1.0 - found) * (count - 1 - freedom) / (count - 1)
    return Estimate(found, found - reach, max(found + reach, unallowed), confidence)


def _cells(x: np.ndarray) -> tuple[np.ndarray, int]:
    """Return where cells of ordered inputs start, and how many numbers are fitted to the outputs of each."""
    cells = round(len(x) ** (1 / 3))
    changes = np.flatnonzero(np.diff(x)) + 1
    if len(changes) < 2 * cells:
        return np.append(0, changes), 1
    return np.arange(cells) * len(x) // cells, 2


def _rest(x: np.ndarray, y: np.ndarray, starts: np.ndarray, taken: int) -> np.ndarray:
    """Return the squares of what means or lines leave, each over the share of its cell that is free."""
    sizes = np.diff(np.append(starts, len(x)))
    cell = np.repeat(np.arange(len(starts)), sizes)
    left = y - (np.add.reduceat(y, starts) / sizes)[cell]
    if taken == 2:
        along = x - (np.add.reduceat(x, starts) / sizes)[cell]
        square = np.add.reduceat(along * along, starts)
        slope = np.add.reduceat(along * left, starts) / np.where(square > 0.0, square, 1.0)
        left = left - slope[cell] * along
    return left * left * (sizes / np.maximum(sizes - taken, 1))[cell]
