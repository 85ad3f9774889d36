"""Pictures of campaigns: how a metric is spread, how far it is known, and what drives it.

Each takes plain arrays and writes one file, .png, .svg or .pdf. Made to be read at half the width of a page.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.campaigns.statistics import Convergence, Estimate, Percentile
from casadi_gnc.system.pictures import COLOURS, FONT, SMALL, check_ending, plain, rows, save, sheet, titled
from casadi_gnc.system.text import picture

#: Cases drawn as points; more are thinned, the worst never.
_POINTS = 4000
#: Inputs with a panel of their own.
_PANELS = 6


def plot_histogram(
    values: np.ndarray,
    target: Path,
    *,
    label: str,
    percentiles: Sequence[Percentile] = (),
    limit: float | None = None,
    weights: np.ndarray | None = None,
    title: str = "",
) -> Path:
    """Draw how a metric is spread over all flights, and return the path of the picture.

    Parameters
    ----------
    values : (n,), one a flight; infinite ones, never reached, are counted in words.
    label : of the metric, with its unit, such as "settling time [s]".
    percentiles : each a line, with its bounds as a band.
    limit : that a requirement sets, a dashed line.
    weights : (n,), of a plan with importance.
    """
    check_ending(target)
    finite = np.isfinite(values)
    weight = np.ones(len(values)) if weights is None else np.asarray(weights)
    figure, (axes,) = rows(1, height=4.4)
    if finite.any():
        drawn, whole = np.asarray(values)[finite], float(weight.sum())
        edges = np.histogram_bin_edges(drawn, bins=min(60, max(10, 2 * round(len(drawn) ** (1 / 3)))))
        axes.hist(drawn, edges, weights=100 * weight[finite] / whole, color=COLOURS[0], alpha=0.55)
    for colour, found in zip(COLOURS[1:], percentiles, strict=False):
        name = f"{100 * found.share:.6g} %: "
        if math.isfinite(found.value):
            axes.axvline(found.value, color=colour, linewidth=1.8, label=f"{name}{found.value:.4g}")
        else:
            axes.plot([], [], color=colour, linewidth=1.8, label=f"{name}no value")
        if math.isfinite(found.low) and math.isfinite(found.high):
            axes.axvspan(found.low, found.high, color=colour, alpha=0.2, linewidth=0)
    if limit is not None:
        axes.axvline(limit, color="0.2", linestyle="--", linewidth=1.4, label=f"limit: {limit:.4g}")
    axes.set_xlabel(picture(label))
    axes.set_ylabel("flights [%]")
    told = f"{len(values)} flights" + (f", {int((~finite).sum())} without a value" if not finite.all() else "")
    axes.set_title(titled(f"{title}: {told}" if title else told), fontsize=FONT, loc="left")
    if percentiles or limit is not None:
        _below(figure, axes, 3)
    return save(figure, target)


def plot_convergence(
    found: Convergence, target: Path, *, label: str, level: float | None = None, level_label: str = "", title: str = ""
) -> Path:
    """Draw an estimate and its bounds as flights were added, and return the path of the picture.

    Parameters
    ----------
    found : arrays of one length; a bound that is infinite is not drawn.
    label : of the estimate, with its unit.
    level : that it is compared with, a dashed line, such as the share that is required.
    """
    check_ending(target)
    figure, (axes,) = rows(1, height=4.4)
    ends = [np.where(np.isfinite(end), end, np.nan) for end in (found.low, found.high)]
    axes.fill_between(found.flights, *ends, color=COLOURS[0], alpha=0.25, linewidth=0, label="bounds")
    value = np.where(np.isfinite(found.value), found.value, np.nan)
    axes.plot(found.flights, value, color=COLOURS[0], linewidth=1.8, label="estimate")
    if level is not None:
        axes.axhline(level, color="0.2", linestyle="--", linewidth=1.4, label=picture(level_label) or f"{level:.6g}")
    # The first flights tell little: their bounds would leave no room for the later ones.
    late = np.flatnonzero(found.flights >= math.sqrt(found.flights[0] * found.flights[-1]))
    told = np.concatenate([ends[0][late], ends[1][late], [] if level is None else [level]])
    if np.isfinite(told).any():
        low, high = float(np.nanmin(told)), float(np.nanmax(told))
        room = 0.1 * (high - low) or 0.1 * abs(high) or 1.0
        axes.set_ylim(low - room, high + room)
    axes.set_xscale("log")
    axes.set_xlabel("flights")
    axes.set_ylabel(picture(label))
    axes.ticklabel_format(axis="y", useOffset=False)
    axes.set_title(titled(title), fontsize=FONT, loc="left")
    _below(figure, axes, 3)
    return save(figure, target)


def plot_scatter(
    inputs: np.ndarray,
    output: np.ndarray,
    names: Sequence[str],
    target: Path,
    *,
    label: str,
    worst: Sequence[int] = (),
    title: str = "",
) -> Path:
    """Draw a metric over each input, the worst flights marked, and return the path of the picture.

    Parameters
    ----------
    inputs : (n, k), a column each; the first six are drawn, so put what drives the metric first.
    output : (n,); flights without a value, infinite ones, are crosses on the upper edge.
    names : (k,), of the inputs, with units.
    label : of the metric, with its unit.
    worst : places of flights that are marked.
    """
    check_ending(target)
    columns, count = np.asarray(inputs)[:, :_PANELS], len(output)
    values, marked = np.asarray(output, dtype=float), np.zeros(len(output), dtype=bool)
    marked[list(worst)] = True
    # Every so many-th: the order of flights says nothing, and the same flights are in all panels.
    shown = np.zeros(count, dtype=bool)
    shown[:: max(1, -(-count // _POINTS))] = True
    finite = np.isfinite(values)
    top = float(values[finite].max()) if finite.any() else 0.0
    across = 1 if columns.shape[1] == 1 else 2
    down = -(-columns.shape[1] // across)
    figure = sheet(2.9 * down + 0.6)
    panels = figure.subplots(down, across, sharey=True, squeeze=False).ravel()
    for place, (axes, name, column) in enumerate(zip(panels, names, columns.T, strict=False)):
        plain(axes)
        axes.plot(*_points(column, values, shown & finite & ~marked), ".", color="0.6", markersize=3)
        axes.plot(*_points(column, values, marked & finite), "o", color=COLOURS[1], markersize=5, label="worst")
        never = ~finite & (marked | shown)
        if never.any():
            axes.plot(column[never], np.full(int(never.sum()), top), "x", color="0.2", markersize=6, label="no value")
        axes.set_xlabel(picture(name))
        axes.locator_params(axis="x", nbins=4)
        if place % across == 0:
            axes.set_ylabel(picture(label))
    for axes in panels[columns.shape[1] :]:
        axes.set_visible(False)
    figure.suptitle(titled(title), fontsize=FONT, x=0.02, ha="left")
    _below(figure, panels[0], 2)
    return save(figure, target)


def plot_drivers(
    names: Sequence[str],
    target: Path,
    *,
    label: str,
    first: Sequence[Estimate],
    total: Sequence[Estimate] = (),
    kinds: tuple[str, str] = ("first order", "total"),
    title: str = "",
) -> Path:
    """Draw what drives a metric as bars with their bounds, the strongest on top, and return the path of the picture.

    Parameters
    ----------
    names : (k,), of the inputs.
    label : of the abscissa, such as "share of the variance [-]" or "rank correlation [-]".
    first, total : (k,), estimates; `total` may be left out. Those that are NaN have no bar.
    kinds : what the two are called.
    """
    check_ending(target)
    order = sorted(range(len(names)), key=lambda i: _size((total or first)[i]))
    figure, (axes,) = rows(1, height=1.7 + (0.55 if total else 0.38) * len(names))
    drawn = [(first, kinds[0], COLOURS[0], 0.2 if total else 0.0)] + (
        [(total, kinds[1], COLOURS[4], -0.2)] if total else []
    )
    for found, kind, colour, aside in drawn:
        values = np.array([found[i].value for i in order])
        ends = np.array([[found[i].low, found[i].high] for i in order]).T
        places = np.arange(len(order)) + aside
        axes.barh(places, values, height=0.36 if total else 0.6, color=colour, alpha=0.7, label=kind)
        axes.hlines(places, *ends, color="0.2", linewidth=1.4)
    axes.axvline(0.0, color="0.3", linewidth=1.0)
    axes.set_yticks(range(len(order)))
    axes.set_yticklabels([picture(names[i]) for i in order], fontsize=SMALL)
    axes.grid(axis="y", visible=False)
    axes.set_xlabel(picture(label))
    axes.set_title(titled(title), fontsize=FONT, loc="left")
    if total:
        _below(figure, axes, 2)
    return save(figure, target)


def _below(figure: Any, panel: Any, columns: int) -> None:
    """Put the legend of a panel below all, where it hides nothing."""
    handles, labels = panel.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=columns, fontsize=SMALL, frameon=False)


def _points(column: np.ndarray, values: np.ndarray, chosen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return column[chosen], values[chosen]


def _size(found: Estimate) -> float:
    return -1.0 if math.isnan(found.value) else abs(found.value)
