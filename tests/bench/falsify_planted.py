"""Flights until a planted failure is found: falsify, CMA-ES and Monte Carlo, over seeds.

python tests/bench/falsify_planted.py [--seeds 20] [--compared 5] [--most 10000] [--dispersed N] [NAME ...]

Beside it stands the same search with slopes by differences alone; a slope there and back counts as four flights.
`--dispersed` keeps the first N dispersions. CMA-ES (Hansen's `cma`, extra `oracles`) searches the same set in the same
coordinates, builds evenly in one more, from the nominal with a step of a quarter of the set, and is stopped at its
first break. Monte Carlo draws from the dispersions, builds evenly. The seed is that of the plan, of the samples, and
of the noise; one with whose noise the planted failure is not in the set is passed over.
"""

from __future__ import annotations

import argparse
import itertools
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest import mock

import numpy as np

import casadi_gnc as gnc
from casadi_gnc.campaigns.plans import Independent
from casadi_gnc.tuning.broken_case import break_of
from casadi_gnc.tuning.builds import builds_of
from casadi_gnc.tuning.descending import Effort
from casadi_gnc.tuning.flights import Flights, SpentError
from casadi_gnc.tuning.journal import Journal
from casadi_gnc.tuning.reach import Reach
from casadi_gnc.tuning.searching import search

sys.path.insert(0, str(Path(__file__).parents[1] / "tuning"))
from planted import PLANTED


def fresh(builds, most):
    """Return flights that are counted from nothing, of builds that are made already."""
    return Flights(builds, builds[0].objective.space, Journal({}), most)


class Plain:
    """A build that flies without asking whether a file of its row would be refused, as campaigns do."""

    def __init__(self, build):
        self.objective, self.changes, self.at = build.objective, build.changes, build.objective.at


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


def first_break(builds, seed: int):
    """Return what falsify's search flew until a break, and that flight; None where it finds none."""
    flights = fresh(builds, 1000)
    found = search(flights, Reach(flights.space), seed, Effort())
    return flights, found


def by_differences(builds, seed: int) -> int:
    """Return what the same search flew whose slopes are differences."""
    with mock.patch("casadi_gnc.tuning.flights.THERE_AND_BACK", 10**9):
        return first_break(builds, seed)[0].count


def flies_as_one(file: Path, flights, found, out: Path) -> bool:
    """Return whether a break, written as a file, flies as one."""
    mission = gnc.load(file)
    broken = break_of(mission, mission.schemes[0].name, mission.requirements[0], flights, found, out, [])
    return broken is not None and gnc.fly(out).verdicts["P"].word == "not met"


def _exists(objective, cause: str) -> bool:
    """Return whether the planted failure is there with this seed's noise: whether the end of its cause breaks."""
    point = objective.space.start.copy()
    point[objective.space.keys.index(cause)] = Reach(objective.space).radius
    return bool(objective.values(point[None, :])[0] < 0)


def main() -> None:
    """Print a line for each planted failure."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("names", nargs="*", default=[])
    asked.add_argument("--seeds", type=int, default=20)
    asked.add_argument("--compared", type=int, default=5, help="seeds for the others")
    asked.add_argument("--most", type=int, default=10000, help="flights of the others")
    asked.add_argument("--dispersed", type=int, help="dispersions that are kept; all if left out")
    given = asked.parse_args()
    print("medians; a count that was stopped is a lower bound; seconds and flights in all are of seed 0, all included")
    print(f"{'':20} p found first differences  CMA-ES  Monte Carlo  ratios  in all  seconds  re-flown as breaks")
    print(f"flights of falsify at most 1000, of the others {given.most}", flush=True)
    for name in given.names or PLANTED:
        planted = PLANTED[name]
        with TemporaryDirectory() as place:
            folder, rows, others = Path(place), [], []
            began = time.perf_counter()
            file = planted.write(folder / "whole.toml", dispersed=given.dispersed)
            whole = gnc.falsify(file, "P", over=planted.over, out=folder / "b.toml")
            took = time.perf_counter() - began
            mission = gnc.load(folder / "whole.toml")
            builds = builds_of(mission, mission.schemes[0].name, "P", dict(planted.over))
            plain, refly = [Plain(build) for build in builds], []
            for seed in itertools.count():
                if len(rows) == given.seeds:
                    break
                for build in builds:
                    build.objective.seed = seed
                if planted.cause and not _exists(builds[0].objective, planted.cause):
                    continue
                flights, found = first_break(builds, seed)
                rows.append((flights.count, found is not None, by_differences(builds, seed)))
                if len(others) < given.compared:
                    others.append((by_cma(plain, seed, given.most), by_monte_carlo(plain, seed, given.most)))
                    file = planted.write(folder / f"{seed}.toml", seed, given.dispersed)
                    refly += [flies_as_one(file, flights, found, folder / f"broken-{seed}.toml")] if found else []
        found = sum(broken for _, broken, _ in rows)
        first, differences = (float(np.median([row[i] for row in rows])) for i in (0, 2))
        cma, drawn = (float(np.median(each)) for each in zip(*others, strict=True))
        print(
            f"{name:20}{builds[0].objective.space.size:2} {found:2}/{len(rows)} {first:5.0f} {differences:11.0f}  "
            f"{cma:6.0f}  {drawn:11.0f}  {cma / first:.1f}, {drawn / first:.1f}  {whole.flights:6} {took:8.1f}  "
            f"{sum(refly)} of {len(refly)}",
            flush=True,
        )


if __name__ == "__main__":
    main()
