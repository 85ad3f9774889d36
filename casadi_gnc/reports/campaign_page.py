"""The page of a campaign: verdict first, requirements, how metrics are spread, what drives them, the worst cases."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from casadi_gnc.campaigns.summary import badness
from casadi_gnc.reports import page
from casadi_gnc.reports.charts import Axis, Chart, Drawn, around
from casadi_gnc.reports.verdicts import gravity, listed
from casadi_gnc.system.text import shell

if TYPE_CHECKING:
    from casadi_gnc.campaigns.result import Campaign
    from casadi_gnc.missions.scheme import Metric

#: Points of a scatter: more are thinned, the worst never.
_POINTS = 3000
#: Inputs with a scatter of their own, drivers with a bar, worst cases that are marked.
_PANELS, _BARS, _MARKED = 2, 8, 5
_LEVELS = {"met": "good", "not met": "bad", "undecided": "warn"}
_PROVENANCE = {
    "mission": "mission",
    "scheme": "scheme",
    "mode": "mode",
    "maths": "elementary functions",
    "plan": "plan",
    "seed": "seed",
    "problem_sha256": "SHA-256 of the problem",
    "casadi_gnc": "casadi-gnc",
    "casadi": "CasADi",
}


def of_campaign(campaign: Campaign, target: Path, confidence: float = 0.9) -> Path:
    """Write the page of a campaign; return its path.

    Parameters
    ----------
    campaign : finished or not; the page says how far it is.
    target : the page.
    confidence : of the bounds.
    """
    return page.write(target, page_of(campaign, confidence))


def page_of(campaign: Campaign, confidence: float = 0.9) -> str:
    """Return the page."""
    told, mission = campaign.summary(confidence), campaign.cases.varied.nominal
    flew = campaign.flew
    metrics = [_metric(campaign, one, told["metrics"][one.name], flew) for one in campaign.metrics if flew.any()]
    context = {
        "title": f"{mission.title or mission.name}: {told['cases']} cases",
        "subtitle": mission.source,
        "parts": [
            ("verdict", "Verdict"),
            *([("requirements", "Requirements")] if told["requirements"] else []),
            ("metrics", "Metrics"),
            *([("statuses", "Statuses")] if told["statuses"] else []),
            ("worst", "Worst cases"),
            ("provenance", "Provenance"),
        ],
        "verdict": _verdict(told, confidence),
        "lacking": _lacking(told),
        "requirements": _requirements(told["requirements"]),
        "metrics": metrics,
        "statuses": _statuses(told),
        "worst": _worst(campaign, told),
        "provenance": _provenance(campaign),
    }
    return page.render("campaign.html.j2", context)


def _verdict(told: dict[str, Any], confidence: float) -> dict[str, Any]:
    verdicts = {name: one["verdict"] for name, one in told["requirements"].items()}
    flown = told["cases"] - told["refused"]
    sentences = [f"{flown} flights of {told['asked']} cases of {told['mission']}, scheme {told['scheme']}."]
    for word in ("not met", "undecided", "met"):
        names = [name for name, verdict in verdicts.items() if verdict == word]
        if names:
            sentences.append(f"{word[:1].upper()}{word[1:]}: {listed(names)}.")
    if not told["representative"]:
        sentences.append("The cases were chosen: they say what is possible, not how often.")
    elif not verdicts:
        sentences.append("The mission states no requirement: what is below is measured, not judged.")
    sentences.append(f"Bounds hold with {100 * confidence:g} % confidence.")
    if "not met" in verdicts.values():
        return {"gravity": "bad", "word": "Does not meet its requirements", "sentences": sentences}
    if "undecided" in verdicts.values():
        return {"gravity": "warn", "word": "Undecided: more flights are needed", "sentences": sentences}
    return {"gravity": "good", "word": "Meets its requirements" if verdicts else "Flown", "sentences": sentences}


def _lacking(told: dict[str, Any]) -> list[str]:
    lacking = []
    if told["cases"] < told["asked"]:
        missing = told["asked"] - told["cases"]
        lacking.append(f"{missing} of {told['asked']} cases are not flown yet; the same command goes on")
    lacking += [f"{count} cases were refused: {why}" for why, count in told["why"].items()]
    if told.get("damaged"):
        lacking.append(f"damaged files, which are left out: {', '.join(map(str, told['damaged']))}")
    return lacking


def _requirements(asked: dict[str, Any]) -> list[dict[str, Any]]:
    rows = []
    for name, one in asked.items():
        shown = one["shown"]
        low, high, share = (_share(value) for value in (shown["low"], shown["high"], one["share"]))
        more, undecided = one.get("more_if_all_pass"), one["verdict"] == "undecided"
        rows.append(
            {
                "id": name,
                "text": one["text"],
                "asked": f"{one['asked']} in {_percent(share)} of all, shown with {_percent(one['confidence'])}",
                "met": f"{one['met_by']} of {one['of']}",
                "bounds": f"{_percent(low)} to {_percent(high)}",
                "bar": [f"{100 * value:.2f}" for value in (low, high - low, share)],
                "verdict": one["verdict"] + (f"; {more} more that all pass would do" if more and undecided else ""),
                "level": _LEVELS[one["verdict"]],
                "worst": one["worst"]["case"],
            }
        )
    return rows


def _share(value: float | None) -> float:
    return 0.0 if value is None else float(value)


def _percent(value: float) -> str:
    return f"{100 * value:.5g} %"


def _metric(campaign: Campaign, metric: Metric, told: dict[str, Any], flew: np.ndarray) -> dict[str, Any]:
    """Return a metric's table of percentiles and its charts."""
    values = campaign.column(f"metric.{metric.name}")[flew]
    unit = f" [{metric.unit}]" if metric.unit not in ("", "-") else ""
    label = f"{metric.name.replace('_', ' ')}{unit}"
    marked = np.argsort(-badness(metric, values), kind="stable")[:_MARKED]
    drivers = [one for one in told.get("drivers", []) if one["rank_correlation"]["value"] is not None]
    charts = [_histogram(campaign, metric, told, values, label)] if np.isfinite(values).any() else []
    if drivers:
        charts.append(_bars(drivers))
        charts += [
            _scatter(campaign.column(one["key"])[flew], values, marked, one["key"], label) for one in drivers[:_PANELS]
        ]
    rows = [
        [f"{share} %", *(_shown(found[part]) for part in ("value", "low", "high"))]
        for share, found in told["percentiles"].items()
    ]
    if told.get("range"):
        rows.append(["all", "{:.4g} to {:.4g}".format(*told["range"]), "", ""])
    return {
        "name": label,
        "rows": rows,
        "without": told["without"],
        "charts": [one.svg() for one in charts],
        "worst": [f"case {one['case']}: {_shown(one['value'])}" for one in told["worst"]],
    }


