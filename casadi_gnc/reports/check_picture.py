"""Draw the checks of a problem: how much of each limit is used, at one glance."""

from __future__ import annotations

import math
from pathlib import Path

from casadi_gnc.checks import Check
from casadi_gnc.reports.style import check_ending, save
from casadi_gnc.system.text import picture

#: Colours told apart with every kind of colour vision; each verdict has a mark of its own too.
_LOOK = {"ok": ("#009E73", "o"), "note": ("#56B4E9", "s"), "warn": ("#E69F00", "^"), "fail": ("#D55E00", "X")}
#: Shares are drawn within these ends; an arrow's worth of being off the axis is enough to know.
_ENDS = (1e-3, 1e3)


def used(check: Check) -> float:
    """Return the share of the limit that is used: above 1 it is not kept."""
    value, limit = check.value, check.limit
    if math.isnan(value):
        return _ENDS[1]
    if limit > 0 and value > 0:
        share = limit / value if check.at_least else value / limit
    else:
        share = _ENDS[0] if check.holds else _ENDS[1]
    return min(max(share, _ENDS[0]), _ENDS[1])


def draw(title: str, checks: list[Check], target: Path) -> None:
    """Draw one row for each check and scheme; raise `ProblemError` for an ending that is no picture's."""
    from matplotlib.figure import Figure

    check_ending(target)
    figure = Figure(figsize=(7.2, 1.3 + 0.28 * len(checks)), dpi=120, layout="constrained")
    axes = figure.subplots()
    for row, check in enumerate(reversed(checks)):
        colour, mark = _LOOK[check.verdict]
        axes.plot([_ENDS[0], used(check)], [row, row], color=colour, linewidth=1.2, alpha=0.5)
        axes.plot(used(check), row, marker=mark, color=colour, markersize=8, linestyle="none")
    axes.set_yticks(range(len(checks)))
    axes.set_yticklabels([f"{c.name}  {c.scheme}".rstrip() for c in reversed(checks)], fontsize=9)
    axes.set_xscale("log")
    axes.set_xlim(_ENDS[0] / 1.5, _ENDS[1] * 1.5)
    axes.axvline(1.0, color="0.3", linestyle="--", linewidth=1.2)
    axes.set_xlabel("share of the limit used [-]")
    axes.set_title(picture(title), fontsize=12, loc="left")
    axes.grid(axis="x", color="0.9")
    axes.spines[["top", "right"]].set_visible(False)
    for verdict, (colour, mark) in _LOOK.items():
        axes.plot([], [], marker=mark, color=colour, linestyle="none", label=verdict)
    figure.legend(loc="outside lower center", ncols=4, frameon=False)
    save(figure, target)
