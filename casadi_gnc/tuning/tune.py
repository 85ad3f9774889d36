"""Tune gains: make a cost small at nominal, at the worst case that a search finds, or over a campaign's plan."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from casadi_gnc.errors import GncError, TuningError
from casadi_gnc.missions.mission import Mission
from casadi_gnc.problem_files.by_name import mission_of
from casadi_gnc.tuning import evolution
from casadi_gnc.tuning.adversary import worst_case
from casadi_gnc.tuning.conditions import conditions_of, new_troubles, verdicts_of
from casadi_gnc.tuning.costs import cost_of
from casadi_gnc.tuning.descent import Iterate, Problem, begin, descend
from casadi_gnc.tuning.gain_flights import Case, Flights, planned
from casadi_gnc.tuning.gains import Gains, gains_free
from casadi_gnc.tuning.iterates import Iterates
from casadi_gnc.tuning.loop_bounds import LoopBounds
from casadi_gnc.tuning.outcome import Tuned, outcome
from casadi_gnc.tuning.state import State, resumed
from casadi_gnc.tuning.writing import refuse_target, write

Against = Literal["nominal", "worst", "campaign"]
#: Iterations between two searches for the worst case.
_BETWEEN = 5
#: Called with a sentence.
Told = Callable[[str], None]


def tune(
    problem: str | Path | Mission,
    free: str | Sequence[str],
    *,
    scheme: str | None = None,
    against: Against = "nominal",
    cost: str | None = None,
    conditions: Literal["held", "all"] = "held",
    keep: Mapping[str, float] | None = None,
    digits: int = 3,
    iterations: int = 20,
    cases: int = 64,
    plan: str = "sobol",
    seed: int = 0,
    out: str | Path | None = None,
    threads: int | None = None,
    told: Told | None = None,
) -> Tuned:
    """Return better gains of a law, checked and flown again.

    Parameters
    ----------
    problem : a mission, a problem file, or the name of a shipped one.
    free : names of the gains that may change, with their bounds if wanted: "rate_gain", "rate_gain=0.1:5"; one of
        several numbers stands for all of them. Without bounds a gain may become 10 times smaller or larger.
    scheme : its name; the first by default.
    against : "nominal", the mission as it is; "worst", the worst case of its dispersions that the search of `falsify`
        finds, in turn with the tuning until it finds none that is worse; "campaign", the mean over the cases of a plan.
    cost : what is made small, see `casadi_gnc.tuning.costs`; by default the integrals of what the craft regulates,
        rates only where there is nothing else, and a tenth of that of the effort.
    conditions : of the law's theorems: those that hold before must hold after ("held"), or "all" must.
    keep : of the linear loop, from below: "disk", "decay_1_s", "damping" (`casadi_gnc.tuning.loop_bounds`).
    digits : of the gains that are returned.
    iterations : at most so many, in all.
    cases, plan : of "campaign": how many, and how they fill the space, as for `casadi_gnc.campaign`.
    seed : of all that is drawn.
    out : the problem file with the new gains; comments stay. A journal beside it lets a run that was killed go on.
    threads : all cores by default.
    told : called with a sentence for each iteration.

    Raises
    ------
    TuningError
        For gains that are not the law's, a cost that is flat or has no value, constraints that cannot hold together or
        bounds of the loop that do not hold at first, no
        dispersion where one is needed, and a result that does not fly as it was promised.

    Examples
    --------
    >>> import casadi_gnc as gnc
    >>> mission = gnc.load("satellites/slew").with_timing(duration=60.0)
    >>> found = tune(mission, ["attitude_gain", "rate_gain"], cost="integral(mrp)", iterations=4)
    >>> found.cost_after < found.cost_before
    True
    """
    mission = mission_of(problem, strict=False)
    chosen = mission.scheme(scheme).name
    gains = gains_free(mission, chosen, [free] if isinstance(free, str) else free)
    _refuse_options(mission, against, conditions, digits, iterations, cases)
    target = refuse_target(mission, out)
    wanted, measured = cost_of(cost, mission, chosen)
    kept = conditions_of(mission, chosen, gains, every=conditions == "all")
    bounds, before = LoopBounds(dict(keep or {})), verdicts_of(mission, chosen)
    bounds.refuse(mission, chosen)
    dispersions = [] if against == "nominal" else list(mission.dispersions)
    flights = Flights(measured, chosen, gains, dispersions, wanted, threads)
    start = np.array([one.value for one in gains.each])
    flights.scales = wanted.scales(flights.terms(start[None, :], [flights.nominal])[0, 0])
    journal = Iterates(
        None if target is None else target.with_name(f"{target.name}.journal"),
        {
            "mission": mission.digest, "scheme": chosen, "gains": [[g.key, g.value, g.low, g.high] for g in gains.each],
            "against": against, "cost": wanted.text, "conditions": conditions, "cases": cases,
            "plan": plan, "seed": seed, "keep": dict(bounds.least),
        },
    )  # fmt: skip

    def allowed(z: np.ndarray) -> bool:
        return not _troubles(flights, gains.values(z)[0], chosen, before, bounds)

    def problem_of(own: list[Case]) -> Problem:
        return Problem(
            costs=lambda points: flights.costs(points, own),
            slopes=lambda z: flights.slopes(z, own),
            conditions=lambda z: kept.margins(gains.values(z)[0]),
            allowed=allowed,
            low=gains.low,
            high=gains.high,
            worst=against != "campaign",
        )

    state = resumed(journal.kept)
    if state is None:
        own = planned(mission, chosen, dispersions, plan, cases, seed) if against == "campaign" else [flights.nominal]
        if against == "worst":
            first = worst_case(flights, gains.start, float(flights.costs(gains.start[None, :], own)[0, 0]), seed)
            own += [] if first is None else [first[0]]
        state = State(own, 1, begin(problem_of(own), gains.start), [])
        _refuse_flat(problem_of(own), state.at, gains)
        state.course.append((state.at.value, "start"))
        journal.add(**state.data())
    elif told:
        told(f"goes on after iteration {state.at.number}")
    while True:
        until = min(iterations, state.at.number + _BETWEEN) if against == "worst" else iterations
        for at in descend(problem_of(state.cases), state.at, until, seed):
            state = replace(state, at=at, course=[*state.course, (at.value, at.how)])
            journal.add(**state.data())
            if told:
                told(f"iteration {at.number}: cost {at.value:.4g} ({at.how})")
        if against != "worst":
            break
        worse = worst_case(flights, state.at.z, state.at.value, seed + state.searches)
        if told:
            told(f"search {state.searches} for a worse case: {'none' if worse is None else f'{worse[1]:.4g}'}")
        if worse is None and (state.at.done or state.at.number >= iterations):
            break
        searches = state.searches + 1
        if worse is not None:
            own = [*state.cases, worse[0]]
            again = begin(problem_of(own), state.at.z, radius=min(1.0, state.at.radius), number=state.at.number)
            again = replace(again, curvature=state.at.curvature)
            state = State(own, searches, again, [*state.course, (again.value, "a worse case")])
        else:
            state = replace(state, searches=searches)
        journal.add(**state.data())
        if state.at.number >= iterations:
            break
    if (
        told
        and any(how == "sampling" for _, how in state.course)
        and gains.size > 1
        and not evolution.serves(gains.size)
    ):
        told(f"note: {evolution.ADVICE}")
    values = _rounded(problem_of(state.cases), flights, state, kept.margins, digits, lambda v: not _troubles(
        flights, v, chosen, before, bounds))  # fmt: skip
    found = outcome(mission, chosen, flights, state.cases, values, against, state.course, before)
    if target is not None:
        found = write(found, flights, mission, target)
        journal.close()
    return found


def _refuse_options(mission: Mission, against: str, conditions: str, digits: int, iterations: int, cases: int) -> None:
    if against not in ("nominal", "worst", "campaign"):
        raise TuningError(f"against is {against!r}, expected nominal, worst or campaign")
    if conditions not in ("held", "all"):
        raise TuningError(f"conditions is {conditions!r}, expected held or all")
    for name, value, low, high in (
        ("digits", digits, 1, 17),
        ("iterations", iterations, 1, 10000),
        ("cases", cases, 1, 100000),
    ):
        if not low <= value <= high:
            raise TuningError(f"{name} is {value}, expected {low} to {high}")
    if against == "worst" and not mission.dispersions:
        raise TuningError(
            f"{mission.name} has no [[dispersion]], so no case is worse than another; write what varies, or tune "
            "against nominal"
        )
    if against == "campaign" and not mission.dispersions and not mission.truth.noise.size:
        raise TuningError(
            f"{mission.name} has neither a [[dispersion]] nor noise, so all cases of a campaign are alike; write what "
            "varies, or tune against nominal"
        )


def _troubles(
    flights: Flights, values: np.ndarray, scheme: str, before: dict[str, Any], bounds: LoopBounds
) -> list[str]:
    """Return which checks fail or warn with these gains and did not before, and what the loop has too little of."""
    row = np.concatenate([values, flights.nominal.values])
    try:
        mission = flights.objective.cases.varied.at(row)
    except GncError as error:
        return [str(error)]
    return bounds.short(mission, scheme) or new_troubles(before, verdicts_of(mission, scheme))


def _refuse_flat(problem: Problem, at: Iterate, gains: Gains) -> None:
    """Raise `TuningError` where the cost is the same along every gain, as far as its bounds."""
    spread = np.clip(at.z + np.vstack([np.eye(len(at.z)), -np.eye(len(at.z))]), problem.low, problem.high)
    if (problem.costs(spread) == at.costs).all() and not np.any(problem.slopes(at.z)):
        raise TuningError(
            f"the cost is flat: {', '.join(one.name for one in gains.each)} do not change it; take another cost, or "
            "free other gains"
        )


def _rounded(
    problem: Problem, flights: Flights, state: State, margins: Callable[[np.ndarray], np.ndarray], digits: int,
    allowed: Callable[[np.ndarray], bool],
) -> np.ndarray:  # fmt: skip
    """Return the gains with so many digits, rounded to the side of the lowest cost that keeps the constraints."""
    gains = flights.gains
    best = gains.values(state.at.z)[0]
    start = np.array([one.value for one in gains.each])
    if state.course[0][0] <= state.at.value and np.allclose(best, start, rtol=1e-9, atol=0):
        return start
    near = gains.rounded(best, digits)
    values = problem.merit(flights.cost.total(flights.terms(near, state.cases), flights.scales))
    limit = np.minimum(0.0, margins(start))
    for i in np.argsort(values):
        if (margins(near[i]) >= limit - 1e-9).all() and allowed(near[i]):
            return near[i]
    return best
