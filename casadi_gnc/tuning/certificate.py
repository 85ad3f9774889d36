"""What is proved of a requirement for every dispersion in a set: of the linear loop, never of more than that.

The set is a box of the numbers that contains what is searched. Each number of it is the same during a flight; all may
be anywhere in it at once. The requirement is read on intervals that hold every state of the linear loop
(`casadi_gnc.checking.tubes`); what it asks of other signals is not proved.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.campaigns.correlated import Correlated, factor
from casadi_gnc.campaigns.distributions import Choice, LogUniform, Normal, Uniform
from casadi_gnc.checking.tubes import Tube, tubes
from casadi_gnc.checking.uncertain_loop import UncertainLoop, uncertain_loop
from casadi_gnc.errors import FlightError, GncError
from casadi_gnc.mathematics.intervals import Interval, enclose
from casadi_gnc.missions.parameters import Varied
from casadi_gnc.missions.recording import observed, row_of
from casadi_gnc.missions.requirements import evaluating
from casadi_gnc.missions.requirements.requirement import Requirement
from casadi_gnc.missions.requirements.tree import BEYOND
from casadi_gnc.synthesis.contraction import borne
from casadi_gnc.tuning.reach import Reach
from casadi_gnc.tuning.space import Space

#: A box is enlarged up to so many times.
_LARGER = 4.0
#: Corners of a box of so many numbers are looked at where nothing is proved.
_CORNERS = 8


@dataclass(frozen=True)
class Certificate:
    """Hold what is proved of the linear loop over a box of dispersions.

    Parameters
    ----------
    requirement : its id.
    least : robustness that is left at least; -inf where nothing bounds it.
    rate : factor by which what is of second order becomes smaller from sample to sample, below 1: the loop is stable.
        NaN where that is not proved.
    borne : times the box could be larger and the loop still proved to be stable; 4 for as much and more.
    exact : whether the flight's loop is the linear one, but for noise and limits of actuators.
    why : why nothing is proved, "" where something is.
    """

    requirement: str
    least: float = -math.inf
    rate: float = math.nan
    borne: float = 0.0
    exact: bool = False
    why: str = ""

    @property
    def holds(self) -> bool:
        """Whether it is proved that no dispersion breaks the requirement in the linear loop."""
        return self.least >= 0

    @property
    def model(self) -> str:
        """Of what it is proved."""
        if self.exact:
            return "the loop, which is linear but for limits of actuators, without these and without noise"
        return (
            "the loop linearised at its target, without limits of actuators and noise, what is not regulated as at "
            "the start"
        )

    @property
    def sentence(self) -> str:
        """What is proved."""
        if self.why:
            return f"no certificate: {self.why}"
        of = f"of {self.model}: over the box of all dispersions that contains the set"
        if self.holds:
            return f"proved {of}, {self.requirement} is met, with {self.least:+.4g} left at least"
        return (
            f"proved {of}, and up to {self.borne:.3g} times as large, it is stable. Of {self.requirement} that proves "
            "nothing"
        )

    def as_data(self) -> dict[str, Any]:
        """Return it as data that JSON can hold."""
        return {
            "requirement_holds": self.holds,
            "stable": not self.why,
            "least_robustness": self.least if math.isfinite(self.least) else None,
            "stable_up_to_times_the_box": None if self.why else self.borne,
            "model": None if self.why else self.model,
            "model_is_the_loop_of_the_flight": self.exact,
            "sentence": self.sentence,
        }


def certificate(varied: Varied, space: Space, reach: Reach, requirement: Requirement) -> Certificate:
    """Return what is proved of a requirement over a set.

    Parameters
    ----------
    varied : the mission, with symbols for what is dispersed.
    space, reach : of the set.
    requirement : what is asked.
    """
    name = requirement.id
    if not requirement.formula:
        return Certificate(name, why=f"{name} bounds a metric, and what is proved is of formulas over signals")
    try:
        loop = uncertain_loop(varied, *box_of(space, reach))
        found = tubes(loop)
        if not found:
            return Certificate(name, why=_unstable(loop) or "no single ellipsoid shrinks for all of the set")
        least = _least(loop, found, requirement)
        enlarged = borne(loop.as_map(found[0].units), most=_LARGER, relative=0.1)
    except GncError as error:
        return Certificate(name, why=str(error))
    except (RuntimeError, TypeError, ValueError) as error:  # of what has no symbolic form
        return Certificate(name, why=str(error).splitlines()[-1])
    return Certificate(name, least, min(each.proof.rate for each in found), max(enlarged, 1.0), loop.exact)


def box_of(space: Space, reach: Reach) -> tuple[np.ndarray, np.ndarray]:
    """Return the ends of each number, (P,), of a box that contains a set, and the file's own numbers.

    Raises
    ------
    FlightError
        For a distribution of which no box is known.
    """
    lows, highs, at, value = [], [], 0, 0
    for key, each in zip(_given(space), space.distributions, strict=True):
        ends = reach.ends[at : at + each.dimensions]
        if isinstance(each, (Normal, Uniform, LogUniform)):
            rows = np.array([space.rows(side * reach.ends[None, :])[0] for side in (-1.0, 1.0)])
            told = rows[:, value : value + each.values]
        elif isinstance(each, Correlated):
            width = np.abs(np.array(factor(each.covariance))) @ ends
            told = np.array(each.mean) + np.array([[-1.0], [1.0]]) * width
        elif isinstance(each, Choice):
            told = np.array(each.rows, dtype=float)
        else:
            raise FlightError(f"{key} is dispersed by directions, and what is proved is of boxes")
        told = np.vstack([told, space.nominal[value : value + each.values]])
        lows.append(told.min(axis=0))
        highs.append(told.max(axis=0))
        at, value = at + each.dimensions, value + each.values
    return np.concatenate(lows), np.concatenate(highs)


def _given(space: Space) -> list[str]:
    """Return a key of each distribution."""
    places = np.cumsum([0, *(each.values for each in space.distributions)])[:-1]
    return [space.keys[place] for place in places]


def _unstable(of: UncertainLoop) -> str:
    """Return a sentence where the loop is not stable at a corner of the box, "" where that is not known."""
    keys, parts = of.varied.parameters.keys, np.array([of.square(each) for each in of.A.parts])
    matter = [i for i, part in enumerate(parts) if np.any(part)]
    if len(matter) > _CORNERS or np.any(of.A.rest > 1e-9 * np.abs(parts).max(initial=1.0)):
        return ""
    for signs in itertools.product((-1.0, 1.0), repeat=len(matter)):
        matrix = of.square(of.A.centre) + sum(sign * parts[i] for sign, i in zip(signs, matter, strict=True))
        if np.abs(np.linalg.eigvals(matrix)).max() > 1.0 + 1e-9:
            at = {i: of.box.low[i] if sign < 0 else of.box.high[i] for sign, i in zip(signs, matter, strict=True)}
            where = ", ".join(f"{keys[i]} = {value:.5g}" for i, value in at.items())
            return f"the linear loop is not stable at {where or 'any of them'}"
    return ""


def _least(of: UncertainLoop, found: list[Tube], requirement: Requirement) -> float:
    """Return a lower bound of a requirement's robustness: it rises with each of its margins."""
    loop, mission = of.loop, of.loop.mission
    s, period = loop.symbols(), mission.timing.sample_period
    y = loop.sensed(s.t, s.x, mission.quiet())
    memory, wanted = loop.commanded(s.t, loop.seen(y), s.m)
    flags, report = ca.SX.sym("flags"), loop.actuation.allocator.report.symbol("report")
    row = observed(loop, s, s.actuators, flags, report)
    (row,) = ca.substitute([row], [ca.vertcat(s.y, s.m, s.wanted, s.limited)], [ca.vertcat(y, memory, wanted, wanted)])
    bound = requirement.bind(row_of(loop), row, period)
    free = ca.vertcat(s.actuators, flags, report)
    inputs = [s.t, s.x, s.m, of.varied.parameters.symbols, free]
    margins = ca.Function("margins", inputs, [ca.densify(ca.vertcat(*bound.margins))])
    count, first = mission.timing.samples, len(of.regulated)
    low = np.full((len(bound.margins), count), -math.inf)
    for tube in found:
        x = Interval.line((s.x.numel(), count))
        rows = list(of.regulated)
        x.low[rows], x.high[rows] = tube.states.low[:first], tube.states.high[:first]
        m = Interval(tube.states.low[first:], tube.states.high[first:])
        p = Interval(*(np.broadcast_to(side[:, None], (len(side), count)) for side in (of.box.low, of.box.high)))
        given = [Interval.of(period * np.arange(count)[None, :]), x, m, p, Interval.line((free.numel(), count))]
        (told,) = enclose(margins, given)
        low = np.maximum(low, told.low)  # a state is in each of the tubes
    least = float(evaluating.robustness(bound.tree, np.maximum(low, -BEYOND))[0])
    return least if abs(least) < BEYOND else math.copysign(math.inf, least)
