"""Measure what `tune` gains: from gains detuned by factors of 3, and in the worst of 1000 fresh cases.

    python tests/bench/tuning.py detuned [NAME ...]
    python tests/bench/tuning.py worst [NAME ...]

`detuned` takes, of all patterns of factors 3 and 1/3, the one of the largest cost that flies, tunes for 10 iterations
and prints how many times smaller the cost is, and beside it the cost of the shipped gains. `worst` tunes the shipped
gains against the worst case and flies both in 1000 cases that the tuning never saw; beside it stands the best of 256
points about the shipped gains in the cases that the tuning found. Seconds to minutes of a core for each mission.
"""

import dataclasses
import itertools
import sys
import time

import numpy as np

import casadi_gnc as gnc
from casadi_gnc.campaigns import DispersionTable
from casadi_gnc.tuning.conditions import new_troubles, verdicts_of
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
        "integral(position_error) + integral(attitude_error)", None, [],
    ),
    "shi2020": (
        "shi2020/docking", "iobc", ["approach_speed", "disturbance_gain"], "integral(miss)", None,
        [("initial.position_m.1", [1.5, 2.5]), ("initial.position_m.2", [2.5, 3.5])],
    ),
    "tao2019": (
        "tao2019/case1", "plain",
        ["attitude_error_gain", "attitude_rate_gain", "position_error_gain", "position_rate_gain"],
        "integral(mrp) + integral(position)", 20.0, [],
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
FACTOR, ITERATIONS, FRESH, NEARBY = 3.0, 10, 1000, 256


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
    if not mission.dispersions:
        return
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
    drawn = shipped * np.exp(0.2 * np.random.default_rng(1).standard_normal((NEARBY, len(shipped))))
    near = wanted.total(flights.terms(drawn, found.cases).reshape(-1, len(wanted.terms)), scales)
    near = near.reshape(NEARBY, -1).max(axis=1).min()
    print(
        f"{name:10s} worst of {FRESH} fresh cases {worst_of[0]:.3g} -> {worst_of[1]:.3g}, "
        f"{1 - worst_of[1] / worst_of[0]:.0%} better; mean {fresh[0].mean():.3g} -> {fresh[1].mean():.3g}; "
        f"set of {len(found.cases)}, {found.flights} flights; best of {NEARBY} gains within 20 %: {near:.3g}; "
        f"new failures or warnings: {', '.join(new) or 'none'}",
        flush=True,
    )


if __name__ == "__main__":
    what, *names = sys.argv[1:] or ["detuned"]
    for each in names or MISSIONS:
        {"detuned": detuned, "worst": worst}[what](each)