def _shown(value: float | None) -> str:
    """Return a number; what has no value, or no bound, is beyond all numbers."""
    return "none" if value is None else f"{value:.4g}"


def _limits(campaign: Campaign, metric: Metric) -> list[float]:
    asked = [one for one in campaign.cases.varied.nominal.requirements if one.metric == metric.name]
    return [value for one in asked for value in (one.at_least, one.at_most) if value is not None]


def _histogram(campaign: Campaign, metric: Metric, told: dict[str, Any], values: np.ndarray, label: str) -> Chart:
    known, limits = values[np.isfinite(values)], _limits(campaign, metric)
    lines = [(share, one["value"]) for share, one in told["percentiles"].items() if one["value"] is not None]
    low, high = around(known, [value for _, value in lines], limits)
    edges = np.histogram_bin_edges(known, bins=60, range=(low, high)) if len(known) else np.array([low, high])
    counts = np.histogram(known, edges)[0] if len(known) else np.zeros(1)
    heights = 100.0 * counts / max(1, len(values))
    drawn = [Drawn("bars", edges, heights, "c0", f"{len(known)} flights")]
    drawn += [Drawn("rule", value, None, f"c{1 + i % 5}", f"{share} %") for i, (share, value) in enumerate(lines)]
    drawn += [Drawn("rule", value, None, "bad", f"limit {value:g}") for value in limits]
    without = len(values) - len(known)
    title = f"How it is spread{f'; {without} flights without a value' if without else ''}"
    top = max(1e-9, 1.08 * float(heights.max()))
    return Chart(title, Axis(label, low, high), Axis("flights [%]", 0.0, top), drawn)


