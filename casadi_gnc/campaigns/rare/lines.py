"""Line sampling: a small share as the mean of what single lines fail on.

Through random points lines are drawn along one direction, the one in which it goes wrong. On a line the cases are
standard normal, so its part that fails is known from where the margin changes its sign; the mean over the lines is the
share. Where one region of failure lies about at right angles to the direction, few lines do. Koutsourelakis,
Pradlwarter, Schueller (2004), doi:10.1016/j.probengmech.2003.10.001.

A line is looked at from end to end in steps: what fails between two looks is missed, and what lies beyond its ends,
below 1e-15 for the usual reach, counts as its last look. A region of failure that the lines do not reach, such as one
off to the side, is missed as well, and the bounds do not know of it: where there may be one, take subset simulation.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize.elementwise import find_root
from scipy.stats import beta

from casadi_gnc.campaigns.draws import Purpose, uniforms
from casadi_gnc.campaigns.rare.margin import Counted, Margins
from casadi_gnc.campaigns.rare.subset import RareShare
from casadi_gnc.campaigns.statistics.estimate import Estimate, check_confidence, within_a_factor
from casadi_gnc.errors import CampaignError
from casadi_gnc.mathematics import normal

#: A crossing is known so well, in deviations: the share on its line to about half a thousandth.
_CLOSE = 1e-4
#: Margins of a size that can be computed with.
_LARGEST = 1e100
#: Half a step of differences, in deviations: wide, since margins of flights may be rough.
_APART = 0.1


def line_sampling(
    margins: Margins,
    dimensions: int,
    seed: int,
    *,
    lines: int = 100,
    direction: np.ndarray | None = None,
    reach: float = 8.0,
    looks: int = 17,
    confidence: float = 0.9,
) -> RareShare:
    """Return the share of all cases whose margin is not above zero.

    Parameters
    ----------
    margins : from cases (n, d), standard normal and independent, to margins (n,); called for all lines at a time.
    dimensions : d.
    seed : 0 to 2^64 - 1; the same seed flies the same cases.
    lines : 2 or more.
    direction : (d,), of any length, in which it goes wrong; looked for by `towards_failure` if None.
    reach : lines end so many deviations on both sides.
    looks : cases on each line, from end to end, before crossings are closed in on.
    confidence : that the bounds enclose the share, nearly.

    Raises
    ------
    CampaignError
        For margins that are no numbers, and options that do not fit.
    """
    check_confidence(confidence)
    if lines < 2 or looks < 2 or not 0 < reach <= 37:
        raise CampaignError(f"{lines} lines, {looks} looks, a reach of {reach:g}; expected 2 or more of both, 0 to 37")
    ask = Counted(margins, dimensions)
    unit = _unit(towards_failure(ask, dimensions) if direction is None else direction, dimensions)
    points = normal.quantile(uniforms(seed, Purpose.LINES, np.arange(lines), dimensions))
    points = points - np.outer(points @ unit, unit)
    ends = np.linspace(-reach, reach, looks)
    found = ask((points[:, None] + ends[:, None] * unit).reshape(-1, dimensions)).reshape(lines, looks)
    fails = found <= 0.0
    line, look = np.nonzero(fails[:, 1:] != fails[:, :-1])
    crossings = _crossings(ask, points[line], unit, ends[look], ends[look + 1])
    # The part up to the middle and the part from there on, each from its own end: small parts keep their digits.
    into = np.where(fails[line, look + 1], 1, -1)
    before = crossings < 0.0
    middle = fails[:, 0].astype(int)
    np.add.at(middle, line[before], into[before])
    whole = middle.astype(float)
    np.add.at(whole, line, np.where(before, -into, into) * normal.cumulative(-np.abs(crossings)))
    failed = (points[:, None] + ends[:, None] * unit)[fails]
    value = float(whole.mean())
    if value == 0.0:
        most = float(beta.isf(0.5 * (1.0 - confidence), 1, lines))
        return RareShare(Estimate(0.0, 0.0, most, confidence), ask.flights, whole, failed)
    deviation = float(whole.std(ddof=1)) / math.sqrt(lines)
    return RareShare(within_a_factor(value, deviation, lines - 1, confidence), ask.flights, whole, failed)


def towards_failure(margins: Margins, dimensions: int, rounds: int = 5) -> np.ndarray:
    """Return the direction, (d,), of the point nearest to the middle at which it goes wrong, as far as slopes tell.

    Each round takes the margin's slope where the last one arrived, and goes to where a plane of that slope is zero:
    Hasofer and Lind, with the step of Rackwitz and Fiessler (1978), doi:10.1016/0045-7949(78)90046-9. A round flies
    2 d + 1 cases.

    Raises
    ------
    CampaignError
        Where the margin has no slope; then give a direction.
    """
    ask = margins if isinstance(margins, Counted) else Counted(margins, dimensions)
    place = np.zeros(dimensions)
    steps = _APART * np.eye(dimensions)
    for _ in range(rounds):
        found = ask(np.vstack([place, place + steps, place - steps]))
        slope = (found[1 : dimensions + 1] - found[dimensions + 1 :]) / (2.0 * _APART)
        square = float(slope @ slope)
        if not 0.0 < square < math.inf or not math.isfinite(found[0]):
            raise CampaignError(
                "the margin has no slope to follow; give line sampling a direction, or take subset simulation"
            )
        there = (float(slope @ place) - float(found[0])) / square * slope
        distance = float(np.linalg.norm(there))
        place = there * min(1.0, 8.0 / distance) if distance > 0 else -slope
    return place


def _crossings(ask: Counted, points: np.ndarray, unit: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return where on lines through points, between two looks, the margin changes its sign."""
    if not len(points):
        return np.empty(0)

    def margin(along: np.ndarray, number: np.ndarray) -> np.ndarray:
        where = points[number.astype(int).ravel()] + along.reshape(-1, 1) * unit
        return np.clip(ask(where), -_LARGEST, _LARGEST).reshape(along.shape)

    found = find_root(margin, (low, high), args=(np.arange(len(points)),), tolerances={"xatol": _CLOSE, "xrtol": 0.0})
    return np.asarray(found.x)


def _unit(direction: np.ndarray, dimensions: int) -> np.ndarray:
    given = np.asarray(direction, dtype=float).ravel()
    length = float(np.linalg.norm(given))
    if len(given) != dimensions or not 0.0 < length < math.inf:
        raise CampaignError(
            f"a direction of {len(given)} numbers and length {length:g}; expected {dimensions}, not zero"
        )
    return given / length
