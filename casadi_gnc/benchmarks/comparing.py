"""Compare two runs: who became faster, by how much and how surely, and whether the ranking is the same."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from casadi_gnc.benchmarks.results import Results
from casadi_gnc.benchmarks.statistics import NOTABLE, Ratio, charged, compare_times, shifted_geometric_mean
from casadi_gnc.benchmarks.summary import contestants_of, groups, timings
from casadi_gnc.errors import BenchmarkError


@dataclass(frozen=True)
class Comparison:
    """Hold one set that both runs have.

    Parameters
    ----------
    families : that both have, with the same data.
    ratios : time in the second run over that in the first, by contestant.
    notable : number of pairs that differ by more than 20 % in the first run.
    swapped : those of them that come in the other order in the second.
    """

    group: str
    families: list[str]
    ratios: dict[str, Ratio]
    notable: int
    swapped: list[tuple[str, str]]


def compare(first: Results, second: Results) -> list[Comparison]:
    """Return the comparison of every set that both runs have.

    Raises
    ------
    BenchmarkError
        For runs that have nothing in common, or cannot be compared.
    """
    one, other = first.header, second.header
    for name in ("contest",):
        if one[name] != other[name]:
            raise BenchmarkError(f"{first.folder} is a run of {one[name]!r}, {second.folder} of {other[name]!r}")
    for name in ("accuracy", "samples", "clock", "time_limit"):
        if one["settings"][name] != other["settings"][name]:
            raise BenchmarkError(
                f"the runs cannot be compared: {name} is {one['settings'][name]} in {first.folder} and "
                f"{other['settings'][name]} in {second.folder}"
            )
    shared = [
        name
        for name, family in one["families"].items()
        if other["families"].get(name, {}).get("digest") == family["digest"]
    ]
    found = []
    for group, names in groups(first).items():
        families = [name for name in names if name in shared]
        both = [who for who in contestants_of(first, families) if who in contestants_of(second, families)]
        if families and both:
            found.append(_compared(first, second, group, families, both))
    if not found:
        raise BenchmarkError(f"{first.folder} and {second.folder} have no contestant with the same samples in common")
    return found


def conditions(results: Results) -> str:
    """Return what a reader must know of a run before comparing: version, machine, load, when."""
    header, machine = results.header, results.header["machine"]
    load = "not known" if machine["load"] is None else f"{machine['load'][0]:g}"
    return (
        f"{results.folder}: casadi-gnc {header['casadi_gnc']}, {machine['processor']}, load {load} at the start, "
        f"{machine['date']}"
    )


def _compared(first: Results, second: Results, group: str, families: list[str], both: list[str]) -> Comparison:
    settings = first.header["settings"]
    limit, shift = settings["time_limit"], settings["shift"]
    times = [{who: [timings(run, who, f) for f in families] for who in both} for run in (first, second)]
    means = [
        {
            who: shifted_geometric_mean(np.concatenate([charged(*f, limit) for f in some]), shift)
            for who, some in run.items()
        }
        for run in times
    ]
    ratios = {who: compare_times(times[1][who], times[0][who], limit=limit, shift=shift) for who in both}
    notable = [
        (fast, slow)
        for fast, slow in combinations(sorted(both, key=means[0].__getitem__), 2)
        if means[0][slow] > NOTABLE * means[0][fast]
    ]
    swapped = [(fast, slow) for fast, slow in notable if means[1][slow] < means[1][fast]]
    return Comparison(group, families, ratios, len(notable), swapped)


def sentences(found: Comparison) -> list[str]:
    """Return what the comparison says of a set."""
    told = []
    for who, ratio in found.ratios.items():
        verdict = "no difference" if not ratio.differs else "slower" if ratio.value > 1 else "faster"
        told.append(f"{who}: {ratio.value:.3g} times the time ({ratio.low:.3g} to {ratio.high:.3g}), {verdict}")
    order = f"{found.notable} pairs differ by more than {NOTABLE - 1:.0%} in the first run"
    if found.swapped:
        pairs = ", ".join(f"{fast} and {slow}" for fast, slow in found.swapped)
        told.append(f"{order}; {len(found.swapped)} of them come in the other order in the second: {pairs}")
    else:
        told.append(f"{order}; all come in the same order in the second")
    return told
