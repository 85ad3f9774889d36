"""Time the drag-free flight of 100 s, 200,000 Runge-Kutta steps, in one run: CasADi's mapaccum and our C.

All fly case 1 with prescribed performance, continuously, with the law in every stage; every sample is
kept. They fly in turn, several times, and the shortest processor time of each counts; building and
compiling are not timed.
Prints a table and fails below the ratios that are promised; with `--json FILE` it writes the numbers.
"""

import argparse
import json
import platform
import time
from collections.abc import Callable
from pathlib import Path

import casadi as ca
import numpy as np

import casadi_gnc
from casadi_gnc.mathematics import bounds
from casadi_gnc.mathematics.integrators import runge_kutta
from casadi_gnc.missions import tapes
from casadi_gnc.missions.engines import CompiledEngine
from casadi_gnc.missions.flying import begin
from casadi_gnc.system import compilers

MISSION, SCHEME = casadi_gnc.load("tao2019/case1"), "funnels"
SAMPLES, STEP = MISSION.timing.samples, MISSION.timing.sample_period
#: Least ratio of mapaccum's time to ours.
PROMISED = {"our C, libm": 8.0, "our C, gnc_math": 5.0}


def in_turn(peers: dict[str, Callable[[], object]], rounds: int, period: float = 4.0) -> dict[str, float]:
    """Return the least processor time [s] of each of some single-threaded runs, each given `period` s a round."""
    spent: dict[str, list[float]] = {name: [] for name in peers}
    for _ in range(rounds):
        for name, run in peers.items():
            begun = time.process_time()
            while True:
                start = time.process_time()
                run()
                spent[name].append(time.process_time() - start)
                if time.process_time() - begun > period:
                    break
    return {name: min(values) for name, values in spent.items()}


def compiled(maths: str) -> Callable[[], np.ndarray]:
    """Return the flight as one C call that gives the position at the end."""
    scheme = MISSION.scheme(SCHEME)
    built = tapes.tapes_of(MISSION, scheme)
    engine = CompiledEngine(MISSION, scheme, built, maths)
    record = np.zeros((SAMPLES, built.row.size))
    fresh = begin(MISSION, built, engine)

    def run() -> np.ndarray:
        names = ("x", "m", "actuators", "good", "tally")
        engine.run(type(fresh)(*(getattr(fresh, name).copy() for name in names)), 0, SAMPLES, 1, record)
        return record[-1, built.row.place("position")]

    return run


def mapaccum() -> Callable[[], np.ndarray]:
    """Return the same loop, law and plant in one expression, folded by CasADi on its virtual machine."""
    law, plant, limits = MISSION.scheme(SCHEME).law, MISSION.truth, ca.DM(MISSION.scheme(SCHEME).actuation.upper)
    states = plant.state.size

    def rate(t, state):
        x, m = state[:states], state[states:]
        wanted = law.command(t, x, m)
        made = bounds.clip(wanted, -limits, limits)
        return ca.vertcat(plant.rate(t, x, made, ca.DM(0, 1)), law.rate(t, x, m, wanted, made))

    t, state = ca.SX.sym("t"), ca.SX.sym("state", states + law.memory.size)
    once = ca.Function("rate", [t, state], [ca.cse(rate(t, state))])
    step = ca.Function("step", [state, t], [runge_kutta(once, t, state, STEP)])
    folded = step.mapaccum(SAMPLES - 1)
    start = np.array(MISSION.start)
    first = np.concatenate([start, np.array(ca.DM(law.start(0.0, ca.DM(start)))).ravel()])
    times = (np.arange(SAMPLES - 1) * STEP)[None, :]
    return lambda: np.array(folded(first, times))[plant.state.place("position"), -1]


def main() -> None:
    """Measure, check that all fly the same flight, print ratios."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    peers = {
        "CasADi VM, mapaccum": mapaccum(),
        "our C, libm": compiled("libm"),
        "our C, gnc_math": compiled("gnc"),
    }
    ends = {name: run() for name, run in peers.items()}
    for name, end in ends.items():
        # The swing at 351 rad/s has died to some 1e-10 m; rounding moves what is left of it.
        assert np.allclose(end, ends["our C, gnc_math"], rtol=0.05, atol=1e-10), (name, ends)
    seconds = in_turn(peers, 4)
    slowest = seconds["CasADi VM, mapaccum"]
    print(f"{SAMPLES} samples of {MISSION.name}, {SCHEME}; {compilers.find().version}; {platform.machine()}")
    for name, value in seconds.items():
        print(f"{name:<22}{value:10.3f} s{value / SAMPLES * 1e6:10.3f} us a step{slowest / value:10.1f} x faster")
    if options.json:
        ratios = {name: slowest / value for name, value in seconds.items()}
        options.json.write_text(json.dumps({"seconds": seconds, "ratios": ratios}, indent=2) + "\n")
    for name, ratio in PROMISED.items():
        if slowest / seconds[name] < ratio:
            raise SystemExit(f"{name} is {slowest / seconds[name]:.1f} times faster than mapaccum, promised {ratio:g}")


if __name__ == "__main__":
    main()
