"""Pictures of flights, panel by panel as the craft asks for: what is tracked, efforts, actuators.

Made to be read at half the width of a page: few words, units on every axis, bounds drawn.
"""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.missions.flight import Flight
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.panel import Panel
from casadi_gnc.missions.recording import funnel_signals
from casadi_gnc.reports.thinning import kept
from casadi_gnc.system.pictures import COLOURS, FONT, SMALL, legend, rows, save, titled
from casadi_gnc.system.text import picture

#: Points drawn of a signal; more are thinned to the envelope's extremes.
_POINTS = 2000
#: Up to so many actuators are drawn as lines.
_FEW = 6


def plot_flights(mission: Mission, flights: Sequence[Flight], folder: Path, ending: str = "png") -> list[Path]:
    """Draw each flight, and all in one picture where there are several; return their paths."""
    drawn = [plot_flight(mission, flight, folder, ending) for flight in flights]
    return drawn if len(flights) < 2 else [*drawn, plot_comparison(mission, flights, folder, ending)]


def plot_flight(mission: Mission, flight: Flight, folder: Path, ending: str = "png") -> Path:
    """Draw one flight as `<scheme>.png`, .svg or .pdf, a panel for each of the mission's, and return its path."""
    panels = mission.craft.panels(mission)
    figure, axes = rows(len(panels), height=2.8 * len(panels))
    draw = {"tracked": _tracked, "effort": _effort, "actuators": _actuators, "lines": _signal}
    for panel, each in zip(panels, axes, strict=True):
        draw[panel.kind](each, mission, flight, panel)
    title = f"{mission.title}\n{flight.title}" if mission.title else flight.title
    figure.suptitle(titled(title), fontsize=FONT, x=0.02, ha="left")
    axes[-1].set_xlabel("time [s]")
    return save(figure, folder / f"{flight.scheme}.{ending}")


def plot_comparison(mission: Mission, flights: Sequence[Flight], folder: Path, ending: str = "png") -> Path:
    """Draw all flights on logarithmic axes and return the path of the picture.

    Drawn is the share of each funnel that was used, or, where there is no funnel, the largest
    component of every tracked signal; of a craft whose pictures track nothing, of what else they show.
    """
    wanted: list[tuple[str, str, float | None, str]]
    several = len(mission.funnels) > 1
    wanted = [
        (
            funnel_signals(mission, funnel).names[-1],
            f"{funnel.signal}: share used [-]" if several else "share of the funnel used [-]",
            1.0,
            "" if number else "wall of the funnel",
        )
        for number, funnel in enumerate(mission.funnels)
    ]
    if not wanted:
        for panel, signal in _compared(mission):
            level = next(iter(_thresholds(mission, signal)), None)
            unit = flights[0].unit(signal)
            told = "" if level is None else f"settled below {level:g} {unit}".rstrip(" -")
            wanted.append((signal, f"largest {panel.label} component [{unit or '-'}]", level, told))
    figure, axes = rows(len(wanted), height=4.8 if len(wanted) == 1 else 2.8 * len(wanted) + 1)
    for each, (signal, label, level, told) in zip(axes, wanted, strict=True):
        for colour, flight in zip(COLOURS, flights, strict=False):
            size = np.abs(flight.block(signal)).max(axis=1)
            title = picture(flight.title) if each is axes[0] else None
            each.semilogy(*_thin(flight.time, np.maximum(size, 1e-12)), color=colour, label=title, linewidth=1.8)
        if level is not None:
            each.axhline(level, color="0.4", linestyle="--", linewidth=1.2, label=told)
        each.set_ylabel(label if len(wanted) == 1 else "\n".join(textwrap.wrap(label, 22)))
    axes[-1].set_xlabel("time [s]")
    axes[0].set_title(titled(mission.title), fontsize=FONT, loc="left")
    figure.legend(loc="outside lower center", fontsize=SMALL, frameon=False)
    return save(figure, folder / f"comparison.{ending}")


