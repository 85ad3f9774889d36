"""Flights until a planted failure is found: falsify, CMA-ES and Monte Carlo, over seeds.

python tests/bench/falsify_planted.py [--seeds 20] [--most 3000] [NAME ...]

CMA-ES (Hansen's `cma`, extra `oracles`) searches the same set in the same coordinates, builds evenly in one more, from
the nominal with a step of a quarter of the set, and is stopped at its first break. Monte Carlo draws from the
dispersions, builds evenly. The seed is that of the plan, of the samples, and of the noise.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import casadi_gnc as gnc
from casadi_gnc.campaigns.plans import Independent
from casadi_gnc.tuning.falsifying import _builds
from casadi_gnc.tuning.flights import Flights, SpentError
from casadi_gnc.tuning.journal import Journal
from casadi_gnc.tuning.reach import Reach

sys.path.insert(0, str(Path(__file__).parents[1] / "tuning"))
from planted import PLANTED, Planted


def fresh(builds, most):
    """Return flights that are counted from nothing, of builds that are made already."""
    return Flights(builds, builds[0].objective.space, Journal({}), most)


def by_cma(builds, seed, most):
    """Return the flights until CMA-ES breaks the requirement, `most` where it does not."""
    import cma

    space = builds[0].objective.space
    reach, flights = Reach(space), fresh(builds, most)
    middle = np.append(np.where(space.discrete, 0.0, space.start / reach.ends), -0.99 if len(builds) > 1 else 0.0)
    options = {"seed": seed + 1, "bounds": [-1.0, 1.0], "verbose": -9, "maxfevals": most}
    count = 0
    while count < most:  # from the start again where it has converged
        options["seed"] += 1000
        search = cma.CMAEvolutionStrategy(middle, 0.5, options)
        while not search.stop():
            asked = search.ask()
            points, last = np.array(asked)[:, :-1], 0.5 * (1.0 + np.array(asked)[:, -1])
            which = np.minimum((last * len(builds)).astype(int), len(builds) - 1)
            points = reach.nearest(np.where(space.discrete, points, points * reach.ends))
            values = np.empty(len(asked))
            for of in np.unique(which):
                try:
                    values[which == of] = flights.fly(int(of), points[which == of])
                except SpentError:
                    return most
            count += len(asked)
            if (values < 0).any():
                return count
            search.tell(asked, np.minimum(values, 1e9).tolist())
    return most


def by_monte_carlo(builds, seed, most):
    """Return the flights until a draw breaks the requirement, `most` where none does."""
    objective = builds[0].objective
    distributions, done, size = objective.cases.distributions, 0, 256
    dimensions = objective.space.size
    while done < most:
        cube = Independent(dimensions + 1).points(seed, done, done + size)
        rows, at = [], 0
        for each in distributions:
            rows.append(each.at(cube[:, at : at + each.dimensions]))
            at += each.dimensions
        rows = np.hstack(rows)
        which = np.minimum((cube[:, -1] * len(builds)).astype(int), len(builds) - 1)
        values = np.full(size, np.inf)
        for of in np.unique(which):
            values[which == of] = np.nan_to_num(builds[of].at(rows[which == of]), nan=np.inf, neginf=-1e9)
        broken = np.flatnonzero(values < 0)
        if len(broken):
            return done + int(broken[0]) + 1
        done += size
    return most


def compare(planted: Planted, folder: Path, seeds: int, most: int):
    """Return for each seed: flights of falsify to its first break and in all, whether it re-flies, seconds; others."""
    rows, builds = [], None
    for seed in range(seeds):
        file = planted.write(folder / f"{seed}.toml", seed)
        began = time.perf_counter()
        found = gnc.falsify(file, "P", over=planted.over, seed=seed, out=folder / f"{seed}-broken.toml")
        took = time.perf_counter() - began
        flown = found.broken is not None and gnc.fly(folder / f"{seed}-broken.toml").verdicts["P"].word == "not met"
        mission = gnc.load(file)
        if builds is None or mission.noise.seed != builds[0].objective.seed:
            builds = _builds(mission, mission.schemes[0].name, "P", dict(planted.over), None)
        cma, drawn = by_cma(builds, seed, most), by_monte_carlo(builds, seed, most)
        rows.append((found.first or 0, found.flights, flown, took, cma, drawn))
    return rows


def main() -> None:
    """Print a line for each planted failure."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("names", nargs="*", default=[])
    asked.add_argument("--seeds", type=int, default=20)
    asked.add_argument("--most", type=int, default=3000)
    given = asked.parse_args()
    print(f"{'':20} found  first  in all  seconds  CMA-ES  Monte Carlo   (medians; found: of {given.seeds})")
    for name in given.names or PLANTED:
        with TemporaryDirectory() as folder:
            rows = compare(PLANTED[name], Path(folder), given.seeds, given.most)
        first, total, flown, took, cma, drawn = zip(*rows, strict=True)
        middle = [float(np.median(each)) for each in (first, total, took, cma, drawn)]
        print(
            f"{name:20} {sum(flown):5} {middle[0]:6.0f} {middle[1]:7.0f} {max(took):8.1f} {middle[3]:7.0f} "
            f"{'>=' if middle[4] >= given.most else '  '}{middle[4]:9.0f}   ratios {middle[3] / middle[0]:.1f}, "
            f"{middle[4] / middle[0]:.1f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
