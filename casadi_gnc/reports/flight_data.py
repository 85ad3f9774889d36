"""What the scripts of a flight's page draw: plots, statuses on a time line, and the craft in space."""

from __future__ import annotations

from typing import Any

import numpy as np

from casadi_gnc.reports.packed import Packed
from casadi_gnc.reports.plots import labels, panels_of, plot, stretches
from casadi_gnc.reports.records import Flown, Record
from casadi_gnc.reports.thinning import runs
from casadi_gnc.reports.told import ShownPanel, ShownScene, ShownScheme, ShownTrack
from casadi_gnc.reports.verdicts import gravity
from casadi_gnc.status import StepStatus

#: Bytes of all moments that the slider goes through, before they are compressed.
_MOMENTS = 420_000
#: Moments of a flight: at most.
_MOST = 900
#: Stretches of one status on the time line, at most.
_RUNS = 400


def data_of(flown: Flown, packed: Packed) -> dict[str, Any]:
    """Return what the scripts draw, and note in `flown.lacking` what a picture wanted and did not find."""
    drawn = [one for one in flown.records if one.signals]
    chosen = []
    for record in drawn:
        scheme = flown.scheme(record.scheme)
        panels, lost = panels_of(record, scheme.panels if scheme else [])
        lost += ["status"] if "status" not in record.signals else []
        if lost:
            flown.lacking.append(f"{record.scheme}.npz has no {', '.join(lost)}, which its pictures want")
        chosen.append((record, scheme, panels))
    cuts = stretches([(record, one) for record, _, panels in chosen for one in panels])
    numbers = sum(record.signals[one.signal].shape[1] for record, _, panels in chosen for one in panels) + 1
    moments = int(min(_MOST, max(50, _MOMENTS / (4 * numbers))))
    return {
        "schemes": [
            _scheme(record, scheme, panels, cuts, moments, packed, flown.lacking) for record, scheme, panels in chosen
        ]
    }


def _scheme(
    record: Record,
    scheme: ShownScheme | None,
    panels: list[ShownPanel],
    cuts: int,
    moments: int,
    packed: Packed,
    lacking: list[str],
) -> dict[str, Any]:
    own = len(scheme.panels) if scheme else 0
    count = len(record.time)
    chosen = np.unique(np.round(np.linspace(0, count - 1, min(count, moments))).astype(int))
    columns: dict[str, list[int]] = {}

    def kept(name: str) -> list[int] | None:
        """Return the columns of a signal at the moments."""
        if name not in record.signals:
            return None
        if name not in columns:
            columns[name] = [packed.add(column) for column in record.signals[name][chosen].T]
        return columns[name]

    plots = [
        {**plot(record, one, number, cuts, packed), "group": "main" if number < own else "other"}
        for number, one in enumerate(panels)
    ]
    return {
        "name": record.scheme,
        "title": record.title,
        "start": float(record.time[0]),
        "end": float(record.time[-1]),
        "plots": plots,
        "statuses": _statuses(record),
        "moments": kept("time"),
        "bits": kept("status"),
        "numbers": [
            {
                "label": one.label,
                "signal": one.signal,
                "unit": p["unit"],
                "scale": one.scale,
                "elements": labels(record.signals[one.signal].shape[1]),
                "a": kept(one.signal),
            }
            for one, p in zip(panels, plots, strict=True)
        ],
        "scene": None if scheme is None else _scene(record, scheme, kept, lacking, record.time[chosen], packed),
    }


def _statuses(record: Record) -> list[dict[str, Any]]:
    """Return for each status that was raised when it was, as far as samples were kept."""
    if "status" not in record.signals:
        return []
    time, column = record.time, record.signals["status"][:, 0]
    words = np.where(np.isfinite(column), column, 0.0).astype(np.int64)
    told = {one.status: one for one in record.summary.statuses} if record.summary else {}
    found = []
    for bit in StepStatus:
        flags = (words & bit.value) != 0
        if flags.any():
            name = str(bit.name)
            spans = [[float(time[a]), float(time[min(b + 1, len(time) - 1)])] for a, b in runs(flags, _RUNS)]
            share = float(flags.mean())
            first = told[name].first_s if name in told else float(time[flags.argmax()])
            found.append(
                {"name": name, "bit": bit.value, "meaning": bit.sentences[0], "gravity": gravity(name),
                 "share": share, "first": first, "runs": spans}
            )  # fmt: skip
    return found


def _scene(
    record: Record, scheme: ShownScheme, kept: Any, lacking: list[str], moments: np.ndarray, packed: Packed
) -> dict[str, Any] | None:
    """Return what is seen in space; what the record lacks is left out, and said."""
    scene: ShownScene = scheme.scene
    wanted = [scene.attitude, scene.position, *(one.signal for one in scene.arrows)]
    wanted += [one.signal for one in (scene.jets, scene.spinners) if one is not None]
    lost = [name for name in wanted if name and name not in record.signals]
    if lost:
        lacking.append(f"{record.scheme}.npz has no {', '.join(dict.fromkeys(lost))}, which the view in space wants")
    told = scene.model_dump(mode="json")
    told["attitude"] = kept(scene.attitude) if scene.attitude else None
    told["position"] = kept(scene.position) if scene.position else None
    for part in ("jets", "spinners"):
        if told[part] is not None:
            told[part]["a"] = kept(told[part]["signal"])
            if told[part]["a"] is None:
                told[part] = None
    told["arrows"] = [one | {"a": kept(one["signal"])} for one in told["arrows"] if one["signal"] in record.signals]
    told["arrows"] += [_track(one, moments, packed) for one in scene.tracks]
    del told["tracks"]
    cone = next((one for one in scheme.panels if one.walls and one.signal == scene.attitude), None)
    walls = [] if cone is None or cone.walls is None else [kept(name) for name in cone.walls]
    told["cone"] = walls if walls and all(walls) else None
    if told["attitude"] is None and told["position"] is None:
        return None
    return told


def _track(one: ShownTrack, moments: np.ndarray, packed: Packed) -> dict[str, Any]:
    """Return a direction at the moments as an arrow of the reference frame."""
    between = np.stack([np.interp(moments, one.times, column) for column in np.array(one.vectors).T])
    size = np.linalg.norm(between, axis=0)
    columns = [packed.add(column) for column in between / np.where(size > 0, size, 1.0)]
    return {"signal": "", "label": one.label, "frame": "reference", "reversed": False, "a": columns}
