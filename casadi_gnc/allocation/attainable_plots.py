"""Pictures of the attainable sets: slices through the origin along the coordinate planes.

Every outline is exact: the half-spaces of the faces, cut by the plane, clip a square one by one.
"""

from __future__ import annotations

from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.allocation.attainable_sets import AttainableSet, SetKind, attainable_sets, half_widths
from casadi_gnc.allocation.problem import AllocationProblem
from casadi_gnc.errors import AllocationError
from casadi_gnc.system.pictures import COLOURS, FONT, SMALL, check_ending, plain, save, sheet

#: Colour, width of the line (the outer sets are drawn wider and first, so that coinciding edges show all), strength of
#: the filling, name.
_STYLES = {
    SetKind.NOMINAL: (COLOURS[5], 5.0, 0.14, "nominal geometry"),
    SetKind.EACH_VERTEX: (COLOURS[0], 2.6, 0.0, "each vertex, own forces"),
    SetKind.COMMON_FORCES: (COLOURS[1], 1.6, 0.28, "one set of forces for all"),
}


def plot_slices(
    problem: AllocationProblem,
    target: Path,
    *,
    wanted: Any = None,
    previous: Any = None,
    axes_names: tuple[str, ...] = ("x", "y", "z"),
    scale: float = 1e3,
    unit: str = "mN m",
) -> Path:
    """Draw the coordinate slices of the three attainable sets and return the path.

    Parameters
    ----------
    problem : with two rows or more; of more than three the first three are drawn, the others at zero.
    target : picture file; its ending says the format.
    wanted : (R,) or one number, half-widths of the virtual-control box [effort], drawn dashed.
    previous : (N,), forces of the previous sample, for the sets of one sample under the rate bound.
    axes_names : of the rows drawn.
    scale, unit : what the effort is multiplied with, and what it is called then.

    Raises
    ------
    AllocationError
        For a single row, too few names, or too many faces to list.
    ProblemError
        For an ending that is no picture's.
    """
    rows = len(problem.effectiveness)
    if rows < 2:
        raise AllocationError("effectiveness has one row; a slice needs two, see the margins instead")
    if len(axes_names) < min(rows, 3):
        raise AllocationError(f"axes_names has {len(axes_names)} names, expected {min(rows, 3)}")
    box = None if wanted is None else half_widths(wanted, rows) * scale
    planes = list(combinations(range(min(rows, 3)), 2))
    sets = attainable_sets(problem, previous=previous)
    outlines = {one.kind: [outline(one, i, j) * scale for i, j in planes] for one in sets}
    figure = sheet(6.4 if len(planes) > 1 else 3.5)
    figure.get_layout_engine().set(w_pad=0.1, h_pad=0.1)
    check_ending(target)
    panels = figure.subplots(2, 2).ravel() if len(planes) > 1 else figure.subplots(1, 2)
    limit = _limit(outlines, box)
    for panel, (i, j), k in zip(panels, planes, range(len(planes)), strict=False):
        for kind, (colour, width, filling, _) in _STYLES.items():
            _draw(panel, outlines[kind][k], colour, width, filling)
        if box is not None:
            corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]]) * box[[i, j]]
            panel.plot(*corners.T, color="black", linestyle=(0, (4, 2)), linewidth=1.8, zorder=6)
        _dress(panel, axes_names[i], axes_names[j], limit, unit)
    _key(panels[-1], sets, box, scale, unit)
    return save(figure, target)


def outline(one: AttainableSet, first: int, second: int) -> np.ndarray:
    """Return the corners of the slice of a set with all other rows at zero, (M, 2), in order; (0, 2) for none.

    Parameters
    ----------
    first, second : rows of the effort that span the plane.
    """
    if one.is_empty:
        return np.zeros((0, 2))
    normals = np.vstack([part.halfspaces.normals[:, [first, second]] for part in one.parts])
    offsets = np.concatenate([part.halfspaces.offsets for part in one.parts])
    size = 2 * float(np.max([part.scale + np.abs(part.centre) for part in one.parts]))
    polygon = size * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    # Near faces first: the polygon stays small.
    for k in np.argsort(np.abs(offsets)):
        polygon = _clip(polygon, normals[k], float(offsets[k]), 1e-12 * size)
    return polygon


def _clip(polygon: np.ndarray, normal: np.ndarray, offset: float, slack: float) -> np.ndarray:
    """Return what a half-plane leaves of a convex polygon."""
    beyond = polygon @ normal - offset
    if not len(polygon) or np.all(beyond <= slack):
        return polygon
    kept = []
    for a, b, here, there in zip(polygon, np.roll(polygon, -1, 0), beyond, np.roll(beyond, -1), strict=True):
        if here <= slack:
            kept.append(a)
        if (here <= slack) != (there <= slack):
            kept.append(a + np.clip(here / (here - there), 0.0, 1.0) * (b - a))
    return np.array(kept).reshape(-1, 2)


def _limit(outlines: dict[SetKind, list[np.ndarray]], box: np.ndarray | None) -> float:
    corners = [np.abs(polygon).max(initial=0.0) for polygons in outlines.values() for polygon in polygons]
    return 1.06 * float(max(*corners, 0.0 if box is None else box[:3].max())) or 1.0


def _draw(panel: Any, polygon: np.ndarray, colour: str, width: float, filling: float) -> None:
    if len(polygon):
        closed = np.vstack([polygon, polygon[:1]])
        panel.fill(*closed.T, facecolor=colour, alpha=filling, linewidth=0)
        panel.plot(*closed.T, color=colour, linewidth=width, solid_joinstyle="round")


def _dress(panel: Any, first: str, second: str, limit: float, unit: str) -> None:
    panel.set(xlim=(-limit, limit), ylim=(-limit, limit), aspect="equal")
    plain(panel)
    panel.set_xlabel(f"{first} [{unit}]")
    panel.set_ylabel(f"{second} [{unit}]")
    panel.locator_params(nbins=5)
    panel.axhline(0, color="0.6", linewidth=0.8)
    panel.axvline(0, color="0.6", linewidth=0.8)


def _key(panel: Any, sets: tuple[AttainableSet, ...], box: np.ndarray | None, scale: float, unit: str) -> None:
    """Write the key into the empty panel, with the largest cube (or box of the wanted proportions) of every set."""
    panel.set_axis_off()
    shape = np.ones(len(sets[0].parts[0].centre)) if box is None else box / scale
    is_cube = bool(np.all(shape == shape[0]))
    for one in sets:
        colour, width, _, name = _STYLES[one.kind]
        size = one.box(shape)
        reach = (
            f"largest cube ±{size * shape[0] * scale:.3g} {unit}" if is_cube else f"box {100 * size:.3g} % of wanted"
        )
        reach = "empty" if one.is_empty else reach if size > 0 else "no box about zero"
        panel.plot([], [], color=colour, linewidth=width, label=f"{name}\n{reach}")
    if box is not None:
        text = f"wanted ±{box[0]:.3g} {unit}" if is_cube else "wanted box"
        panel.plot([], [], color="black", linestyle=(0, (4, 2)), linewidth=1.8, label=text)
    key = panel.legend(
        loc="center", fontsize=SMALL, frameon=False, labelspacing=1.0, handlelength=1.6, title="slices through zero"
    )
    key.get_title().set_fontsize(FONT)
