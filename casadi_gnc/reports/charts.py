"""Charts that stand still, as SVG of a template: lines, dots, bars and bands on two axes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from markupsafe import Markup

from casadi_gnc.system.templates import template

#: Size of a chart and its margins, in units of its own.
_WIDTH, _HEIGHT = 560, 300
_LEFT, _RIGHT, _TOP, _BOTTOM = 66, 14, 12, 46
Kind = Literal["line", "thick", "dots", "cross", "bars", "band", "rule"]


@dataclass(frozen=True)
class Axis:
    """Say how an axis runs.

    Parameters
    ----------
    label : with its unit.
    low, high : its ends.
    logarithmic : whether it does so by decades.
    names : what stands at its marks instead of numbers, by place.
    """

    label: str
    low: float
    high: float
    logarithmic: bool = False
    names: Sequence[tuple[float, str]] = ()

    def share(self, values: Any) -> np.ndarray:
        """Return where values lie, 0 at the low end and 1 at the high one; what is beyond is at the ends."""
        ends, there = np.array([self.low, self.high], dtype=float), np.asarray(values, dtype=float)
        if self.logarithmic:
            ends, there = np.log10(ends), np.log10(np.maximum(there, 1e-300))
        return np.clip((there - ends[0]) / ((ends[1] - ends[0]) or 1.0), -0.02, 1.02)

    def marks(self) -> list[tuple[float, str]]:
        """Return places of marks and what stands there."""
        if self.names:
            return list(self.names)
        if self.logarithmic:
            first, last = math.ceil(math.log10(self.low) - 1e-9), math.floor(math.log10(self.high) + 1e-9)
            step = max(1, -(-(last - first + 1) // 7))
            return [(10.0**k, f"{10.0**k:g}") for k in range(first, last + 1, step)]
        step = _round_step((self.high - self.low) / 5)
        first = math.ceil(self.low / step - 1e-9)
        count = math.floor(self.high / step + 1e-9) - first + 1
        return [((first + k) * step, f"{(first + k) * step:.6g}") for k in range(max(0, min(count, 20)))]


@dataclass(frozen=True)
class Drawn:
    """Say what is drawn.

    Parameters
    ----------
    kind : a line, a thick one, dots, crosses, bars up from zero between edges x, a band over two x, a rule.
    x, y : (K,); of a band two values of x; of a rule one value of x or of y, the other None.
    colour : of the page: c0 to c5, ink, quiet, good, warn, bad.
    label : what the reader is told, "" for nothing.
    """

    kind: Kind
    x: Any = None
    y: Any = None
    colour: str = "c0"
    label: str = ""


@dataclass(frozen=True)
class Chart:
    """Hold a chart: a title, two axes, what is drawn."""

    title: str
    x: Axis
    y: Axis
    drawn: Sequence[Drawn] = field(default_factory=list)
    height: int = _HEIGHT

    def svg(self) -> Markup:
        """Return the chart as SVG; texts in it are texts."""
        height = self.height
        area = {"left": _LEFT, "top": _TOP, "right": _WIDTH - _RIGHT, "bottom": height - _BOTTOM}
        context = {
            "chart": self,
            "area": area,
            "width": _WIDTH,
            "height": height,
            "across": [(self._right(place), text) for place, text in self.x.marks()],
            "up": [(self._down(place), text) for place, text in self.y.marks()],
            "shapes": [self._shape(one) for one in self.drawn],
            "told": [one for one in self.drawn if one.label],
        }
        return Markup(template("chart.html.j2").render(**context))

    def _right(self, values: Any) -> Any:
        return np.round(_LEFT + self.x.share(values) * (_WIDTH - _LEFT - _RIGHT), 1)

    def _down(self, values: Any) -> Any:
        return np.round(self.height - _BOTTOM - self.y.share(values) * (self.height - _BOTTOM - _TOP), 1)

    def _shape(self, one: Drawn) -> dict[str, Any]:
        """Return a path, in the chart's own units."""
        bottom, top = self.height - _BOTTOM, _TOP
        if one.kind == "rule":
            if one.x is not None:
                path = f"M{self._right(one.x):g} {bottom}V{top}"
            else:
                path = f"M{_LEFT} {self._down(one.y):g}H{_WIDTH - _RIGHT}"
        elif one.kind == "band":
            a, b = self._right(one.x)
            path = f"M{a:g} {bottom}H{b:g}V{top}H{a:g}Z"
        else:
            x, y = np.atleast_1d(self._right(one.x)), np.atleast_1d(self._down(one.y))
            path = _bars(x, y, float(self._down(0.0))) if one.kind == "bars" else _PATHS[one.kind](x, y)
        return {"kind": one.kind, "colour": one.colour, "path": path}


def _line(x: np.ndarray, y: np.ndarray) -> str:
    parts, pen = [], False
    for a, b, there in zip(x, y, np.isfinite(x) & np.isfinite(y), strict=True):
        if there:
            parts.append(f"{'L' if pen else 'M'}{a:g} {b:g}")
        pen = bool(there)
    return "".join(parts)


def _points(x: np.ndarray, y: np.ndarray) -> list[tuple[float, float]]:
    """Return the points that are numbers; those that fall on each other are one."""
    good = np.isfinite(x) & np.isfinite(y)
    return list(dict.fromkeys(zip(x[good].tolist(), y[good].tolist(), strict=True)))


def _dots(x: np.ndarray, y: np.ndarray) -> str:
    return "".join(f"M{a:g} {b:g}h0" for a, b in _points(x, y))


def _crosses(x: np.ndarray, y: np.ndarray) -> str:
    return "".join(f"M{a - 4:g} {b - 4:g}l8 8m0 -8l-8 8" for a, b in _points(x, y))


def _bars(x: np.ndarray, y: np.ndarray, zero: float) -> str:
    """Return bars between edges: x has one more place than y."""
    return "".join(f"M{x[k]:g} {zero:g}V{y[k]:g}H{x[k + 1]:g}V{zero:g}Z" for k in range(len(y)))


_PATHS = {"line": _line, "thick": _line, "dots": _dots, "cross": _crosses}


def around(*values: Any, room: float = 0.05) -> tuple[float, float]:
    """Return ends that hold all finite values, with some room; (0, 1) where there is none."""
    found = np.concatenate([np.ravel(np.asarray(each, dtype=float)) for each in values])
    found = found[np.isfinite(found)]
    if not len(found):
        return 0.0, 1.0
    low, high = float(found.min()), float(found.max())
    wide = (high - low) or abs(high) or 1.0
    return low - room * wide, high + room * wide


def _round_step(width: float) -> float:
    """Return 1, 2 or 5 times a power of ten, near a width."""
    if not width > 0 or not math.isfinite(width):
        return 1.0
    power = 10.0 ** math.floor(math.log10(width))
    return next(step * power for step in (1, 2, 5, 10) if step * power >= width * 0.999)
