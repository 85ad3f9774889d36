"""Engine cuda on this machine's GPU: the words of scalar C, and how fast it flies, beside all cores; wall time.

python tests/bench/cuda_speed.py [--flights N] [--only MISSION]

Needs an NVIDIA GPU with its driver, the extra `cuda` and a C compiler, and takes some minutes. The first number
counts words that differ, of 256 flights over all samples that are timed; the build is NVRTC's, not from the cache.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

import casadi_gnc
from casadi_gnc.campaigns import cuda
from casadi_gnc.campaigns.engines import CompiledBatch
from casadi_gnc.campaigns.program import Program, program_of
from casadi_gnc.missions.parameters import vary
from casadi_gnc.system import nvrtc

#: Missions with a scheme and the samples that are flown: all of the de-tumble's, some of the others'.
FLOWN = {
    "huang2020/detumble": ("observer_pinv", 15001),
    "sun2018/circular_orbit": ("tracking", 2500),
    "tao2019/case1": ("funnels", 2000),
    "huang2020/slew": ("funnel_robust", 2000),
}


def program(name: str) -> tuple[Program, np.ndarray]:
    """Return what flies a mission with another start in each case, and the nominal one."""
    scheme, samples = FLOWN[name]
    mission = casadi_gnc.load(name)
    short = mission.with_timing(duration=(samples - 1) * mission.timing.sample_period)
    varied = vary(short, ["initial.*"], scheme)
    return program_of(varied), varied.parameters.nominal


def cases(nominal: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return parameters and seeds of some cases."""
    turns = np.random.default_rng(1).standard_normal((count, len(nominal)))
    return nominal * (1 + 0.02 * turns), np.arange(count, dtype=np.uint64)


def flown(engine: CompiledBatch | cuda.CudaBatch, nominal: np.ndarray, count: int) -> float:
    """Return the seconds that some flights take, the least of two."""
    given, times = cases(nominal, count), []
    for _ in range(2):
        begun = time.perf_counter()
        engine.fly(*given)
        times.append(time.perf_counter() - begun)
    return min(times)


def main() -> None:
    """Print a line for each mission and number of flights."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=int, nargs="+", default=[1_000, 10_000, 100_000, 1_000_000])
    parser.add_argument("--only", nargs="+", choices=list(FLOWN), default=list(FLOWN))
    given = parser.parse_args()
    print(f"{cuda.present()}, NVRTC {'.'.join(map(str, nvrtc.version()))}")
    for name in given.only:
        made, nominal = program(name)
        begun = time.perf_counter()
        text, headers = cuda.kernel_text(made), cuda.headers()
        nvrtc.translated(text, headers, cuda.options(made, cuda.Device().architecture))
        build = time.perf_counter() - begun
        engine, cores = cuda.CudaBatch(made), CompiledBatch(made)
        some = cases(nominal, 256)
        apart = int((engine.fly(*some).words != CompiledBatch(made, vectors="none").fly(*some).words).sum())
        count = 64 * cores.threads
        rate = count * made.samples / flown(cores, nominal, count)
        print(f"{name}: {apart} words differ; built in {build:.1f} s", flush=True)
        print(
            f"    {cores.threads} threads of {cores.vectors} lanes: {rate / 1e6:.1f} million samples a second",
            flush=True,
        )
        for flights in given.flights:
            if flights > 100_000 and made.workspace:
                continue
            taken = flown(engine, nominal, flights)
            speed = flights * made.samples / taken
            told = f"{speed / 1e9:.3f} billion samples a second, {speed / rate:.0f} times these threads"
            print(f"    {flights} flights of {made.samples} samples: {taken:.2f} s, {told}", flush=True)


if __name__ == "__main__":
    main()
