"""What a reader of a flight must know of its mission beside the record, as plain data: `mission.json` of a folder.

A page that is made later, or by another version, needs neither the problem file nor the user's own code.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.panel import Panel
from casadi_gnc.missions.recording import funnel_signals
from casadi_gnc.missions.scheme import Scheme
from casadi_gnc.reports.told import (
    Level,
    ShownMetric,
    ShownMission,
    ShownPanel,
    ShownRequirement,
    ShownScene,
    ShownScheme,
)
from casadi_gnc.system.files import write_beside

FILE = "mission.json"


def described(mission: Mission, schemes: Sequence[str]) -> ShownMission:
    """Return titles, timing, requirements, and of each scheme its panels with limits, and what is seen in space."""
    timing = mission.timing
    return ShownMission(
        mission=mission.name,
        title=mission.title,
        source=mission.source,
        problem_sha256=mission.digest,
        craft=type(mission.craft).__name__,
        mode=timing.mode,
        sample_period_s=timing.sample_period,
        duration_s=timing.duration,
        samples=timing.samples,
        requirements=[
            ShownRequirement(id=one.id, text=one.text, asked=one.asked, evidence=one.metric or one.formula)
            for one in mission.requirements
        ],
        metrics=[
            ShownMetric(name=one.name, kind=one.kind, signal=one.signal, threshold=one.threshold, unit=one.unit)
            for one in mission.metrics
        ],
        schemes={name: _scheme(mission, mission.scheme(name)) for name in schemes},
    )


def _scheme(mission: Mission, scheme: Scheme) -> ShownScheme:
    shown = [_panel(mission, scheme, panel) for panel in mission.craft.panels(mission)]
    for funnel in mission.funnels:
        *_, use = funnel_signals(mission, funnel).names
        label = f"share of the funnel of {funnel.signal.replace('_', ' ')} used"
        shown.append(ShownPanel(signal=use, label=label, levels=[Level(value=1.0, label="wall")]))
    for one in scheme.actuation.allocator.report.signals:
        shown.append(ShownPanel(signal=one.name, label=one.name.replace("_", " "), log=one.name == "duality_gap"))
    return ShownScheme(
        title=scheme.title or scheme.name,
        law=type(scheme.law).__name__,
        allocator=type(scheme.actuation.allocator).__name__,
        feedback=scheme.feedback,
        panels=shown,
        scene=ShownScene.model_validate(_finite(asdict(mission.craft.scene(mission)))),
    )


def _panel(mission: Mission, scheme: Scheme, panel: Panel) -> ShownPanel:
    """Return a panel with what stands beside its signal; levels are in the signal's own unit."""
    own: dict[str, Any] = {"kind": panel.kind, "signal": panel.signal, "label": panel.label, "unit": panel.unit}
    own |= {"scale": panel.scale, "log": panel.logarithmic}
    actuation = scheme.actuation
    if panel.level is not None:
        own["levels"] = [Level(value=panel.level, label=panel.level_label)]
    if panel.kind == "tracked":
        own |= _tracked(mission, panel.signal)
    elif panel.kind == "effort":
        place, rows = actuation.effort.names.index(panel.signal), actuation.effort.place(panel.signal)
        own["commanded"], own["signal"] = (actuation.named(stage).names[place] for stage in ("limited", "achieved"))
        own["levels"] = _levels([min(actuation.limit_below[rows]), max(actuation.limit_above[rows])], "limit")
    elif panel.kind == "actuators":
        rows = mission.truth.inputs.place(panel.signal)
        ends = [min(actuation.lower[rows]), max(actuation.upper[rows])]
        own["levels"] = _levels(ends, "bound")
        own["bounds"] = tuple(ends) if np.isfinite(ends).all() else None
    return ShownPanel(**own)


def _tracked(mission: Mission, signal: str) -> dict[str, Any]:
    """Return the funnel of a signal, and the threshold below which it counts as settled."""
    told: dict[str, Any] = {}
    funnel = next((one for one in mission.funnels if one.signal == signal), None)
    if funnel is not None:
        told["walls"] = funnel_signals(mission, funnel).names[:2]
    settles = (one for one in mission.metrics if one.kind in ("settling", "reaching") and one.signal == signal)
    first = next(settles, None)
    if first is not None:
        told |= {"finest": first.threshold, "levels": _levels([-first.threshold, first.threshold], "settled below")}
    return told


def _levels(values: Sequence[float], label: str) -> list[Level]:
    return [Level(value=value, label=label) for value in values if math.isfinite(value)]


def _finite(value: Any) -> Any:
    """Return plain data, None for numbers that JSON lacks."""
    if isinstance(value, dict):
        return {key: _finite(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def save(folder: Path, mission: Mission, schemes: Sequence[str]) -> Path:
    """Write what a page needs beside the records as `mission.json`; return its path."""
    text = described(mission, schemes).model_dump_json(indent=1) + "\n"
    target = folder / FILE
    write_beside(target, lambda path: path.write_text(text, encoding="utf-8"))
    return target
