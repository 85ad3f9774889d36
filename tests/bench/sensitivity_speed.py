"""Time tangents and adjoints of whole flights in ordinary flights of scalar C, one thread, in one run.

An ordinary flight is one of a campaign: tally and all, no record. Tangents are carried along with one flight; for an
adjoint one flies first to learn what counts. Processor time counts, the least of several runs; nothing that is built
once is timed. Fails where tangents of p parameters cost more than 1 + p flights (p of 3 and more; of 2 and 1 see
docs/sensitivities.md), or an adjoint more than 6; `--json FILE` writes the same numbers.
"""

import argparse
import json
from pathlib import Path

import numpy as np
from processor_time import shortest

import casadi_gnc
from casadi_gnc.campaigns.engines import CompiledBatch
from casadi_gnc.missions.requirements import Requirement
from casadi_gnc.missions.sensitivities.engine import DerivativeEngine

#: Missions, schemes, what is asked at the end, and the seconds that are flown.
FLIGHTS = (
    ("huang2020/detumble", "observer_pinv", "norm(rate) <= 0.01", 1500.0),
    ("huang2020/slew", "funnel_robust", "norm(rate) <= 0.01", 200.0),
    ("sun2018/circular_orbit", "tracking", "norm(position) <= 1", 50.0),
    ("tao2019/case1", "funnels", "norm(position) <= 1", 2.0),
)
PARAMETERS = (1, 2, 3, 4, 8, 32)


def measured(name: str, scheme: str, asked: str, seconds: float) -> dict[str, float]:
    """Return what tangents and an adjoint cost, in flights."""
    mission = casadi_gnc.load(name, strict=False).with_timing(duration=seconds)
    gains = [f"scheme.{scheme}.law.{gain}" for gain in ("attitude_gain", "rate_gain", "position_gain")]
    law = mission.scheme(scheme).law
    keys = [gain for gain in gains if hasattr(law, gain.rpartition(".")[2])][:1] or ["initial.position_m"]
    slopes = casadi_gnc.sensitivities(mission, keys, Requirement("END", formula=f"always({asked})"), scheme)
    p, seed = slopes.varied.parameters.nominal, mission.noise.seed
    batch = CompiledBatch(slopes.varied, vectors="none", threads=1)
    flight = shortest(lambda: batch.fly(p[None, :], np.array([seed])))
    engine = slopes._engine
    flown = engine.values(p, seed)
    weights = slopes._outcome.weigh(flown.asked, 1e-3).weights
    first = shortest(lambda: engine.values(p, seed)) / flight
    #: As many directions side by side as each number of parameters has them.
    builds = {lanes: DerivativeEngine(slopes.varied, slopes._outcome.quantities, lanes=lanes) for lanes in (1, 2, 4)}

    def tangents(count: int) -> None:
        along = builds[1 if count == 1 else 2 if count == 2 else 4].along(p, seed, np.ones((count, len(p))))
        assert along is not None
        along.gradient(slopes._outcome.weigh(along.asked, 1e-3).weights)

    found = {f"tangents of {count}": shortest(lambda n=count: tangents(n)) / flight for count in PARAMETERS}
    return {**found, "adjoint": first + shortest(lambda: engine.adjoint(p, seed, weights, flown)) / flight}


def main() -> None:
    """Measure, print, and compare with what is promised."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    table = {}
    for name, scheme, asked, seconds in FLIGHTS:
        table[name] = measured(name, scheme, asked, seconds)
        print(f"{name}: " + ", ".join(f"{what} {cost:.1f}" for what, cost in table[name].items()) + " flights")
    if options.json:
        options.json.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")
    for name, costs in table.items():
        assert costs["adjoint"] <= 6, name
        for count in PARAMETERS[2:]:
            assert costs[f"tangents of {count}"] <= 1 + count, (name, count)


if __name__ == "__main__":
    main()
