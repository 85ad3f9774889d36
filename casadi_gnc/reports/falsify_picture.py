"""Draw how a requirement's robustness falls on the way to a break, and along the flights at both ends of it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.missions.flight import Flight
from casadi_gnc.missions.requirements import Requirement
from casadi_gnc.missions.requirements.instants import instants
from casadi_gnc.system.pictures import COLOURS, FONT, SMALL, check_ending, plain, save, sheet, titled
from casadi_gnc.system.text import picture


def draw(
    title: str,
    requirement: Requirement,
    steps: Sequence[tuple[str, int, float, float]],
    way: Sequence[tuple[float, float]],
    flights: Sequence[Flight],
    target: Path,
    *,
    unit: str = "",
) -> Path:
    """Draw the search, and what its nominal flight and its break have left at each instant.

    Parameters
    ----------
    title : of the picture.
    requirement : that was to break.
    steps : what the search did, after how many flights, the robustness, the distance in standard deviations.
    way : distance and robustness along the straight way to the smallest break; none where there is none.
    flights : the nominal one and the break's, or none.
    target : the file; `ProblemError` for an ending that is no picture's.
    unit : of the robustness.
    """
    check_ending(target)
    told = [found for found in (instants(requirement, each) for each in flights) if found is not None]
    figure = sheet(7.4 if told else 4.4)
    panels = figure.subplots(2 if told else 1, 1, squeeze=False)[:, 0]
    label = f"robustness [{unit or '-'}]"
    _search(panels[0], steps, way)
    panels[0].set(xlabel="distance from the file's numbers [standard deviations]", ylabel=picture(label))
    panels[0].set_title(titled(title), fontsize=FONT, loc="left")
    for found, name, colour in zip(told, ("the file as it is", "the break"), COLOURS, strict=False):
        panels[1].plot(found.time, found.margin, color=colour, linewidth=1.6, label=name)
    if told:
        low, high = told[0].asked
        panels[1].axvspan(low, high, color="0.93", zorder=0, label="where it is asked")
        _scaled(panels[1], [found.margin[(found.time >= low) & (found.time <= high)] for found in told])
        panels[1].set(xlabel="time [s]", ylabel=picture(f"left at each instant [{unit or '-'}]"))
    for panel in panels:
        plain(panel)
        panel.axhline(0, color="0.3", linewidth=0.8)
        panel.legend(fontsize=SMALL, frameon=False)
    return save(figure, target)


def _search(panel: Any, steps: Sequence[tuple[str, int, float, float]], way: Sequence[tuple[float, float]]) -> None:
    """Draw the straight way as a line, and each step of the search with the number of flights until it."""
    if way:
        panel.plot(*np.array(way).T, color=COLOURS[0], linewidth=1.6, marker=".", label="straight way to the break")
    known = [each for each in steps if np.isfinite(each[2])]
    distance, value = [each[3] for each in known], [each[2] for each in known]
    panel.plot(distance, value, "o", color=COLOURS[1], markersize=6, label="steps of the search, after so many flights")
    panel.margins(y=0.12)
    for _, count, robustness, away in known:
        panel.annotate(
            str(count), (away, robustness), xytext=(5, 5), textcoords="offset points", fontsize=SMALL, color=COLOURS[1]
        )


def _scaled(panel: Any, asked: Sequence[np.ndarray]) -> None:
    """Give most of the ordinate to what is seen while it is asked; what comes before may be a hundred times as far."""
    values = np.concatenate([each[np.isfinite(each)] for each in asked])
    if not len(values):
        return
    low, high = min(0.0, float(values.min())), max(0.0, float(values.max()))
    room = 0.25 * (high - low) or 1.0
    panel.set_ylim(low - room, high + room)
