"""Subset simulation: a small share as a product of larger ones.

Of some cases the tenth with the smallest margins is kept; chains that start there and never leave the region below the
tenth's margin fill it with as many cases again; and so on, until a tenth of the cases fails. The share is 0.1 for each
level times the part that fails in the last. Au and Beck (2001), doi:10.1016/S0266-8920(01)00019-4. A step of a chain
goes part of the way to a new normal point, so far that nearly half of the steps stay inside: Papaioannou, Betz,
Zwirglmaier, Straub (2015), doi:10.1016/j.probengmech.2015.06.006. With the component-wise Metropolis steps of the first
paper, shares of the problems in our tests scattered up to five times as much.

Cases of a chain depend on each other in a way that one run cannot tell. So several independent runs are made, and the
bounds come from how they scatter. A region of failure to which no slope of the margin leads from where the cases are
may be missed by all.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from casadi_gnc.campaigns.draws import Purpose, uniforms, words
from casadi_gnc.campaigns.rare.margin import Counted, Margins
from casadi_gnc.campaigns.statistics.estimate import Estimate, check_confidence, within_a_factor
from casadi_gnc.campaigns.statistics.weighted import effective_flights
from casadi_gnc.errors import CampaignError
from casadi_gnc.mathematics import normal

#: A step's first size, as the part of a new point in it; the part of the steps that should stay inside.
_STEP, _INSIDE = 0.6, 0.44
_SMALLEST = 0.02
#: Where the numbers begin that choose starts of chains; steps of chains have those before.
_LOTS = 2**23


@dataclass
class _Walk:
    """How far steps go, and what they draw: each is told by its number."""

    ask: Counted
    seed: int
    step: float = _STEP
    taken: int = 0

    def __call__(
        self, chains: np.ndarray, here: np.ndarray, margin: np.ndarray, limit: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return where chains at points (n, d) go next, and the margins there, none above its limit."""
        self.taken += 1
        drawn = uniforms(self.seed, Purpose.CHAINS, chains, here.shape[1], part=self.taken)
        wanted = math.sqrt(1.0 - self.step * self.step) * here + self.step * normal.quantile(drawn)
        there = self.ask(wanted)
        inside = there <= limit
        # Common to all chains, so that single ones do not stop where it is narrow and bias the cases.
        self.step = min(max(self.step * math.exp(float(inside.mean()) - _INSIDE), _SMALLEST), 1.0)
        return np.where(inside[:, None], wanted, here), np.where(inside, there, margin)


@dataclass(frozen=True)
class RareShare:
    """Hold the share of all cases that fail.

    Parameters
    ----------
    share : with bounds.
    flights : how many cases were flown for it.
    runs : (r,), the share by each independent run, or by each line.
    failed : (f, d), cases that fail, in standard normal coordinates.
    """

    share: Estimate
    flights: int
    runs: np.ndarray
    failed: np.ndarray

    @property
    def effective(self) -> float:
        """How many equal runs or lines would say as much.

        Below five runs or ten lines the bounds are not to be trusted: a few then make up the share, and those that were
        not drawn may count as much.
        """
        return effective_flights(self.runs)


