"""How fast a campaign flies: vector lanes against scalar C, and against a build for every flight; processor time.

Where JAX is installed, also against the same tapes in JAX, compiled for all flights at once.

python tests/bench/campaign_speed.py [--flights N] [--detumbles N]

With `--detumbles` only N whole de-tumbles fly, of 15,001 samples, by each kind of lanes, in scalar C and in JAX, once;
and the time of the builds is told, which are made anew.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import tempfile
import time

import numpy as np

import casadi_gnc
from casadi_gnc.campaigns.engines import CompiledBatch, best_vectors
from casadi_gnc.campaigns.program import program_of
from casadi_gnc.missions.flying import fly
from casadi_gnc.missions.parameters import Varied, vary

#: Missions with what varies.
FLOWN = {
    "huang2020/detumble": ("observer_pinv", ["truth.inertia_factor", "initial.*"], 0.0),
    "sun2018/circular_orbit": (None, ["spacecraft.mass_kg", "initial.position_error_m"], 0.0),
    "tao2019/case1": (None, ["spacecraft.mass_kg", "initial.mrp"], 10.0),
    "shi2020/docking": ("iobc", ["spacecraft.target_mass_kg", "initial.position_m"], 0.0),
}


#: What differs among whole de-tumbles.
DISPERSED = ["truth.inertia_factor", "truth.centre_of_mass_error_m", "initial.rate_rad_per_s"]


def seconds(batch: CompiledBatch, values: np.ndarray, repeats: int = 3) -> float:
    """Return the processor time of flying some cases, the least of some repeats."""
    times = []
    for _ in range(repeats):
        begun = time.process_time()
        batch.fly(values, np.arange(len(values), dtype=np.uint64))
        times.append(time.process_time() - begun)
    return min(times)


def against_jax(varied: Varied, values: np.ndarray, repeats: int = 3) -> float:
    """Print how much longer JAX takes for the same flights, in processor time; it compiles before it is timed."""
    import jax_flight

    flights = len(values)
    theirs, ours = jax_flight.flights(varied), CompiledBatch(varied, threads=1)
    begun = time.perf_counter()
    tallies = theirs(values)
    built, times = time.perf_counter() - begun, []
    apart = np.abs(tallies - ours.fly(values, np.zeros(flights, dtype=np.uint64)).tally).max()
    for _ in range(repeats):
        begun = time.process_time()
        theirs(values)
        times.append(time.process_time() - begun)
    ratio = min(times) / seconds(ours, values, repeats)
    print(f"JAX, {flights} de-tumbles of {varied.nominal.timing.samples} samples: {ratio:.1f} times as long as "
          f"{ours.vectors} lanes; first call {built:.0f} s; tallies within {apart:.0e}", flush=True)  # fmt: skip
    return min(times)


def dispersed(varied: Varied, flights: int) -> np.ndarray:
    """Return parameters of so many flights, (flights, P)."""
    return varied.parameters.nominal * (1 + 0.01 * np.sin(np.arange(flights))[:, None])


def detumbles(flights: int, kinds: list[str]) -> None:
    """Print what builds take, and how long whole de-tumbles fly."""
    with tempfile.TemporaryDirectory() as folder:
        os.environ["CASADI_GNC_CACHE"] = folder
        begun, spent = time.perf_counter(), os.times()
        varied = vary(casadi_gnc.load("huang2020/detumble"), DISPERSED, "observer_pinv")
        program = program_of(varied)
        batches = {}
        for kind in ("none", *kinds):
            batches[kind] = CompiledBatch(program, vectors=kind, threads=1)
            now = os.times()
            used = sum(now[:4]) - sum(spent[:4])
            print(
                f"build with {kind}: {used:.1f} s of processor time, {time.perf_counter() - begun:.1f} s by the clock"
            )
            begun, spent = time.perf_counter(), os.times()
    values = dispersed(varied, flights)
    taken = {kind: seconds(batch, values, 1) for kind, batch in batches.items()}
    samples = flights * program.samples / 1e6
    for kind in kinds:
        print(f"{flights} de-tumbles of {program.samples} samples: {kind} {taken['none'] / taken[kind]:.2f} times "
              f"scalar, {samples / taken[kind]:.1f} million samples a second", flush=True)  # fmt: skip
    if importlib.util.find_spec("jax"):
        theirs = against_jax(varied, values, 1)
        print(", ".join(f"{theirs / taken[kind]:.1f} times as long as {kind}" for kind in taken))


def main() -> None:
    """Print a line for each mission."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=128)
    parser.add_argument("--detumbles", type=int, metavar="N", help="fly so many whole de-tumbles instead, once")
    asked = parser.parse_args()
    flights, best = asked.flights, best_vectors()
    kinds = [kind for kind in ("avx2", "avx512") if best == "avx512" or kind == best] or [best]
    if asked.detumbles:
        detumbles(asked.detumbles, kinds)
        return
    print(f"{flights} flights a mission, one thread, processor time; lanes: {', '.join(kinds)}")
    for name, (scheme, keys, duration) in FLOWN.items():
        mission = casadi_gnc.load(name)
        mission = mission.with_timing(duration=duration) if duration else mission
        varied = vary(mission, keys, scheme)
        values = dispersed(varied, flights)
        scalar = CompiledBatch(varied, vectors="none", threads=1)
        alone = seconds(scalar, values)
        told = []
        for kind in kinds:
            lanes = CompiledBatch(varied, vectors=kind, threads=1)
            taken = seconds(lanes, values)
            rate = flights * mission.timing.samples / taken / 1e6
            told.append(f"{kind} {alone / taken:.2f} times scalar, {rate:.1f} million samples a second")
        begun = time.perf_counter()
        fly(varied.at(values[3]), decimation=10**9)
        rebuilt = time.perf_counter() - begun
        print(
            f"{name}: {'; '.join(told)}; a flight with a build of its own takes as long as "
            f"{rebuilt / (alone / flights):.0f} scalar ones"
        )
    if importlib.util.find_spec("jax"):
        varied = vary(casadi_gnc.load("huang2020/detumble").with_timing(duration=100.0), DISPERSED, "observer_pinv")
        against_jax(varied, dispersed(varied, 8 * flights))


if __name__ == "__main__":
    main()
