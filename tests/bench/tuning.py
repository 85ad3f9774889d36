"""Measure what `tune` gains: from gains detuned by factors of 3, and in the worst of 1000 fresh cases.

    python tests/bench/tuning.py detuned [NAME ...]
    python tests/bench/tuning.py worst [NAME ...]

`detuned` takes, of all patterns of factors 3 and 1/3, the one of the largest cost that flies, tunes for 10 iterations
and prints how many times smaller the cost is, and beside it the cost of the shipped gains. `worst` tunes the shipped
gains against the worst case and flies both in 1000 cases that the tuning never saw. Then it looks for better ones about
the tuned gains, in the cases that the tuning found: along 256 directions drawn evenly, at five lengths from 1 % to a
factor of e, within the bounds, and how many are better and keep conditions and checks. Minutes of a core a mission.
"""

import dataclasses
import itertools
import sys
import time

import numpy as np

import casadi_gnc as gnc
from casadi_gnc.campaigns import DispersionTable
from casadi_gnc.tuning.conditions import conditions_of, new_troubles, verdicts_of
from casadi_gnc.tuning.costs import cost_of
from casadi_gnc.tuning.gain_flights import Flights
from casadi_gnc.tuning.gains import gains_free

#: Problem, scheme, gains, cost, duration [s], dispersions.
MISSIONS = {
    "huang2019": (
        "huang2019/nominal", "pd_pinv", ["attitude_gain", "rate_gain"], "integral(mrp)", None,
        [("truth.inertia_kg_m2.1.1", [10.0, 14.0]), ("truth.inertia_kg_m2.3.3", [19.0, 25.0])],
    ),
    "huang2020": (
        "huang2020/slew", "pd_pinv", ["attitude_gain", "rate_gain"], "integral(mrp)", 400.0,
        [("truth.inertia_factor", [0.9, 1.3]), ("environment.constant_torque_N_m", [-2e-4, 2e-4])],
    ),
    "sun2018": (
        "sun2018/without_observer", "tracking", ["position_slope", "attitude_slope", "force_damping", "torque_damping"],
        "integral(position_error) + integral(attitude_error)", None,
        [("believed.mass_factor", [0.7, 0.95]), ("believed.inertia_factor", [0.7, 0.95])],
    ),
    "shi2020": (
        "shi2020/docking", "iobc", ["approach_speed", "disturbance_gain"], "integral(miss)", None,
        [("initial.position_m.1", [1.5, 2.5]), ("initial.position_m.2", [2.5, 3.5])],
    ),
    "tao2019": (
        "tao2019/case1", "plain",
        ["attitude_error_gain", "attitude_rate_gain", "position_error_gain", "position_rate_gain"],
        "integral(mrp) + integral(position)", 20.0,
        [("initial.position_m.1", [0.02, 0.04]), ("initial.velocity_m_per_s.2", [-0.6, -0.4])],
    ),
    "slew": (
        "satellites/slew", "pd", ["attitude_gain", "rate_gain"], "integral(mrp)", None,
        [("spacecraft.inertia_kg_m2.1.1", [70.0, 100.0]), ("initial.angle_deg", [50.0, 70.0])],
    ),
    "flexible": (
        "satellites/flexible_slew", "pd", ["attitude_gain", "rate_gain"], "integral(mrp)", 300.0,
        [("initial.angle_deg", [20.0, 40.0])],
    ),
}  # fmt: skip
FACTOR, ITERATIONS, FRESH = 3.0, 10, 1000
DIRECTIONS, LENGTHS, BETTER = 256, (0.01, 0.03, 0.1, 0.3, 1.0), 1e-3


def mission_of(name):
    problem, scheme, free, cost, duration, dispersions = MISSIONS[name]
    mission = gnc.load(problem, strict=False).with_scheme(scheme)
    if duration is not None:
        mission = mission.with_timing(duration=duration)
    varying = [DispersionTable(key=key, uniform=ends) for key, ends in dispersions]
    return dataclasses.replace(mission, dispersions=varying), scheme, free, cost


