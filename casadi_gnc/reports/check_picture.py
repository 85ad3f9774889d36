"""Draw the checks of a problem: how much of each limit is used, at one glance."""

from __future__ import annotations

import math
from pathlib import Path

from casadi_gnc.checks import Check
from casadi_gnc.system.pictures import COLOURS, FONT, SMALL, check_ending, plain, save, sheet, titled

#: Each verdict has a mark of its own, beside its colour.
_LOOK = {"ok": (COLOURS[2], "o"), "note": (COLOURS[5], "s"), "warn": (COLOURS[4], "^"), "fail": (COLOURS[1], "X")}
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


def draw(title: str, checks: list[Check], target: Path) -> Path:
    """Draw one row for each check and scheme, and return the path of the picture.

    Raise `ProblemError` for an ending that is no picture's.
    """
    check_ending(target)
    figure = sheet(1.5 + 0.28 * len(checks))
    axes = figure.subplots()
    plain(axes)
    for row, check in enumerate(reversed(checks)):
        colour, mark = _LOOK[check.verdict]
        axes.plot([_ENDS[0], used(check)], [row, row], color=colour, linewidth=1.2, alpha=0.5)
        axes.plot(used(check), row, marker=mark, color=colour, markersize=8, linestyle="none")
    axes.set_yticks(range(len(checks)))
    axes.set_yticklabels([f"{c.name}  {c.scheme}".rstrip() for c in reversed(checks)], fontsize=SMALL)
    axes.set_ylim(-0.8, len(checks) - 0.2)
    axes.set_xscale("log")
    axes.set_xlim(_ENDS[0] / 1.5, _ENDS[1] * 1.5)
    axes.axvline(1.0, color="0.3", linestyle="--", linewidth=1.2)
    axes.set_xlabel("share of the limit used [-]")
    figure.suptitle(titled(title), fontsize=FONT, x=0.02, ha="left")
    axes.grid(axis="y", visible=False)
    for verdict, (colour, mark) in _LOOK.items():
        axes.plot([], [], marker=mark, color=colour, linestyle="none", label=verdict)
    figure.legend(loc="outside lower center", ncols=4, fontsize=SMALL, frameon=False)
    return save(figure, target)
