"""From measurements to a table: one row a contestant and family, and one a contestant and set."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from casadi_gnc.benchmarks.results import Cell, Results
from casadi_gnc.benchmarks.statistics import Ratio, charged, compare_times, shifted_geometric_mean

#: Columns of a row, in order; times in microseconds. None: not measured, or not reported by the contestant.
COLUMNS = (
    "group",
    "family",
    "contestant",
    "samples",
    "passes",
    "success",
    "correct",
    "load_us",
    "setup_us",
    "first_us",
    "cold_us",
    "warm_us",
    "p95_us",
    "p99_us",
    "max_us",
    "solver_us",
    "wrapper_us",
    "mean_us",
    "violation",
    "gap",
    "missed",
    "missed_max",
    "iterations",
    "memory_MB",
    "failures",
)
ALL = "*"


@dataclass(frozen=True, eq=False)
class Overview:
    """Hold what is made of a run: rows with the keys `COLUMNS`, and each set's ranking."""

    results: Results
    rows: list[dict[str, Any]]
    orders: dict[str, list[tuple[str, Ratio | None]]]

    def whole(self, group: str) -> dict[str, dict[str, Any]]:
        """Return the rows of a whole set by contestant, fast ones first."""
        return {row["contestant"]: row for row in self.rows if row["group"] == group and row["family"] == ALL}


def overview(results: Results) -> Overview:
    """Return rows and rankings of a run."""
    return Overview(results, summarise(results), {group: ranking(results, group) for group in groups(results)})


def alike(order: list[tuple[str, Ratio | None]]) -> list[list[str]]:
    """Return groups of neighbours in a ranking that do not differ by more than 20 % beyond doubt."""
    found: list[list[str]] = []
    for who, ratio in order:
        if ratio is None or ratio.is_notable:
            found.append([who])
        else:
            found[-1].append(who)
    return [group for group in found if len(group) > 1]


def groups(results: Results) -> dict[str, list[str]]:
    """Return the families of each set, in order."""
    found: dict[str, list[str]] = {}
    for name, family in results.header["families"].items():
        found.setdefault(family["group"], []).append(name)
    return found


def contestants_of(results: Results, families: Iterable[str]) -> list[str]:
    """Return those that were measured on every one of some families."""
    return [who for who in results.contestants if all(results.of(who, family, "warm") for family in families)]


def timings(results: Results, who: str, family: str, mode: str = "warm") -> tuple[np.ndarray, np.ndarray]:
    """Return the passes (P, K) of a contestant [s], and whether each sample succeeded in all of them, (K,)."""
    cells, limit = results.of(who, family, mode), results.header["settings"]["time_limit"]
    passes = np.array([cell.seconds for cell in cells], dtype=float)
    good = np.all([cell.good for cell in cells], axis=0)
    late = np.all(~(passes <= limit), axis=0)
    return passes, good & ~late


def summarise(results: Results) -> list[dict[str, Any]]:
    """Return rows with the keys `COLUMNS`: of every family, then of every set (family "*"), ranked by its mean."""
    rows = []
    for group, families in groups(results).items():
        for family in families:
            rows += [_row(results, who, group, [family], family) for who in contestants_of(results, [family])]
        whole = [_row(results, who, group, families, ALL) for who in contestants_of(results, families)]
        rows += sorted(whole, key=lambda row: row["mean_us"])
    return rows


def ranking(results: Results, group: str) -> list[tuple[str, Ratio | None]]:
    """Return the contestants of a set from fast to slow, each with its ratio to the one before."""
    families, settings = groups(results)[group], results.header["settings"]
    data = {who: [timings(results, who, f) for f in families] for who in contestants_of(results, families)}
    limit, shift = settings["time_limit"], settings["shift"]
    means = {who: _mean(some, limit, shift) for who, some in data.items()}
    order = sorted(data, key=lambda who: means[who])
    found: list[tuple[str, Ratio | None]] = []
    for place, who in enumerate(order):
        ratio = compare_times(data[who], data[order[place - 1]], limit=limit, shift=shift) if place else None
        found.append((who, ratio))
    return found


