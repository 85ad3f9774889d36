"""Pictures of a run: how often a contestant is within a factor of the fastest, and how long it takes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.benchmarks.results import Results
from casadi_gnc.benchmarks.statistics import charged, performance_profile
from casadi_gnc.benchmarks.summary import contestants_of, groups, timings
from casadi_gnc.system.pictures import COLOURS, FONT, SMALL, plain, save, sheet, titled

#: Beyond seven contestants the line's style changes.
_STYLES = ("-", "--", ":", "-.")


def times_of(results: Results, group: str) -> dict[str, np.ndarray]:
    """Return each contestant's charged times [s] over all samples of a set, fast ones first."""
    families, limit = groups(results)[group], results.header["settings"]["time_limit"]
    found = {
        who: np.concatenate([charged(*timings(results, who, family), limit) for family in families])
        for who in contestants_of(results, families)
    }
    return dict(sorted(found.items(), key=lambda item: float(np.mean(np.log(item[1])))))


def plot_group(results: Results, group: str, folder: Path) -> Path:
    """Draw the performance profile and the spread of times of one set as `<set>.svg`; return its path."""
    times, limit = times_of(results, group), results.header["settings"]["time_limit"]
    spread = 0.8 + 0.3 * len(times)
    figure = sheet(5.2 + spread)
    above, below = figure.subplots(2, 1, height_ratios=(4.4, spread))
    for panel in (above, below):
        plain(panel)
    _profile(above, times, limit)
    _spread(below, times, limit)
    title = f"{results.header['title']}: {group}, accuracy {results.header['settings']['accuracy']}"
    figure.suptitle(titled(title), fontsize=FONT, ha="left", x=0.02)
    return save(figure, folder / f"{group}.svg")


def _style(place: int) -> dict[str, Any]:
    return {"color": COLOURS[place % len(COLOURS)], "linestyle": _STYLES[place // len(COLOURS) % len(_STYLES)]}


def _profile(axes: Any, times: dict[str, np.ndarray], limit: float) -> None:
    factors = np.logspace(0, 5, 301)
    for place, (who, share) in enumerate(performance_profile(times, limit, factors).items()):
        axes.step(factors, 100 * share, where="post", label=who, **_style(place))
    axes.set_xscale("log")
    axes.set_xlabel("within this factor of the fastest [-]")
    axes.set_ylabel("samples solved [%]")
    axes.set_ylim(-2, 102)
    axes.legend(fontsize=SMALL, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))


def _spread(axes: Any, times: dict[str, np.ndarray], limit: float) -> None:
    """Draw, for each contestant, from its fastest to its slowest solved sample, the median as a dot."""
    for place, (who, seconds) in enumerate(times.items()):
        solved = 1e6 * seconds[seconds < limit]
        colour = COLOURS[place % len(COLOURS)]
        if solved.size:
            axes.plot([solved.min(), solved.max()], [place, place], color=colour, linewidth=2)
            axes.plot(np.quantile(solved, [0.05, 0.95]), [place, place], color=colour, linewidth=6, alpha=0.4)
            axes.plot(np.median(solved), place, "o", color=colour)
        failed = int(np.sum(seconds >= limit))
        text = who if not failed else f"{who} ({failed} failed)"
        axes.text(1.02, place, text, transform=axes.get_yaxis_transform(), va="center", fontsize=SMALL)
    axes.axvline(1e6 * limit, color="#888888", linestyle=":", linewidth=1)
    axes.set_xscale("log")
    axes.set_xlabel("warm solve [us]: least, 5 to 95 %, median, largest")
    axes.set_yticks([])
    axes.set_ylim(len(times) - 0.5, -0.5)
    axes.grid(axis="y", visible=False)