def _bars(drivers: Sequence[dict[str, Any]]) -> Chart:
    """Return rank correlations as bars with their bounds, the strongest on top."""
    shown = list(drivers[:_BARS])[::-1]
    places = np.arange(len(shown)) + 1.0
    drawn = []
    for place, one in zip(places, shown, strict=True):
        found = one["rank_correlation"]
        drawn.append(Drawn("thick", [0.0, found["value"]], [place, place], "c0"))
        ends = [value for value in (found["low"], found["high"]) if value is not None]
        drawn.append(Drawn("line", ends, [place] * len(ends), "ink"))
    drawn.append(Drawn("rule", 0.0, None, "quiet"))
    names = [(float(place), str(number)) for place, number in zip(places, range(len(shown), 0, -1), strict=True)]
    title = "What it goes with: " + "; ".join(f"{len(shown) - i} {one['key']}" for i, one in enumerate(shown))
    axis = Axis("parameter", 0.3, len(shown) + 0.7, names=names)
    return Chart(
        title, Axis("rank correlation [-]; below each its bounds", -1.0, 1.0), axis, drawn, 110 + 24 * len(shown)
    )


def _scatter(inputs: np.ndarray, values: np.ndarray, marked: np.ndarray, key: str, label: str) -> Chart:
    """Return a metric over an input; flights without a value are crosses on the upper edge."""
    finite, some = np.isfinite(values), np.zeros(len(values), dtype=bool)
    some[:: max(1, -(-len(values) // _POINTS))] = True
    low, high = around(values)
    worst = np.zeros(len(values), dtype=bool)
    worst[marked] = True
    plain, bad, none = some & finite & ~worst, worst & finite, (some | worst) & ~finite
    drawn = [Drawn("dots", inputs[plain], values[plain], "quiet", "flights")]
    if bad.any():
        drawn.append(Drawn("dots", inputs[bad], values[bad], "bad", "the worst"))
    if none.any():
        crosses = np.flatnonzero(none)[: _POINTS // 4]
        drawn.append(Drawn("cross", inputs[crosses], np.full(len(crosses), high), "c1", "no value"))
    return Chart(f"Over {key}", Axis(key, *around(inputs, room=0.02)), Axis(label, low, high), drawn)


def _statuses(told: dict[str, Any]) -> list[list[Any]]:
    flown = max(1, told["cases"] - told["refused"])
    rows = []
    for name, one in told["statuses"].items():
        low, high = _share(one["share"]["low"]), _share(one["share"]["high"])
        level = {"bad": "bad", "warn": "warn", "note": "note"}[gravity(name)]
        what = {"text": name.replace("_", " ").lower(), "level": level}
        rows.append([what, one["sentence"], f"{one['flights']} of {flown}", f"{_percent(low)} to {_percent(high)}"])
    return rows


def _worst(campaign: Campaign, told: dict[str, Any]) -> list[list[str]]:
    """Return of each metric and requirement its worst case, and the command that flies it again."""
    folder = shell(campaign.folder)
    rows = []
    for name, one in told["metrics"].items():
        if one["worst"]:
            first = one["worst"][0]
            command = f"casadi-gnc fly {folder} --case worst:{name} --report case-{first['case']}.html"
            rows.append([name.replace("_", " "), str(first["case"]), _shown(first["value"]), command])
    for name, one in told["requirements"].items():
        if one["met_by"] < one["of"]:
            case, margin = one["worst"]["case"], one["worst"]["margin"]
            command = f"casadi-gnc fly {folder} --case failed:{name} --report case-{case}.html"
            rows.append([name, str(case), f"margin {_shown(margin)}", command])
    return rows


def _provenance(campaign: Campaign) -> list[list[str]]:
    identity = campaign.identity
    rows = [[label, str(identity[key])] for key, label in _PROVENANCE.items() if key in identity]
    varying = [each["key"] for each in identity["dispersions"] or []]
    return rows + [[f"varies: {key}", str(how)] for key, how in zip(varying, identity["distributions"], strict=False)]
