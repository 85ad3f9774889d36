"""How fast a campaign flies: vector lanes against scalar C, and against a build for every flight; processor time.

Where JAX is installed, also against the same tapes in JAX, compiled for all flights at once.

python tests/bench/campaign_speed.py [--flights N]
"""

from __future__ import annotations

import argparse
import importlib.util
import time

import numpy as np

import casadi_gnc
from casadi_gnc.campaigns.engines import CompiledBatch, best_vectors
from casadi_gnc.missions.flying import fly
from casadi_gnc.missions.parameters import vary

#: Missions with what varies.
FLOWN = {
    "huang2020/detumble": ("observer_pinv", ["truth.inertia_factor", "initial.*"], 0.0),
    "sun2018/circular_orbit": (None, ["spacecraft.mass_kg", "initial.position_error_m"], 0.0),
    "tao2019/case1": (None, ["spacecraft.mass_kg", "initial.mrp"], 10.0),
    "shi2020/docking": ("iobc", ["spacecraft.target_mass_kg", "initial.position_m"], 0.0),
}


def seconds(batch: CompiledBatch, values: np.ndarray) -> float:
    """Return the processor time of flying some cases, the least of three."""
    times = []
    for _ in range(3):
        begun = time.process_time()
        batch.fly(values, np.arange(len(values), dtype=np.uint64))
        times.append(time.process_time() - begun)
    return min(times)


def against_jax(flights: int) -> None:
    """Print how much longer JAX takes for the de-tumble, in processor time; it compiles before it is timed."""
    import jax_flight

    mission = casadi_gnc.load("huang2020/detumble").with_timing(duration=100.0)
    keys = ["truth.inertia_factor", "truth.centre_of_mass_error_m", "initial.rate_rad_per_s"]
    varied = vary(mission, keys, "observer_pinv")
    values = varied.parameters.nominal * (1 + 0.01 * np.sin(np.arange(flights))[:, None])
    theirs, ours = jax_flight.flights(varied), CompiledBatch(varied)
    begun = time.perf_counter()
    tallies = theirs(values)
    built, times = time.perf_counter() - begun, []
    apart = np.abs(tallies - ours.fly(values, np.zeros(flights, dtype=np.uint64)).tally).max()
    for _ in range(3):
        begun = time.process_time()
        theirs(values)
        times.append(time.process_time() - begun)
    ratio = min(times) / seconds(ours, values)
    print(f"JAX, {flights} de-tumbles of {mission.timing.samples} samples: {ratio:.1f} times as long as {ours.vectors} "
          f"lanes; compiled in {built:.0f} s; tallies within {apart:.0e}")  # fmt: skip


def main() -> None:
    """Print a line for each mission."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=128)
    flights = parser.parse_args().flights
    best = best_vectors()
    kinds = [kind for kind in ("avx2", "avx512") if best == "avx512" or kind == best] or [best]
    print(f"{flights} flights a mission, one thread, processor time; lanes: {', '.join(kinds)}")
    for name, (scheme, keys, duration) in FLOWN.items():
        mission = casadi_gnc.load(name)
        mission = mission.with_timing(duration=duration) if duration else mission
        varied = vary(mission, keys, scheme)
        values = varied.parameters.nominal * (1 + 0.01 * np.sin(np.arange(flights))[:, None])
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
        against_jax(8 * flights)


if __name__ == "__main__":
    main()
