"""Time a proximity flight of 250 s at 100 Hz, two ways, in one run: hand-written numpy and our C.

Both fly the same loop: six channels, disturbance observer and compensator, Runge-Kutta at 10 ms. Our
C is one call that records every sample; processor time counts, of our C the least of several runs. What is set up once
(building, compiling) is not timed. Prints a table and fails below a ratio of 500; `--json FILE` writes
the same numbers.
"""

import argparse
import json
import platform
import sys
import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Literal

import numpy as np

import casadi_gnc
from casadi_gnc.missions import tapes
from casadi_gnc.missions.engines import CompiledEngine
from casadi_gnc.missions.flying import begin
from casadi_gnc.system import compilers

sys.path.insert(0, str(Path(__file__).parents[1] / "oracles"))
oracle = import_module("proximity_numpy")

#: How much faster than numpy one C call must be.
LEAST = 500.0
MISSION, SCHEME = casadi_gnc.load("sun2018/quarter_limits"), "tracking"
SAMPLES = MISSION.timing.samples


def timed(run: Callable[[], np.ndarray], times: int) -> tuple[float, np.ndarray]:
    """Return the least processor time of several runs [s], and what the last one flew."""
    spent, flown = [], np.zeros(0)
    for _ in range(times):
        start = time.process_time()
        flown = run()
        spent.append(time.process_time() - start)
    return min(spent), flown


def compiled(maths: Literal["gnc", "libm"]) -> Callable[[], np.ndarray]:
    """Return a whole flight as one C call, every sample recorded."""
    scheme = MISSION.scheme(SCHEME)
    built = tapes.tapes_of(MISSION, scheme)
    engine = CompiledEngine(MISSION, scheme, built, maths)
    record, fresh = np.zeros((SAMPLES, built.row.size)), begin(MISSION, built, engine)

    def run() -> np.ndarray:
        carried = type(fresh)(**{name: column.copy() for name, column in vars(fresh).items()})
        engine.run(carried, 0, SAMPLES, 1, record)
        return record[:, built.row.place("position_error")]

    return run


def main() -> None:
    """Measure, check that both fly the same flight, and print the ratio."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    peers = {
        "numpy, by hand": timed(lambda: oracle.fly(SAMPLES)["position_error"], 1),
        "our C, libm": timed(compiled("libm"), 30),
        "our C, gnc_math": timed(compiled("gnc"), 30),
    }
    # The loop forgets rounding: to a micrometre of 50 m all fly the same flight.
    for name, (_, flown) in peers.items():
        assert np.allclose(flown, peers["our C, gnc_math"][1], atol=1e-6), name
    seconds = {name: spent for name, (spent, _) in peers.items()}
    ours = seconds["our C, gnc_math"]
    print(f"{SAMPLES} samples of {MISSION.name}, {SCHEME}; {compilers.find().version}; {platform.machine()}")
    for name, value in seconds.items():
        print(f"{name:<22}{value * 1e3:10.2f} ms{value / SAMPLES * 1e6:10.3f} us a sample{value / ours:10.1f} x ours")
    ratio = seconds["numpy, by hand"] / ours
    if options.json:
        options.json.write_text(json.dumps({"seconds": seconds, "ratio": ratio}, indent=2) + "\n")
    if ratio < LEAST:
        sys.exit(f"one C call is {ratio:.0f} times faster than numpy, expected {LEAST:.0f}")


if __name__ == "__main__":
    main()
