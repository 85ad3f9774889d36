"""The page of a tuning: gains, cost, metrics, requirements and checks before and after, and both flights."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.missions import flying
from casadi_gnc.missions.flight import Flight
from casadi_gnc.missions.mission import Mission
from casadi_gnc.reports import page
from casadi_gnc.reports.charts import Axis, Chart, Drawn, around

_LEVELS = {"ok": "good", "note": "note", "warn": "warn", "fail": "bad"}
_DRAWN = 400


def of_tuning(data: dict[str, Any], before: Mission, after: Mission, target: Path) -> Path:
    """Write the page of a tuning; return its path.

    Parameters
    ----------
    data : as `casadi_gnc.tuning.outcome.Tuned.data` tells it.
    before, after : the missions, which are flown once more to be drawn.
    """
    return page.write(target, page_of(data, before, after))


def page_of(data: dict[str, Any], before: Mission, after: Mission) -> str:
    """Return the page."""
    flights = [flying.fly(mission, data["scheme"]) for mission in (before, after)]
    context = {
        "title": before.title or before.name,
        "subtitle": f"{data['scheme']}, tuned against {data['against']} for {data['cost']}",
        "parts": [("verdict", "Verdict"), ("gains", "Gains"), ("numbers", "Before and after"), ("course", "Course"),
                  ("checks", "Checks")],
        "verdict": _verdict(data),
        "gains": [
            [one["name"], *(f"{one[key]:.6g}" for key in ("before", "after", "low", "high")), one["unit"]]
            for one in data["gains"]
        ],
        "numbers": _numbers(data),
        "told": "The worst is that of all cases that the tuning flew.",
        "charts": [one.svg() for one in (_course(data), *_signals(data, flights))],
        "checks": _checks(data),
    }  # fmt: skip
    return page.render("tuning.html.j2", context)


def _verdict(data: dict[str, Any]) -> dict[str, Any]:
    better = data["cost_after"] < data["cost_before"]
    sentences = [
        f"The cost went from {data['cost_before']:.4g} to {data['cost_after']:.4g} in {data['flights']} flights."
        if better
        else f"No better gains were found; the cost stays {data['cost_before']:.4g}.",
        "No check fails or warns that did not before.",
    ]
    if data["worse"]:
        sentences.append(f"Moved the wrong way: {', '.join(data['worse'])}.")
    if data["disagreement"] is not None:
        sentences.append(f"Flown again from the file, the cost differs by a share of {data['disagreement']:.1g}.")
    level = "warn" if data["worse"] or not better else "good"
    return {"gravity": level, "word": "Better" if better else "As before", "sentences": sentences}


def _numbers(data: dict[str, Any]) -> list[list[Any]]:
    def row(one: dict[str, Any], told: Any = "") -> list[Any]:
        values = (one[key] for key in ("before", "after", "worst_before", "worst_after"))
        return [one["name"], *("never" if v is None else f"{v:.4g}" for v in values), one["unit"], told]

    rows = [row(one, "cost") for one in data["terms"]] + [row(one) for one in data["metrics"]]
    for one in data["requirements"]:
        wrong = one["name"] in data["worse"]
        rows.append(row(one, {"level": "warn", "text": "the wrong way"} if wrong else "robustness"))
    return rows


def _course(data: dict[str, Any]) -> Chart:
    costs = np.array([np.nan if value is None else value for value, _ in data["course"]], dtype=float)
    at = np.arange(len(costs), dtype=float)
    drawn = [Drawn("line", at, costs, "c0"), Drawn("dots", at, costs, "c0", "after each iteration")]
    grown = np.array([how == "a worse case" for _, how in data["course"]])
    if grown.any():
        drawn.append(Drawn("cross", at[grown], costs[grown], "bad", "a worse case came in"))
    return Chart("Cost", Axis("iteration", 0.0, max(1.0, at[-1])), Axis("cost [-]", *around(costs, [0.0])), drawn)


def _signals(data: dict[str, Any], flights: list[Flight]) -> list[Chart]:
    """Return a chart of the norm of each signal of the cost, before and after."""
    names = [name for name in flights[0].layout.names if any(f"({name}" in one["name"] for one in data["terms"])]
    charts = []
    for name in names:
        drawn = []
        for flight, colour, label in zip(flights, ("quiet", "c0"), ("before", "after"), strict=True):
            some = slice(None, None, max(1, len(flight.time) // _DRAWN))
            drawn.append(
                Drawn("line", flight.time[some], np.linalg.norm(flight.block(name)[some], axis=1), colour, label)
            )
        unit = flights[0].unit(name) or "-"
        ends = (
            Axis("time [s]", 0.0, float(flights[0].time[-1])),
            Axis(f"{name} [{unit}]", *around(*[d.y for d in drawn])),
        )
        charts.append(Chart(f"Norm of {name}", *ends, drawn))
    return charts


def _checks(data: dict[str, Any]) -> list[list[Any]]:
    before, after = data["checks_before"], data["checks_after"]
    names = [name for name in {**before, **after} if {before.get(name), after.get(name)} != {"ok"}]
    return [
        [name, *({"level": _LEVELS[v], "text": v} if (v := side.get(name)) else "" for side in (before, after))]
        for name in names
    ]
