"""The plots of a page: which samples of which signals, on which axes, with what beside them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from casadi_gnc.reports.packed import Packed
from casadi_gnc.reports.records import Record
from casadi_gnc.reports.thinning import kept
from casadi_gnc.reports.told import ShownPanel

#: Bytes of all plots of a page, before they are compressed.
ROOM = 900_000
#: Elements of a signal beyond which it is drawn as a map.
FEW = 6
#: Stretches of a record of which no extreme is lost: at most, and at least.
_FINEST, _COARSEST = 2048, 32
#: Smallest magnitude on a logarithmic axis.
_LEAST = 1e-30


def panels_of(record: Record, panels: Sequence[ShownPanel]) -> tuple[list[ShownPanel], list[str]]:
    """Return the panels that a record can fill, those of its other signals after them, and the names that it lacks."""
    lost = [one.signal for one in panels if one.signal not in record.signals]
    good = []
    for one in panels:
        if one.signal in lost:
            continue
        gone = [name for name in (*(one.walls or ()), one.commanded) if name and name not in record.signals]
        lost += gone
        good.append(one.model_copy(update={"walls": None, "commanded": None}) if gone else one)
    shown = {name for one in good for name in (one.signal, one.commanded, *(one.walls or ()))}
    rest = [name for name in record.signals if name not in shown and name not in ("time", "status")]
    return good + [ShownPanel(signal=name, label=name.replace("_", " ")) for name in rest], lost


def labels(count: int) -> list[str]:
    """Return the names of a signal's elements: none for a scalar, axes for three, else numbers."""
    return [""] if count == 1 else ["x", "y", "z"] if count == 3 else [str(i) for i in range(1, count + 1)]


def stretches(wanted: Sequence[tuple[Record, ShownPanel]], room: float = ROOM) -> int:
    """Return into how many stretches records are cut: as many as let all plots fit into so many bytes."""
    columns = [np.column_stack([each for *_, each in columns_of(record, panel)]) for record, panel in wanted]
    cuts = _FINEST
    while cuts > _COARSEST:
        size = sum(4 * len(kept(one, cuts // _share(one.shape[1]))) * (one.shape[1] + 1) for one in columns)
        if size <= room:
            break
        cuts //= 2
    return cuts


def _share(columns: int) -> int:
    """Return by how much a plot of many columns is cut into fewer stretches: each column adds points for all others."""
    return 1 if columns <= 2 * FEW else 4


def columns_of(record: Record, panel: ShownPanel) -> list[tuple[str, str, np.ndarray]]:
    """Return the lines of a panel: a label, a style, values (K,) in the panel's unit."""
    block = record.signals[panel.signal]
    found = [(label, "line", block[:, i]) for i, label in enumerate(labels(block.shape[1]))]
    if panel.commanded:
        asked = record.signals[panel.commanded]
        found += [(f"{label} commanded".strip(), "thin", asked[:, i]) for i, label in enumerate(labels(asked.shape[1]))]
    for name, side in zip(panel.walls or (), ("lower", "upper"), strict=False):
        wall = record.signals[name]
        found += [(f"{label} {side} wall".strip(), "wall", wall[:, i]) for i, label in enumerate(labels(wall.shape[1]))]
    with np.errstate(over="ignore", invalid="ignore"):
        scaled = [(label, style, values * panel.scale) for label, style, values in found]
        return [(a, b, _positive(values)) for a, b, values in scaled] if panel.log else scaled


def _positive(values: np.ndarray) -> np.ndarray:
    """Return magnitudes for a logarithmic axis; zero is drawn where the smallest other one is."""
    sizes = np.abs(values)
    known = sizes[np.isfinite(sizes) & (sizes > _LEAST)]
    return np.maximum(sizes, known.min() if len(known) else _LEAST)


def plot(record: Record, panel: ShownPanel, number: int, cuts: int, packed: Packed) -> dict[str, Any]:
    """Return one plot as the page's scripts take it; its columns go to `packed`.

    Parameters
    ----------
    cuts : stretches into which the record is cut; see `casadi_gnc.reports.thinning.kept`.
    """
    lines = columns_of(record, panel)
    values = np.column_stack([each for *_, each in lines])
    chosen = kept(values, cuts // _share(len(lines)))
    unit = panel.unit or record.units.get(panel.signal, "")
    many = record.signals[panel.signal].shape[1] > FEW
    elements = record.signals[panel.signal].shape[1]
    return {
        "id": f"plot-{number}",
        "kind": "map" if many else "lines",
        "actuators": panel.kind == "actuators",
        "effort": panel.kind == "effort",
        "label": panel.label,
        "unit": unit if unit not in ("", "-") else "",
        "axis": _axis(panel, record, values),
        "rows": len(chosen),
        "of": len(values),
        "x": packed.add(record.time[chosen]),
        "series": [
            {"label": label, "style": style, "colour": i % elements % FEW, "a": packed.add(values[chosen, i])}
            for i, (label, style, _) in enumerate(lines)
        ],
        "levels": [{"value": one.value * panel.scale, "label": one.label} for one in panel.levels],
        "bounds": None if panel.bounds is None else [end * panel.scale for end in panel.bounds],
    }


def _axis(panel: ShownPanel, record: Record, values: np.ndarray) -> dict[str, Any]:
    """Return how a plot's ordinate runs: linear, logarithmic, or logarithmic on both sides of a stretch about zero."""
    if panel.log:
        return {"kind": "log"}
    finest = None if panel.kind != "tracked" else panel.finest
    if panel.walls is not None:
        # Logarithmic down to the walls' last width, so that the end of the flight can be seen too.
        ends = np.abs([record.signals[name][-1] for name in panel.walls]) * panel.scale
        narrowest = float(ends[np.isfinite(ends)].min(initial=1.0))
        finest = 10.0 ** math.floor(math.log10(max(narrowest, _LEAST)))
    elif panel.kind == "tracked" and finest is None:
        sizes = np.abs(values[np.isfinite(values)])
        finest = 1e-3 * float(sizes.max(initial=0.0)) or None
    return {"kind": "asinh", "finest": finest} if finest else {"kind": "linear"}
