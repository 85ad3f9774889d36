"""Pictures of a run: how often a contestant is within a factor of the fastest, and how long it takes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.benchmarks.results import Results
from casadi_gnc.benchmarks.statistics import charged, performance_profile
from casadi_gnc.benchmarks.summary import contestants_of, groups, timings
from casadi_gnc.system.files import write_beside
from casadi_gnc.system.text import picture

#: Okabe and Ito's colours, told apart with every kind of colour vision; beyond seven the line's style changes.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
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
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    times, limit = times_of(results, group), results.header["settings"]["time_limit"]
    figure = Figure(figsize=(11, 0.5 + max(4.0, 0.32 * len(times))), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=False)
    _profile(left, times, limit)
    _spread(right, times, limit)
    figure.suptitle(
        picture(f"{results.header['title']}: {group}, accuracy {results.header['settings']['accuracy']}"),
        ha="left",
        x=0.02,
    )
    target = folder / f"{group}.svg"
    with rc_context({"svg.hashsalt": group}):  # the same picture is the same file
        write_beside(target, lambda path: figure.savefig(path, format="svg", metadata={"Date": None}))
    return target


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
    axes.grid(alpha=0.3)
    axes.legend(fontsize=7, loc="lower right")


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
        axes.text(1.02, place, text, transform=axes.get_yaxis_transform(), va="center", fontsize=8)
    axes.axvline(1e6 * limit, color="#888888", linestyle=":", linewidth=1)
    axes.set_xscale("log")
    axes.set_xlabel("warm solve [us]: least, 5 to 95 %, median, largest")
    axes.set_yticks([])
    axes.invert_yaxis()
    axes.grid(alpha=0.3, axis="x")
