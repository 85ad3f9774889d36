"""The craft at the start of a flight as a drawing: for browsers without WebGL, and for paper."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
from markupsafe import Markup

from casadi_gnc.reports.records import Record
from casadi_gnc.reports.told import ShownScene, ShownScheme
from casadi_gnc.system.templates import template

#: From where it is seen, and the half width of the drawing.
_AROUND, _ABOVE, _HALF = 0.7, 0.45, 2.6


def still(record: Record, scheme: ShownScheme | None) -> Markup:
    """Return the drawing as SVG; an empty one where the scene is not known."""
    lines: list[dict[str, Any]] = []
    names: list[dict[str, Any]] = []
    if scheme is not None:
        _draw(scheme.scene, record, lines, names)
    return Markup(template("still.html.j2").render(lines=lines, names=names, half=_HALF))


def _draw(scene: ShownScene, record: Record, lines: list[dict[str, Any]], names: list[dict[str, Any]]) -> None:
    body = np.eye(3)
    if scene.attitude in record.signals:
        body = _body_axes(record.signals[scene.attitude][0])
    for i, axis in enumerate(np.eye(3)):
        _add(lines, names, "quiet", (0 * axis, 2.0 * axis), f"{'xyz'[i]} ref")
        _add(lines, names, f"c{i}", (0 * axis, 1.5 * body @ axis), "xyz"[i])
    scale = 1.5 / max(scene.size)
    turned = np.array(scene.turned)
    corners = {
        signs: body @ turned @ (scale * (np.array(scene.centre) + 0.5 * np.array(signs) * scene.size))
        for signs in product((-1.0, 1.0), repeat=3)
    }
    for a, b in product(corners, repeat=2):
        if a < b and sum(x != y for x, y in zip(a, b, strict=True)) == 1:
            _add(lines, names, "ink", (corners[a], corners[b]))
    if scene.jets is not None:
        forces = record.signals.get(scene.jets.signal)
        for i, (place, way) in enumerate(zip(scene.jets.positions, scene.jets.directions, strict=True)):
            most = scene.jets.most[i] or 1.0
            share = 0.0 if forces is None or not np.isfinite(forces[0, i]) else float(abs(forces[0, i])) / most
            start = body @ (scale * np.array(place))
            _add(lines, names, "c1", (start, start - (0.04 + 0.75 * share) * body @ np.array(way)))
    if scene.spinners is not None:
        for axis in scene.spinners.axes:
            _add(lines, names, "quiet", (0.6 * body @ np.array(axis), 1.1 * body @ np.array(axis)))


def _body_axes(s: np.ndarray) -> np.ndarray:
    """Return the matrix body -> reference of MRPs, the transpose of C(s)."""
    n = float(s @ s)
    x, y, z = s
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + (8 * cross @ cross + 4 * (1 - n) * cross) / (1 + n) ** 2


def _add(
    lines: list[dict[str, Any]],
    names: list[dict[str, Any]],
    colour: str,
    ends: tuple[np.ndarray, np.ndarray],
    name: str = "",
) -> None:
    seen = [_seen(end) for end in ends]
    lines.append({"colour": colour, "points": [f"{value:.3f}" for point in seen for value in point]})
    if name:
        x, y = (1.08 * value for value in seen[1])
        names.append({"colour": colour, "x": f"{x:.3f}", "y": f"{y:.3f}", "text": name})


def _seen(place: np.ndarray) -> tuple[float, float]:
    """Return where a place is seen, right and down, without perspective."""
    right = np.array([-np.sin(_AROUND), np.cos(_AROUND), 0.0])
    back = np.array([np.cos(_ABOVE) * np.cos(_AROUND), np.cos(_ABOVE) * np.sin(_AROUND), np.sin(_ABOVE)])
    return float(place @ right), -float(place @ np.cross(back, right))
