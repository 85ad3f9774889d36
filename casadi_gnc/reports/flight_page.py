"""The page of flights: verdict first, then requirements, metrics, the craft in space, plots, provenance."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from casadi_gnc.missions.flight import Flight
from casadi_gnc.missions.mission import Mission
from casadi_gnc.reports import loop_charts, page, records
from casadi_gnc.reports.describing import described
from casadi_gnc.reports.flight_data import data_of
from casadi_gnc.reports.loops import loops_of
from casadi_gnc.reports.packed import Packed
from casadi_gnc.reports.records import Flown, Record
from casadi_gnc.reports.still import still
from casadi_gnc.reports.told import Measured, ShownLoops
from casadi_gnc.reports.verdicts import judged

_SCRIPTS = (
    "vendor/uplot.min.js",
    "vendor/three.min.js",
    "scripts/record.js",
    "scripts/plots.js",
    "scripts/space.js",
    "scripts/flight.js",
)
_PROVENANCE = {
    "engine": "engine",
    "maths": "elementary functions",
    "mode": "mode",
    "feedback": "the law is told what is",
    "seed": "seed of the noise",
    "problem_sha256": "SHA-256 of the problem",
    "casadi_gnc": "casadi-gnc",
    "casadi": "CasADi",
    "compiler": "compiler",
}


def of_mission(mission: Mission, flights: Sequence[Flight], target: Path, loops: ShownLoops | None = None) -> Path:
    """Write the page of flights of a mission; return its path. Give `loops` where they are known."""
    names = [one.scheme for one in flights]
    known = loops_of(mission, names) if loops is None else loops
    return page.write(target, page_of(records.of_flights(flights, described(mission, names), known)))


def of_folder(folder: Path, target: Path) -> Path:
    """Write the page of the flights that a folder keeps, and what it lacks; return its path."""
    return page.write(target, page_of(records.of_folder(folder)))


def page_of(flown: Flown) -> str:
    """Return the page."""
    packed = Packed()
    data = data_of(flown, packed)
    mission, drawn = flown.mission, [one for one in flown.records if one.signals]
    verdict = judged(flown)
    requirements = _requirements(flown)
    parts = [("verdict", "Verdict")]
    parts += [("look", "Look")] if verdict.looks else []
    parts += [("requirements", "Requirements")] if requirements else []
    parts += [("metrics", "Metrics")]
    parts += [("space", "In space"), ("time", "Over time")] if drawn else []
    loops, slices = loop_charts.shown(flown.loops), loop_charts.slices(flown.loops.slices)
    parts += [("loops", "Loops")] if loops else []
    parts += [("attainable", "Attainable")] if slices else []
    context = {
        "title": (mission.title or mission.mission) if mission else "Flights",
        "subtitle": mission.source if mission else "",
        "parts": [*parts, ("provenance", "Provenance")],
        "verdict": verdict,
        "lacking": flown.lacking,
        "several": len(flown.records) > 1,
        "requirements": requirements,
        "metrics": _metrics(flown),
        "moving": bool(drawn),
        "drawn": [one.title for one in drawn],
        "still": still(drawn[0], flown.scheme(drawn[0].scheme)) if drawn else "",
        "space_told": _space_told(flown, drawn),
        "loops": loops,
        "slices": slices,
        "provenance": _provenance(flown),
    }
    return page.render("flight.html.j2", context, data, packed, _SCRIPTS if drawn else ())


def _requirements(flown: Flown) -> dict[str, Any] | None:
    known = [one for one in flown.records if one.summary is not None and one.summary.requirements]
    if not known:
        return None
    evidence = {one.id: one.evidence for one in flown.mission.requirements} if flown.mission else {}
    rows = []
    ids = dict.fromkeys(one.id for record in known if record.summary for one in record.summary.requirements)
    for name in ids:
        found = [_judged(record, name) for record in known]
        first = next(one for one in found if one is not None)
        told = [
            {"text": "not judged", "level": "warn"}
            if one is None
            else {
                "text": f"{one.verdict}, {_robustness(one.robustness, one.unit)}",
                "level": "good" if one.verdict == "met" else "bad",
            }
            for one in found
        ]
        rows.append([name, first.text or "", first.asked, evidence.get(name, "not kept"), *told])
    head = [("id", ""), ("requirement", "long"), ("asked", "long"), ("evidence", "long")]
    return {"columns": [*head, *((f"{one.title}: margin", "") for one in known)], "rows": rows}


def _judged(record: Record, name: str) -> Any:
    asked = record.summary.requirements if record.summary else []
    return next((one for one in asked if one.id == name), None)


def _robustness(value: float | str, unit: str) -> str:
    return f"{value:+.4g}{f' {unit}' if unit not in ('', '-') else ''}" if isinstance(value, float) else str(value)


def _metrics(flown: Flown) -> dict[str, Any] | None:
    known = [one for one in flown.records if one.summary is not None]
    names = dict.fromkeys(name for one in known if one.summary for name in one.summary.metrics)
    if not names:
        return None
    kinds = {one.name: one for one in flown.mission.metrics} if flown.mission else {}
    rows = []
    for name in names:
        values = [one.summary.metrics.get(name) for one in known if one.summary]
        unit = next((one.unit for one in values if one is not None), "")
        kind = kinds.get(name)
        what = f"{kind.kind.replace('_', ' ')} of {kind.signal}" if kind else ""
        if kind and kind.threshold:
            what += f" below {kind.threshold:g}"
        shown = f"{name.replace('_', ' ')}{f' [{unit}]' if unit not in ('', '-') else ''}"
        rows.append([shown, what, *(_value(one, kind.kind if kind else "") for one in values)])
    head = [("metric", "name"), ("what it is", "name")]
    return {"columns": [*head, *((one.title, "number") for one in known)], "rows": rows}


def _value(one: Measured | None, kind: str) -> str:
    if one is None or one.value is None:
        return "never" if kind in ("settling", "reaching") else "none"
    return f"{one.value:.5g}"


def _space_told(flown: Flown, drawn: Sequence[Record]) -> str:
    """Return how the picture in space is read."""
    scheme = flown.scheme(drawn[0].scheme) if drawn else None
    if scheme is None:
        return ""
    scene = scheme.scene
    told = [f"Grey axes: {scene.reference}; blue, orange and green: x, y and z of the craft."]
    if scene.jets is not None:
        told.append("A plume leaves a thruster against its force, as long as the force is a share of the largest.")
    if scene.spinners is not None:
        told.append("Wheels turn slower than they do, each as fast as it is a share of the fastest; orange is fast.")
    if scene.arrows:
        told.append("Arrows are as long as their vector is a share of its largest in the flight.")
    if any(one.walls and one.signal == scene.attitude for one in scheme.panels):
        told.append("The cone is the funnel: while it is kept, the craft's x axis stays inside.")
    if scene.position:
        told.append(f"The craft is drawn larger than it is; its way is to scale, seen from the {scene.other}.")
    return " ".join(told)


def _provenance(flown: Flown) -> dict[str, Any]:
    known = [one for one in flown.records if one.summary is not None]
    rows: list[list[str]] = []
    if flown.mission is not None:
        mission = flown.mission
        how = f"{mission.mode}, every {mission.sample_period_s:g} s for {mission.duration_s:g} s"
        timing = f"{how}, {mission.samples} samples"
        rows += [["mission", *[mission.mission] * len(known)], ["craft", *[mission.craft] * len(known)]]
        rows += [["timing", *[timing] * len(known)]]
        for name in ("law", "allocator"):
            told = [flown.scheme(one.scheme) for one in known]
            rows.append([name, *("" if each is None else str(getattr(each, name)) for each in told)])
    for key, label in _PROVENANCE.items():
        values = [one.summary.made.get(key) for one in known if one.summary]
        rows.append([label, *("none" if value in (None, "") else str(value) for value in values)])
    rows.append(["samples kept", *(str(len(one.time)) if one.signals else "none" for one in known)])
    seconds = [one.summary.seconds for one in known if one.summary]
    rows.append(["time to fly [s]", *("not known" if each is None else f"{each:.3g}" for each in seconds)])
    return {"columns": [("", "name"), *((one.title, "long") for one in known)], "rows": rows}
