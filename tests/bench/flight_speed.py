"""Time one closed loop, three ways, in one run: hand-written numpy, CasADi's virtual machine, our C.

All three fly the 1500 s de-tumble with the observer law and the pseudo-inverse (15001 samples). Each
is timed several times and the shortest counts; what is set up once (building, compiling) is not
timed. Prints a table and, with `--json FILE`, writes the same numbers.
"""

import argparse
import json
import platform
import subprocess
import sys
import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import casadi as ca
import numpy as np
from processor_time import shortest

import casadi_gnc
from casadi_gnc.missions import tapes
from casadi_gnc.missions.engines import CompiledEngine
from casadi_gnc.missions.flying import begin
from casadi_gnc.system import compilers

sys.path.insert(0, str(Path(__file__).parents[1] / "oracles"))
oracle = import_module("detumble_numpy")

MISSION, SCHEME = casadi_gnc.load("huang2020/detumble"), "observer_pinv"
SAMPLES = MISSION.timing.samples


def compiled(maths: str) -> Callable[[], np.ndarray]:
    """Return a whole flight as one C call, every sample recorded."""
    scheme = MISSION.scheme(SCHEME)
    built = tapes.tapes_of(MISSION, scheme)
    engine = CompiledEngine(MISSION, scheme, built, maths)
    record = np.zeros((SAMPLES, built.row.size))

    def run() -> np.ndarray:
        engine.run(begin_copy(), 0, SAMPLES, 1, record)
        return record[:, built.row.place("rate")]

    fresh = begin(MISSION, built, engine)

    def begin_copy():
        return type(fresh)(*(getattr(fresh, name).copy() for name in ("x", "m", "actuators", "good", "tally")))

    return run


def mapaccum() -> Callable[[], np.ndarray]:
    """Return the same loop folded by CasADi: closed_loop().mapaccum on its virtual machine."""
    loop = MISSION.closed_loop(SCHEME)
    t, x, m, force, good = loop.sx_in()
    found = loop(t, x, m, force, good)
    state, moved = ca.vertcat(x, m, force, good), ca.vertcat(*found[:4])
    folded = ca.Function("loop", [state, t], [moved]).mapaccum(SAMPLES - 1)
    start = np.array(MISSION.start)
    first = np.concatenate(
        [start, np.array(MISSION.scheme(SCHEME).law.start(0.0, start[3:])).ravel(), np.zeros(12), start]
    )
    times = (np.arange(SAMPLES - 1) * MISSION.timing.sample_period)[None, :]
    return lambda: np.array(folded(first, times))[3:6].T


def help_seconds() -> float:
    """Return the wall time of `casadi-gnc --help`."""
    command = [sys.executable, "-m", "casadi_gnc.cli.main", "--help"]
    spent = []
    for _ in range(5):
        start = time.perf_counter()
        subprocess.run(command, check=True, capture_output=True)
        spent.append(time.perf_counter() - start)
    return min(spent)


def main() -> None:
    """Measure, check that all fly the same flight, and print ratios."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    peers = {
        "numpy, by hand": (lambda: oracle.fly(SAMPLES)["rate"], 2),
        "CasADi VM, mapaccum": (mapaccum(), 5),
        "our C, libm": (compiled("libm"), 20),
        "our C, gnc_math": (compiled("gnc"), 20),
    }
    ends = {name: run()[-1] for name, (run, _) in peers.items()}
    for name, end in ends.items():
        assert np.allclose(end, ends["our C, gnc_math"], atol=1e-7), name
    seconds = {name: shortest(run, times) for name, (run, times) in peers.items()}
    ours = seconds["our C, gnc_math"]
    print(f"{SAMPLES} samples of {MISSION.name}, {SCHEME}; {compilers.find().version}; {platform.machine()}")
    for name, value in seconds.items():
        print(f"{name:<22}{value * 1e3:10.2f} ms{value / SAMPLES * 1e6:10.3f} us a sample{value / ours:10.1f} x ours")
    start_up = help_seconds()
    print(f"casadi-gnc --help     {start_up * 1e3:10.0f} ms")
    if options.json:
        ratios = {name: value / ours for name, value in seconds.items()}
        options.json.write_text(
            json.dumps({"seconds": seconds, "ratios": ratios, "help_seconds": start_up}, indent=2) + "\n"
        )


if __name__ == "__main__":
    main()
