"""Draw the loops of schemes, cut at each effort: Nichols and Bode pictures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.checking.broken_loops import SchemeMargins
from casadi_gnc.system.pictures import COLOURS, FONT, SMALL, check_ending, plain, save, sheet, titled
from casadi_gnc.system.text import picture

_DASHES = ("-", "--", ":", "-.")
#: Ends of the axis of gain, [dB].
_ENDS = (-60.0, 60.0)


def draw(title: str, found: Sequence[SchemeMargins], target: Path) -> Path:
    """Draw a line for each effort of each scheme; raise `ProblemError` for an ending that is no picture's."""
    check_ending(target)
    figure = sheet(8.4)
    nichols, size, turn = figure.subplots(3, 1, height_ratios=(2.2, 1, 1))
    for panel in (nichols, size, turn):
        plain(panel)
    slowest = np.inf
    for dashes, one in zip(_DASHES, found, strict=False):
        efforts = list(one.channels)[: one.loop.channels]
        for i, (colour, name) in enumerate(zip(COLOURS, efforts, strict=False)):
            loop = one.loop.channel(i)
            grid = loop.frequencies()
            values = loop.at(grid)[:, 0, 0]
            decibels = np.clip(20 * np.log10(np.maximum(np.abs(values), 1e-9)), -200, 200)
            degrees = np.rad2deg(np.unwrap(np.angle(values)))
            degrees -= 360 * np.round((degrees[np.argmin(np.abs(decibels))] + 180) / 360)  # nearest to -180 at 0 dB
            slowest = min(slowest, grid[np.argmax(decibels < _ENDS[1])])
            label = picture(name if len(found) == 1 else f"{one.scheme}, {name}")
            look = {"color": colour, "linestyle": dashes, "linewidth": 1.6}
            nichols.plot(degrees, decibels, label=label, **look)
            size.semilogx(grid, decibels, **look)
            turn.semilogx(grid, degrees, **look)
    _critical(nichols, min(one.disk_of_efforts for one in found))
    nichols.set(xlim=(-360, 0), ylim=_ENDS, xlabel="phase [deg]", ylabel="gain [dB]")
    nichols.set_xticks(range(-360, 1, 45))
    figure.legend(fontsize=SMALL, frameon=False, ncols=2, loc="outside lower center")
    nichols.set_title(titled(title), fontsize=FONT, loc="left")
    size.axhline(0, color="0.3", linewidth=0.8)
    size.set(ylim=_ENDS, ylabel="gain [dB]", xlim=(slowest, None))
    turn.axhline(-180, color="0.3", linewidth=0.8)
    turn.set(ylim=(-360, 0), xlabel="frequency [rad/s]", ylabel="phase [deg]", xlim=(slowest, None))
    turn.set_yticks(range(-360, 1, 90))
    return save(figure, target)


def _critical(panel: Any, alpha: float) -> None:
    """Mark -1, and the disk around it that no line enters."""
    panel.plot(-180, 0, "x", color="black", markersize=8)
    circle = np.exp(1j * np.linspace(0, 2 * np.pi, 721)) * min(alpha, 1.999) / 2
    inside = -(1 + circle) / (1 - circle)
    degrees = np.rad2deg(np.angle(inside))
    panel.fill(np.where(degrees > 0, degrees - 360, degrees), 20 * np.log10(np.abs(inside)), color="0.85", zorder=0)
