"""Pictures of flights: what was controlled and its bounds, the torque, the forces.

Made to be read at half the width of a page: few words, units on every axis, bounds drawn.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.files import write_beside
from casadi_gnc.missions.flight import Flight
from casadi_gnc.missions.mission import Mission

#: Okabe and Ito's colours, told apart with every kind of colour vision.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
#: Points drawn of a signal; more are thinned to the envelope's extremes.
_POINTS = 2000
#: Points; still legible when the picture is shown at half its width.
_FONT = 12


def plot_flight(mission: Mission, flight: Flight, folder: Path) -> Path:
    """Draw one flight as `<scheme>.png` and return its path.

    Three panels: attitude inside its funnel (or the rate, where the law has no funnel), torque
    wanted and achieved with the virtual-control limit, forces with their bounds.
    """
    figure, (top, middle, bottom) = _figure(3)
    if mission.funnel is not None:
        _inside_funnel(top, flight, mission.funnel.signal)
    else:
        _rate(top, mission, flight)
    _torque(middle, mission, flight)
    _forces(bottom, mission, flight)
    figure.suptitle(
        _plain(f"{mission.title}\n{flight.title}" if mission.title else flight.title),
        fontsize=_FONT + 1,
        x=0.02,
        ha="left",
    )
    bottom.set_xlabel("time [s]")
    return _save(figure, folder / f"{flight.scheme}.png")


def plot_comparison(mission: Mission, flights: Sequence[Flight], folder: Path) -> Path:
    """Draw all flights on one logarithmic axis and return the path of the picture.

    Drawn is the share of the funnel that was used, or the largest rate where there is no funnel.
    """
    figure, (axes,) = _figure(1, height=4.8)
    funnel = mission.funnel is not None
    for colour, flight in zip(COLOURS, flights, strict=False):
        size = flight["funnel_use"] if funnel else np.abs(flight["rate"]).max(axis=1)
        axes.semilogy(
            *_thin(flight.time, np.maximum(size, 1e-9)), color=colour, label=_plain(flight.title), linewidth=1.8
        )
    thresholds = [m.threshold for m in mission.metrics if m.kind == "settling" and m.signal == "rate"]
    for level, text in (
        [(1.0, "wall of the funnel")] if funnel else [(t, f"settled below {t:g} rad/s") for t in thresholds]
    ):
        axes.axhline(level, color="0.4", linestyle="--", linewidth=1.2, label=text)
    axes.set_ylabel("share of the funnel used [-]" if funnel else "largest rate component [rad/s]")
    axes.set_xlabel("time [s]")
    axes.set_title(_plain(mission.title), fontsize=_FONT + 1, loc="left")
    figure.legend(loc="outside lower center", fontsize=_FONT, frameon=False)
    return _save(figure, folder / "comparison.png")


def _figure(rows: int, height: float = 8.4) -> tuple[Any, Any]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.2, height), dpi=120, layout="constrained")
    axes = figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0]
    for panel in axes:
        panel.grid(color="0.9")
        panel.spines[["top", "right"]].set_visible(False)
        panel.tick_params(labelsize=_FONT)
        panel.xaxis.label.set_size(_FONT)
        panel.yaxis.label.set_size(_FONT)
    return figure, axes


def _legend(axes: Any, columns: int) -> None:
    """Put the legend above the panel, where it hides nothing."""
    axes.legend(
        ncols=columns, loc="lower right", bbox_to_anchor=(1.0, 0.98), fontsize=_FONT - 1, frameon=False,
        handlelength=1.4, columnspacing=1.2, borderaxespad=0.1,
    )  # fmt: skip


def _plain(text: str) -> str:
    """Return text that matplotlib does not take for mathematics."""
    return text.replace("$", r"\$")


def _thin(time: np.ndarray, signal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return at most `_POINTS` points that keep every extreme of each short stretch."""
    stretch = -(-len(time) // (_POINTS // 2))
    if stretch <= 2:
        return time, signal
    whole = len(time) // stretch * stretch
    blocks = signal[:whole].reshape(-1, stretch)
    first = np.arange(len(blocks)) * stretch
    picked = np.sort(np.concatenate([first + blocks.argmin(axis=1), first + blocks.argmax(axis=1)]))
    picked = np.unique(np.concatenate([picked, [len(time) - 1]]))
    return time[picked], signal[picked]


def _lines(axes: Any, time: np.ndarray, signals: np.ndarray, labels: Sequence[str], **style: Any) -> None:
    for i, label in enumerate(labels):
        axes.plot(*_thin(time, signals[:, i]), color=COLOURS[i % len(COLOURS)], label=label, linewidth=1.3, **style)


def _rate(axes: Any, mission: Mission, flight: Flight) -> None:
    _lines(axes, flight.time, flight["rate"], ("x", "y", "z"))
    thresholds = [m.threshold for m in mission.metrics if m.kind == "settling" and m.signal == "rate"]
    axes.set_yscale("symlog", linthresh=thresholds[0] if thresholds else 1e-3)
    for threshold in thresholds[:1]:
        axes.axhspan(-threshold, threshold, color="0.92", zorder=0)
        axes.annotate(
            f"±{threshold:g}", (0.995, threshold), xycoords=("axes fraction", "data"), ha="right", va="bottom",
            fontsize=_FONT - 2, color="0.3",
        )  # fmt: skip
    axes.set_ylabel("rate [rad/s]")
    _legend(axes, 3)


def _inside_funnel(axes: Any, flight: Flight, signal: str) -> None:
    _lines(axes, flight.time, flight[signal], ("x", "y", "z"))
    for i in range(3):
        for wall in ("funnel_lower", "funnel_upper"):
            axes.plot(*_thin(flight.time, flight[wall][:, i]), color=COLOURS[i], linestyle="--", linewidth=0.9)
    axes.plot([], [], color="0.3", linestyle="--", linewidth=0.9, label="funnel")
    # Logarithmic down to the walls' last width, so that the end of the flight can be seen too.
    narrowest = float(np.min(np.abs([flight["funnel_lower"][-1], flight["funnel_upper"][-1]])))
    threshold = 10.0 ** np.floor(np.log10(max(narrowest, 1e-12)))
    axes.set_yscale("symlog", linthresh=threshold)
    decades = np.arange(np.log10(threshold), 0.5, 2)
    axes.set_yticks([*-(10.0 ** decades[::-1]), 0.0, *10.0**decades])
    axes.minorticks_off()
    axes.set_ylabel("attitude MRP [-]" if signal == "mrp" else f"{signal} [{flight.unit(signal)}]")
    _legend(axes, 4)


def _torque(axes: Any, mission: Mission, flight: Flight) -> None:
    scale = 1e3
    limits = mission.scheme(flight.scheme).actuation.limit_above
    for i in range(3):
        commanded = _thin(flight.time, flight["limited"][:, i] * scale)
        axes.plot(*commanded, color=COLOURS[i], linewidth=0.8, alpha=0.35)
    axes.plot([], [], color="0.3", linewidth=0.8, alpha=0.5, label="commanded")
    _lines(axes, flight.time, flight["achieved"] * scale, ("x", "y", "z"))
    for sign in (-1, 1):
        axes.axhline(sign * max(limits) * scale, color="0.4", linestyle="--", linewidth=1)
    axes.plot([], [], color="0.4", linestyle="--", linewidth=1, label="limit")
    axes.set_ylabel("torque [mN m]")
    _legend(axes, 5)


def _forces(axes: Any, mission: Mission, flight: Flight) -> None:
    """Draw every actuator as a row whose brightness is its force, from its lowest to its highest bound."""
    force = flight.block("force") * 1e3
    stretch = max(1, len(force) // 700)
    whole = len(force) // stretch * stretch
    mean = force[:whole].reshape(-1, stretch, force.shape[1]).mean(axis=1)
    actuation = mission.scheme(flight.scheme).actuation
    ends = (flight.time[0], flight.time[whole - 1], 0.5, force.shape[1] + 0.5)
    image = axes.imshow(
        mean.T, aspect="auto", origin="lower", extent=ends, cmap="cividis", interpolation="nearest",
        vmin=min(actuation.lower) * 1e3, vmax=max(actuation.upper) * 1e3,
    )  # fmt: skip
    axes.grid(visible=False)
    axes.set_ylabel("force, thruster no.")
    bar = axes.figure.colorbar(image, ax=axes, pad=0.01)
    bar.ax.set_title("mN", fontsize=_FONT - 1)
    bar.ax.tick_params(labelsize=_FONT - 2)


def _save(figure: Any, target: Path) -> Path:
    write_beside(target, lambda path: figure.savefig(path))
    return target