def _mean(families: list[tuple[np.ndarray, np.ndarray]], limit: float, shift: float) -> float:
    return shifted_geometric_mean(np.concatenate([charged(*one, limit) for one in families]), shift)


def _row(results: Results, who: str, group: str, families: list[str], name: str) -> dict[str, Any]:
    settings = results.header["settings"]
    limit = settings["time_limit"]
    warm, cold = ([c for f in families for c in results.of(who, f, mode)] for mode in ("warm", "cold"))
    data = [timings(results, who, f) for f in families]
    times = np.concatenate([charged(*one, limit) for one in data])
    cold_times = [charged(*timings(results, who, f, "cold"), limit) for f in families if results.of(who, f, "cold")]
    own, wrapper = _apart(results, who, families)
    good = np.concatenate([one[1] for one in data])
    first = [cell.first for cell in warm if cell.number == 0]
    return dict(
        zip(
            COLUMNS,
            (
                group,
                name,
                who,
                int(good.size),
                min(len(passes) for passes, _ in data),
                float(np.mean(good)),
                float(np.mean([c == g for cell in warm for c, g in zip(cell.claimed, cell.good, strict=True)])),
                _us(_largest(cell.load for cell in warm + cold)),
                _us(_middle(_least(c.setup for c in warm + cold if c.family == f) for f in families)),
                _us(_middle(first)),
                _us(float(np.median(np.concatenate(cold_times)))) if cold_times else None,
                *(_us(float(np.quantile(times, share))) for share in (0.5, 0.95, 0.99, 1.0)),
                _us(own),
                _us(wrapper),
                _us(_mean(data, limit, settings["shift"])),
                _largest(value for cell in warm for value in cell.violation),
                _largest(value for cell in warm for value in cell.gap),
                _told(_middle(value for cell in warm for value in cell.missed)),
                _told(_largest(value for cell in warm for value in cell.missed)),
                float(np.mean([value for cell in warm for value in cell.iterations])),
                _largest(cell.memory_MB for cell in warm + cold),
                len(lost(warm + cold)),
            ),
            strict=True,
        )
    )


def lost(cells: list[Cell]) -> dict[str, int]:
    """Return how solves failed to answer, with their numbers."""
    found: dict[str, int] = {}
    for cell in cells:
        for why in cell.failures.values():
            found[why] = found.get(why, 0) + 1
    return found


def _apart(results: Results, who: str, families: list[str]) -> tuple[float, float]:
    """Return the median time that the contestant reports and that of what is around it; NaN if it reports none."""
    own, around = [], []
    for family in families:
        cells = results.of(who, family, "warm")
        seconds = np.array([cell.seconds for cell in cells], dtype=float)
        inner = np.array([cell.own for cell in cells], dtype=float)
        where = np.argmin(np.where(np.isnan(seconds), np.inf, seconds), axis=0)  # both of the same solve
        columns = np.arange(seconds.shape[1])
        own.append(inner[where, columns])
        around.append(seconds[where, columns] - inner[where, columns])
    return _middle(np.concatenate(own)), _middle(np.concatenate(around))


def _us(seconds: float) -> float | None:
    return None if np.isnan(seconds) else 1e6 * seconds


def _told(value: float) -> float | None:
    return None if np.isnan(value) else value


def _known(values: Iterable[float]) -> np.ndarray:
    array = np.array(list(values), dtype=float)
    return array[~np.isnan(array)]


def _middle(values: Iterable[float]) -> float:
    known = _known(values)
    return float(np.median(known)) if known.size else float("nan")


def _least(values: Iterable[float]) -> float:
    known = _known(values)
    return float(np.min(known)) if known.size else float("nan")


def _largest(values: Iterable[float]) -> float:
    known = _known(values)
    return float(np.max(known)) if known.size else float("nan")