def subset_simulation(
    margins: Margins,
    dimensions: int,
    seed: int,
    *,
    cases: int = 1000,
    runs: int = 10,
    confidence: float = 0.9,
    kept: float = 0.1,
    most_levels: int = 20,
) -> RareShare:
    """Return the share of all cases whose margin is not above zero.

    Parameters
    ----------
    margins : from cases (n, d), standard normal and independent, to margins (n,); called with the chains of all runs at
        a time.
    dimensions : d.
    seed : 0 to 2^64 - 1; the same seed flies the same cases.
    cases : of each level and run.
    runs : independent ones, 2 or more.
    confidence : that the bounds enclose the share, nearly.
    kept : part of the cases from which the next level starts; `cases` times it, and one over it, are whole numbers.
    most_levels : after which no failure is expected any more.

    Raises
    ------
    CampaignError
        For margins that are no numbers, options that do not fit, and where no failure was found down to the last level.
    """
    check_confidence(confidence)
    starts, length = round(cases * kept), round(1.0 / kept) if kept > 0 else 0
    if not (0 < kept <= 0.5 and starts >= 2 and abs(cases * kept - starts) < 1e-9 and starts * length == cases):
        raise CampaignError(
            f"{cases} cases of which {kept:g} are kept; expected chains of one length, such as 1000 and 0.1"
        )
    if runs < 2 or not 1 <= most_levels <= 1000:
        raise CampaignError(f"{runs} runs and {most_levels} levels; expected 2 runs or more, 1 to 1000 levels")
    ask = Counted(margins, dimensions)
    numbers = np.arange(runs * cases)
    points = normal.quantile(uniforms(seed, Purpose.CHAINS, numbers, dimensions))
    points, found = points.reshape(runs, cases, dimensions), ask(points).reshape(runs, cases)
    active, shares, failed, walk = np.arange(runs), np.ones(runs), [], _Walk(ask, seed)
    for level in range(most_levels):
        edge = _edges(found, starts)
        done = edge <= 0.0
        # The part kept, or more where margins are equal.
        shares[active] *= (found <= np.where(done, 0.0, edge)[:, None]).mean(axis=1)
        failed.append(points[done][found[done] <= 0.0])
        active, points, found, edge = (each[~done] for each in (active, points, found, edge))
        if not len(active):
            break
        # Of all cases up to the edge, by chance: where margins are equal those are more than chains start.
        cases_of = (active[:, None] * cases + np.arange(cases)).ravel()
        lot = words(seed, Purpose.CHAINS, cases_of, 1, part=_LOTS + level).reshape(found.shape) >> np.uint64(1)
        picked = np.argsort(np.where(found <= edge[:, None], lot, np.uint64(2**63)), axis=1, kind="stable")[:, :starts]
        points = np.take_along_axis(points, picked[:, :, None], axis=1)
        found = np.take_along_axis(found, picked, axis=1)
        chains = (active[:, None] * starts + np.arange(starts)).ravel()
        points, found = _filled(walk, chains, points, found, edge, length)
    else:
        raise CampaignError(
            f"{most_levels} levels led to no failure, down to a share of {shares.min():.0e}; the smallest margin is "
            f"{found.min():.4g}. A margin that is the same in most cases shows no way down"
        )
    value, deviation = float(shares.mean()), float(shares.std(ddof=1)) / math.sqrt(runs)
    return RareShare(
        within_a_factor(value, deviation, runs - 1, confidence), ask.flights, shares, np.concatenate(failed)
    )


def _edges(found: np.ndarray, starts: int) -> np.ndarray:
    """Return the margin of each run, halfway between the last case kept and the first one not."""
    ordered = np.sort(found, axis=1)
    last, first = ordered[:, starts - 1], ordered[:, starts]
    with np.errstate(invalid="ignore"):
        return np.where(np.isfinite(last) & np.isfinite(first), 0.5 * last + 0.5 * first, last)


def _filled(
    walk: _Walk, chains: np.ndarray, points: np.ndarray, found: np.ndarray, edge: np.ndarray, length: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return points (runs, cases, d) and margins of chains that start at points (runs, starts, d), these included."""
    runs, starts, dimensions = points.shape
    here, margin, limit = points.reshape(-1, dimensions), found.ravel(), np.repeat(edge, starts)
    all_points, all_margins = [here], [margin]
    for _ in range(1, length):
        here, margin = walk(chains, here, margin, limit)
        all_points.append(here)
        all_margins.append(margin)
    cube = np.stack([each.reshape(runs, starts, dimensions) for each in all_points], axis=2)
    row = np.stack([each.reshape(runs, starts) for each in all_margins], axis=2)
    return cube.reshape(runs, -1, dimensions), row.reshape(runs, -1)
