"""Charts of loops and of attainable sets: poles, Nichols, Bode, slices."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from casadi_gnc.reports.charts import Axis, Chart, Drawn, around
from casadi_gnc.reports.told import ShownLoop, ShownLoops, ShownSlice


def shown(loops: ShownLoops) -> list[dict[str, Any]]:
    """Return the loops as templates take them."""
    return [
        {"scheme": one.scheme, "told": one.told, "rows": one.margins, "charts": [each.svg() for each in charts(one)]}
        for one in loops.loops
    ]


def charts(loop: ShownLoop) -> list[Chart]:
    """Return the pole map, and where there are margins Nichols and Bode."""
    if loop.poles is None:
        return []
    return [_poles(loop, loop.poles), *([_nichols(loop), *_bode(loop)] if loop.curves else [])]


def slices(found: Sequence[ShownSlice]) -> list[dict[str, Any]]:
    """Return slices as templates take them: whose they are, and their charts."""
    whose = list(dict.fromkeys(tuple(one.schemes) for one in found))
    return [
        {"schemes": list(names), "charts": [_slice(one).svg() for one in found if tuple(one.schemes) == names]}
        for names in whose
    ]


def _poles(loop: ShownLoop, poles: Sequence[tuple[float, float]]) -> Chart:
    real, imaginary = np.array(poles, dtype=float).reshape(-1, 2).T
    crosses = Drawn("cross", real, imaginary, "c1", f"{len(poles)} poles")
    if loop.sampled:
        angle = np.linspace(0, 2 * math.pi, 181)
        reach = max(1.15, float(np.hypot(real, imaginary).max(initial=0.0)) * 1.05)
        wide = reach * _ACROSS
        circle = Drawn("line", np.cos(angle), np.sin(angle), "quiet", "unit circle: stable inside")
        ends = Axis("real part [-]", -wide, wide), Axis("imaginary part [-]", -reach, reach)
        return Chart("Poles of the closed loop, sample to sample", *ends, [circle, crosses])
    ends = Axis("real part [1/s]", *around(real, [0.0])), Axis("imaginary part [1/s]", *around(imaginary, [0.0]))
    rule = Drawn("rule", 0.0, None, "quiet", "stable left of it")
    return Chart("Poles of the closed loop", *ends, [rule, crosses])


#: A chart's width over its height: with it a circle is one.
_ACROSS = (560 - 80) / (300 - 58)


def _nichols(loop: ShownLoop) -> Chart:
    drawn = []
    for i, one in enumerate(loop.curves):
        phase, gain = np.array(one.phase), np.array(one.gain)
        seen = np.where(np.abs(phase + 180) < 190, phase, np.nan), np.where(np.abs(gain) < 42, gain, np.nan)
        drawn.append(Drawn("line", *seen, f"c{i % 6}", one.name))
    point = Drawn("cross", np.array([-180.0]), np.array([0.0]), "bad", "-1")
    return Chart("Nichols", Axis("phase [deg]", -360, 0), Axis("gain [dB]", -40, 40), [*drawn, point])


def _bode(loop: ShownLoop) -> list[Chart]:
    gains, phases = [], []
    lowest, highest = min(one.frequency[0] for one in loop.curves), max(one.frequency[-1] for one in loop.curves)
    across = Axis("frequency [rad/s]", lowest, highest, logarithmic=True)
    for i, one in enumerate(loop.curves):
        phase = np.array(one.phase)
        gains.append(Drawn("line", one.frequency, np.clip(one.gain, -100, 140), f"c{i % 6}", one.name))
        seen = np.where(np.abs(phase + 180) < 361, phase, np.nan)
        phases.append(Drawn("line", one.frequency, seen, f"c{i % 6}", one.name))
    gain = Axis("gain [dB]", *around(*[one.y for one in gains]))
    phase = Axis("phase [deg]", *around(*[one.y for one in phases], [-180.0]))
    levels = [Drawn("rule", None, level, "quiet") for level in (0.0, -180.0)]
    return [
        Chart("Bode, gain of the open loop", across, gain, [levels[0], *gains]),
        Chart("Bode, phase of the open loop", across, phase, [levels[1], *phases]),
    ]


def _slice(one: ShownSlice) -> Chart:
    drawn, colours = [], ("c5", "c0", "c1")
    for colour, (name, corners) in zip(colours, one.outlines.items(), strict=False):
        if corners:
            x, y = np.array([*corners, corners[0]]).T
            drawn.append(Drawn("thick" if colour == "c5" else "line", x, y, colour, name))
    if one.limit is not None:
        a, b = one.limit
        box = [-a, a, a, -a, -a], [-b, -b, b, b, -b]
        drawn.append(Drawn("line", box[0], box[1], "quiet", "limit of the effort"))
    across = Axis(one.across, *around(*[each.x for each in drawn]))
    up = Axis(one.up, *around(*[each.y for each in drawn]))
    return Chart("Attainable, the rest at zero", across, up, drawn)