def detuned(name):
    mission, scheme, free, cost = mission_of(name)
    law = mission.scheme().law
    gains = gains_free(mission, scheme, free)
    wanted, measured = cost_of(cost, mission, scheme)
    flights = Flights(measured, scheme, gains, [], wanted, 1)
    shipped = np.array([one.value for one in gains.each])
    patterns = np.array(list(itertools.product((1 / FACTOR, FACTOR), repeat=len(shipped))))
    terms = flights.terms(np.vstack([shipped, shipped * patterns]), [flights.nominal])[:, 0]
    flights.scales = wanted.scales(terms[0])
    costs = wanted.total(terms, flights.scales)
    # The pattern of the largest cost among those that `tune` can begin at: a flight that does not diverge.
    worst = int(np.argmax(np.where(np.isfinite(costs[1:]), costs[1:], -np.inf)))
    start = {gain: getattr(law, gain) * factor for gain, factor in zip(free, patterns[worst], strict=True)}
    begun = time.process_time()
    found = gnc.tune(mission.with_scheme(scheme, **start), free, cost=cost, iterations=ITERATIONS, threads=1)
    seconds = time.process_time() - begun
    tuned = wanted.total(
        flights.terms(np.array([[one.after for one in found.gains]]), [flights.nominal])[:, 0], flights.scales
    )
    new = new_troubles(found.checks_before, found.checks_after)
    print(
        f"{name:10s} detuned {patterns[worst].round(2)}: {costs[1 + worst]:.3g} -> {tuned[0]:.3g}, "
        f"{costs[1 + worst] / tuned[0]:.2f} times smaller; shipped {costs[0]:.3g}; {found.iterations} iterations, "
        f"{found.flights} flights, {seconds:.1f} s of a core; new failures or warnings: {', '.join(new) or 'none'}",
        flush=True,
    )


def worst(name):
    mission, scheme, free, cost = mission_of(name)
    found = gnc.tune(mission, free, cost=cost, against="worst", iterations=20, threads=1)
    wanted, measured = cost_of(cost, mission, scheme)
    flights = Flights(measured, scheme, gains_free(mission, scheme, free), mission.dispersions, wanted, 1)
    shipped = np.array([one.before for one in found.gains])
    tuned = np.array([one.after for one in found.gains])
    scales = wanted.scales(flights.terms(shipped[None, :], [flights.nominal])[0, 0])
    fresh = []
    for values in (shipped, tuned):
        changes = {one.name: float(value) for one, value in zip(found.gains, values, strict=True)}
        flown = gnc.campaign(measured.with_scheme(scheme, **changes), FRESH, seed=77, threads=1, audit=0)
        flew = flown.column("refused") == ""
        table = {one.column: flown.column(one.column)[flew] for one in wanted.terms}
        fresh.append(wanted.total(wanted.values(table), scales))
    worst_of = [float(each.max()) for each in fresh]
    after = verdicts_of(mission.with_scheme(scheme, **{g.name: g.after for g in found.gains}), scheme)
    new = new_troubles(verdicts_of(mission, scheme), after)
    flights.scales = scales
    looked = about(mission, scheme, free, flights, found.cases, tuned)
    print(
        f"{name:10s} worst of {FRESH} fresh cases {worst_of[0]:.3g} -> {worst_of[1]:.3g}, "
        f"{1 - worst_of[1] / worst_of[0]:.0%} better; mean {fresh[0].mean():.3g} -> {fresh[1].mean():.3g}; "
        f"set of {len(found.cases)}, {found.flights} flights; {looked}; "
        f"new failures or warnings: {', '.join(new) or 'none'}",
        flush=True,
    )


def about(mission, scheme, free, flights, cases, tuned):
    """Return in words how much better than tuned gains those about them are."""
    gains = flights.gains
    kept, before = conditions_of(mission, scheme, gains), verdicts_of(mission, scheme)
    ways = np.random.default_rng(1).standard_normal((DIRECTIONS, gains.size))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    middle = np.log(tuned)
    points = np.clip(np.vstack([middle, *(middle + length * ways for length in LENGTHS)]), gains.low, gains.high)
    costs = np.vstack([flights.costs(some, cases) for some in np.array_split(points, 16)]).max(axis=1)
    lower = [i for i in np.argsort(costs) if costs[i] < (1 - BETTER) * costs[0]]
    least = np.minimum(0.0, kept.margins(np.array([one.value for one in gains.each]))) - 1e-9
    for i in lower:
        values = gains.values(points[i])[0]
        changed = mission.with_scheme(scheme, **dict(zip(free, values, strict=True)))
        if (kept.margins(values) >= least).all() and not new_troubles(before, verdicts_of(changed, scheme)):
            return (
                f"of {len(points) - 1} gains about it {len(lower)} cost less by {BETTER:.1%}, the best that keeps "
                f"conditions and checks by {1 - costs[i] / costs[0]:.1%}"
            )
    told = f"of {len(points) - 1} gains about it {len(lower)} cost less by {BETTER:.1%}"
    return f"{told}, and none of them keeps conditions and checks" if lower else told


if __name__ == "__main__":
    what, *names = sys.argv[1:] or ["detuned"]
    for each in names or MISSIONS:
        {"detuned": detuned, "worst": worst}[what](each)