def _compared(mission: Mission) -> list[tuple[Panel, str]]:
    """Return the panels whose signals are compared, each with the name under which its signal is recorded."""
    panels, actuation = mission.craft.panels(mission), mission.schemes[0].actuation
    for kind in ("tracked", "lines", "actuators"):
        found = [(panel, panel.signal) for panel in panels if panel.kind == kind]
        if found:
            return found
    made = dict(zip(actuation.effort.names, actuation.named("achieved").names, strict=True))
    return [(panel, made[panel.signal]) for panel in panels]


def _thresholds(mission: Mission, signal: str) -> list[float]:
    return [m.threshold for m in mission.metrics if m.kind in ("settling", "reaching") and m.signal == signal]


def _thin(time: np.ndarray, signal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return at most about `_POINTS` points that keep every extreme of each short stretch."""
    picked = kept(signal[:, None], _POINTS // 2)
    return time[picked], signal[picked]


def _lines(axes: Any, time: np.ndarray, signals: np.ndarray, labels: Sequence[str], **style: Any) -> None:
    for i, label in enumerate(labels):
        axes.plot(*_thin(time, signals[:, i]), color=COLOURS[i % len(COLOURS)], label=label, linewidth=1.3, **style)


def _labels(count: int) -> tuple[str, ...]:
    """Return the names of a signal's elements: none for a scalar, axes for three, else numbers."""
    return ("",) if count == 1 else ("x", "y", "z") if count == 3 else tuple(str(i) for i in range(1, count + 1))


def _axis(panel: Panel, flight: Flight, signal: str) -> str:
    unit = panel.unit or flight.unit(signal)
    return f"{panel.label} [{unit or '-'}]"


def _signal(axes: Any, mission: Mission, flight: Flight, panel: Panel) -> None:
    """Draw a recorded signal, its magnitude on a logarithmic axis if so wanted."""
    block = flight.block(panel.signal) * panel.scale
    if panel.logarithmic:
        block = np.maximum(np.abs(block), 1e-12)
        axes.set_yscale("log")
    _lines(axes, flight.time, block, _labels(block.shape[1]))
    axes.set_ylabel(_axis(panel, flight, panel.signal))
    if panel.level is not None:
        axes.axhline(panel.level * panel.scale, color="0.4", linestyle="--", linewidth=1.2, label=panel.level_label)
    if block.shape[1] > 1 or panel.level is not None:
        legend(axes, block.shape[1] + 1)


def _tracked(axes: Any, mission: Mission, flight: Flight, panel: Panel) -> None:
    """Draw a signal that goes to zero: in its funnel, or with the threshold at which it counts as settled."""
    funnel = next((f for f in mission.funnels if f.signal == panel.signal), None)
    block = flight.block(panel.signal)
    _lines(axes, flight.time, block, _labels(block.shape[1]))
    axes.set_ylabel(_axis(panel, flight, panel.signal))
    if funnel is not None:
        _walls(axes, flight, *funnel_signals(mission, funnel).names[:2])
        return
    thresholds = _thresholds(mission, panel.signal)
    largest = float(np.abs(block).max())
    finest = thresholds[0] if thresholds else max(1e-3 * largest, 1e-12)
    axes.set_yscale("symlog", linthresh=finest)
    _symmetric_ticks(axes, finest, largest)
    for threshold in thresholds[:1]:
        axes.axhspan(-threshold, threshold, color="0.92", zorder=0)
        axes.annotate(
            f"±{threshold:g}", (0.995, threshold), xycoords=("axes fraction", "data"), ha="right", va="bottom",
            fontsize=SMALL, color="0.3",
        )  # fmt: skip
    legend(axes, block.shape[1])


def _walls(axes: Any, flight: Flight, lower: str, upper: str) -> None:
    walls = [flight.block(lower), flight.block(upper)]
    for wall in walls:
        for i in range(wall.shape[1]):
            axes.plot(*_thin(flight.time, wall[:, i]), color=COLOURS[i], linestyle="--", linewidth=0.9)
    axes.plot([], [], color="0.3", linestyle="--", linewidth=0.9, label="funnel")
    # Logarithmic down to the walls' last width, so that the end of the flight can be seen too.
    narrowest = float(np.min(np.abs([wall[-1] for wall in walls])))
    threshold = 10.0 ** np.floor(np.log10(max(narrowest, 1e-12)))
    axes.set_yscale("symlog", linthresh=threshold)
    _symmetric_ticks(axes, threshold, 1.0)
    legend(axes, 4)


def _symmetric_ticks(axes: Any, finest: float, largest: float) -> None:
    """Put ticks at zero and at decades on both sides, few enough to be read."""
    first = np.ceil(np.log10(finest) - 1e-9)
    last = max(np.ceil(np.log10(max(largest, finest)) - 1e-9), first)
    step = max(1, int(np.ceil((last - first + 1) / 3)))
    decades = 10.0 ** np.arange(first, last + 1, step)
    axes.set_yticks([*-decades[::-1], 0.0, *decades])
    axes.minorticks_off()


def _effort(axes: Any, mission: Mission, flight: Flight, panel: Panel) -> None:
    """Draw what was commanded (thin) and what the actuators made of it, with the virtual-control limit."""
    actuation = mission.scheme(flight.scheme).actuation
    index = actuation.effort.names.index(panel.signal)
    limited, achieved = (actuation.named(stage).names[index] for stage in ("limited", "achieved"))
    commanded = flight.block(limited) * panel.scale
    for i in range(commanded.shape[1]):
        axes.plot(*_thin(flight.time, commanded[:, i]), color=COLOURS[i], linewidth=0.8, alpha=0.35)
    axes.plot([], [], color="0.3", linewidth=0.8, alpha=0.5, label="commanded")
    _lines(axes, flight.time, flight.block(achieved) * panel.scale, _labels(commanded.shape[1]))
    rows = actuation.effort.place(panel.signal)
    for limit in (min(actuation.limit_below[rows]), max(actuation.limit_above[rows])):
        axes.axhline(limit * panel.scale, color="0.4", linestyle="--", linewidth=1)
    axes.plot([], [], color="0.4", linestyle="--", linewidth=1, label="limit")
    axes.set_ylabel(_axis(panel, flight, achieved))
    legend(axes, 5)


def _actuators(axes: Any, mission: Mission, flight: Flight, panel: Panel) -> None:
    """Draw few actuators as lines with their bounds; many as rows whose brightness is their command."""
    block, actuation = flight.block(panel.signal) * panel.scale, mission.scheme(flight.scheme).actuation
    rows = mission.truth.inputs.place(panel.signal)
    lowest, highest = (panel.scale * edge for edge in (min(actuation.lower[rows]), max(actuation.upper[rows])))
    axes.set_ylabel(panel.label if block.shape[1] > _FEW else _axis(panel, flight, panel.signal))
    if block.shape[1] <= _FEW:
        _lines(axes, flight.time, block, _labels(block.shape[1]))
        for edge in (lowest, highest):
            axes.axhline(edge, color="0.4", linestyle="--", linewidth=1)
        legend(axes, block.shape[1])
        return
    stretch = max(1, len(block) // 700)
    whole = len(block) // stretch * stretch
    mean = block[:whole].reshape(-1, stretch, block.shape[1]).mean(axis=1)
    ends = (flight.time[0], flight.time[whole - 1], 0.5, block.shape[1] + 0.5)
    image = axes.imshow(
        mean.T, aspect="auto", origin="lower", extent=ends, cmap="cividis", interpolation="nearest",
        vmin=lowest, vmax=highest,
    )  # fmt: skip
    axes.grid(visible=False)
    bar = axes.figure.colorbar(image, ax=axes, pad=0.01)
    bar.ax.set_title(panel.unit or flight.unit(panel.signal), fontsize=SMALL)
    bar.ax.tick_params(labelsize=SMALL)
