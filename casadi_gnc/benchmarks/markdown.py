"""The report's text, in Markdown."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from casadi_gnc.benchmarks.results import Results
from casadi_gnc.benchmarks.running import APPENDIX, left_out
from casadi_gnc.benchmarks.statistics import Ratio
from casadi_gnc.benchmarks.summary import Overview, alike, groups, lost
from casadi_gnc.system.text import markdown

CLOCKS = {"wall": "times by the wall clock", "cpu": "processor times, in which waiting counts nothing"}
#: What each column of the tables is, for the report.
MEANINGS = {
    "success": "samples whose residuals, computed by us, are below the accuracy in every pass, within the time limit",
    "correct": "answers of which the contestant's own claim agrees with our verdict",
    "load": "set-up in a new process: importing, compiling",
    "set-up": "the least of the set-ups in a process that is warm",
    "first": "first solve after the set-up in a new process; median over families",
    "cold": "solve by a runner freshly set up; median over samples",
    "warm": "solves one after another; median, 95 %, 99 % and largest over samples",
    "solver": "the part of warm that the contestant reports itself; median, with what is around it beside",
    "mean": "shifted geometric mean of warm, failures at the time limit: what the ranking goes by",
}


def as_markdown(found: Overview, pictures: list[Path]) -> str:
    """Return the report's text."""
    results = found.results
    header = results.header
    parts = [f"# {markdown(header['title'])}", _conditions(header), *_warnings(results)]
    for group, order in found.orders.items():
        if not order:
            parts += [f"## {group}", "No contestant has been measured on every family of this set yet."]
            continue
        names = groups(results)[group]
        parts += [
            f"## {group}",
            "\n".join(f"* `{name}`: {markdown(header['families'][name]['title'])}" for name in names),
        ]
        parts += [ranking_table(order, found.whole(group)), *_others(header, order), _differences(order)]
        if header["contest"] == "flight":
            parts.append(_rates(found.whole(group)))
        parts += [f"![{group}]({path.name})" for path in pictures if path.stem == group]
        parts.append(_by_family(found, group))
    appendix = results.folder / APPENDIX
    if appendix.is_file():
        parts.append(appendix.read_text(encoding="utf-8").rstrip())
    parts += ["## What the columns mean", "\n".join(f"* **{name}**: {text}." for name, text in MEANINGS.items())]
    residuals = header["residuals"]
    parts.append(f"Residuals: the first is the {residuals[0]}; the second the {residuals[1]}. The largest are shown.")
    if header.get("missed"):
        parts.append(f"Missed: {header['missed']}.")
    parts += ["## Known limitations", "\n".join(f"* {text}" for text in [*header["limitations"], *_common(header)])]
    failures = lost(list(results.cells.values()))
    if failures:
        parts += [
            "## Solves without an answer",
            "\n".join(f"* {count} times {markdown(why)}" for why, count in failures.items()),
        ]
    if header["absent"]:
        parts += ["## Not installed", "\n".join(f"* {text}" for text in header["absent"])]
    return "\n\n".join(parts) + "\n"


def _conditions(header: dict[str, Any]) -> str:
    machine, settings = header["machine"], header["settings"]
    load = "not known" if machine["load"] is None else ", ".join(f"{value:g}" for value in machine["load"])
    versions = {f"{name} {number}" for some in header["versions"].values() for name, number in some.items()}
    lines = [
        f"casadi-gnc {header['casadi_gnc']}; {', '.join(sorted(versions))}; Python {machine['python']}",
        f"{machine['processor']}, {machine['cores']} cores, governor {machine['governor']}; {machine['system']}; "
        f"compiler {machine['compiler']}",
        f"load at the start (1, 5, 15 min) {load}; {machine['date']}",
        f"accuracy {settings['accuracy']}; {settings['passes']} passes warm, {settings['cold_passes']} cold; "
        f"{CLOCKS[settings['clock']]}; "
        f"time limit {settings['time_limit']:g} s a solve, {settings['run_limit']:g} s a run; "
        f"shift {1e6 * settings['shift']:g} us; order drawn with seed {settings['seed']}",
    ]
    return "\n".join(f"* {line}" for line in lines)


def _warnings(results: Results) -> list[str]:
    told = []
    missing = left_out(results)
    if missing:
        told.append(
            f"**Not complete**: {missing} first passes were not measured, because of the run's limit or because it was "
            "ended; run again with the same --out to go on."
        )
    for number, what in results.corrupt:
        told.append(f"**Line {number} of the results {what}**; it was left out.")
    return told


def _common(header: dict[str, Any]) -> list[str]:
    share = header["settings"]["share"]
    clock = "Reading the processor's clock takes up to a microsecond, which is in every time."
    return [
        *([clock] if header["settings"]["clock"] == "cpu" else []),
        "A sample's time is the least of its passes: jitter of the system is left out on purpose, and the largest time "
        "is the solver's worst sample, not the worst that may happen.",
        f"A contestant that has spent {share:g} s in a family is given no further pass there: fewer passes, for long "
        "solves only.",
    ]


def ranking_table(order: list[tuple[str, Ratio | None]], rows: dict[str, dict[str, Any]]) -> str:
    """Return a set's table in Markdown, fast ones first."""
    heads = (
        "",
        "success",
        "correct",
        "set-up",
        "first",
        "cold",
        "warm",
        "95 %",
        "99 %",
        "max",
        "solver + wrapper",
        "mean",
    )
    is_missed = any(row.get("missed") is not None for row in rows.values())
    heads = (*heads, "residuals", *(["missed"] if is_missed else []))
    lines = ["Times in microseconds.\n", _line([*heads]), _line(["---"] + ["---:"] * (len(heads) - 1))]
    for who, _ in order:
        row = rows[who]
        own = "not reported"
        if row["solver_us"] is not None:
            own = f"{shown(row['solver_us'])} + {shown(row['wrapper_us'])}"
        times = [shown(row[f"{name}_us"]) for name in ("setup", "first", "cold", "warm", "p95", "p99", "max")]
        residuals = f"{row['violation']:.0e}, {row['gap']:.0e}"
        cells = [
            f"`{who}`",
            percent(row["success"]),
            percent(row["correct"]),
            *times,
            own,
            shown(row["mean_us"]),
            residuals,
            *([missed(row)] if is_missed else []),
        ]
        lines.append(_line(cells))
    return "\n".join(lines)


def missed(row: dict[str, Any]) -> str:
    """Return the median and the largest of what was missed; a dash where nothing is known."""
    return "-" if row.get("missed") is None else f"{row['missed']:.0e}, {row['missed_max']:.0e}"


def _others(header: dict[str, Any], order: list[tuple[str, Ratio | None]]) -> list[str]:
    """Return a paragraph on those of a set that minimise something else."""
    told = header.get("objectives", {})
    lines = [f"* `{who}`: {markdown(told[who])}." for who, _ in order if who in told]
    return ["\n".join(["**These minimise another objective**, and are judged by ours:", "", *lines])] if lines else []


def _rates(rows: dict[str, dict[str, Any]]) -> str:
    return "Steps per second: " + "; ".join(f"`{who}` {steps_per_second(row):.3g}" for who, row in rows.items()) + "."


def steps_per_second(row: dict[str, Any]) -> float:
    """Return how many samples a second are flown, from the time of one [us]."""
    return 1e6 / row["warm_us"]


def _line(cells: list[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def _differences(order: list[tuple[str, Ratio | None]]) -> str:
    same = alike(order)
    if same:
        told = "; ".join(", ".join(f"`{who}`" for who in group) for group in same)
        first = f"**These do not differ** by more than 20 % beyond doubt, each from its neighbour: {told}."
    elif len(order) == 1:
        first = "There is nothing to compare it with."
    else:
        first = "All differ from their neighbours by more than 20 %."
    ratios = [
        f"`{who}` takes {ratio.value:.3g} times the time of `{order[place][0]}` (95 % of resampled runs: "
        f"{ratio.low:.3g} to {ratio.high:.3g})"
        for place, (who, ratio) in enumerate(order[1:])
        if ratio is not None
    ]
    return "\n".join([first, "", *(f"* {text}" for text in ratios)])


def _by_family(overview: Overview, group: str) -> str:
    names, order = groups(overview.results)[group], [who for who, _ in overview.orders[group]]
    found = {(row["contestant"], row["family"]): row for row in overview.rows if row["group"] == group}
    lines = ["Median of warm solves [us], and successes where not all:\n"]
    lines += [_line(["", *names]), _line(["---"] + ["---:"] * len(names))]
    for who in [*order, *(who for who in overview.results.contestants if who not in order)]:
        cells = []
        for name in names:
            row = found.get((who, name))
            if row is None:
                cells.append("")
            else:
                cells.append(shown(row["warm_us"]) + ("" if row["success"] == 1 else f" ({percent(row['success'])})"))
        if any(cells):
            lines.append(_line([f"`{who}`", *cells]))
    return "\n".join(lines)


def shown(value: float | None) -> str:
    """Return a time to three digits; a dash where there is none."""
    return "-" if value is None or math.isnan(value) else f"{value:.3g}" if value < 1000 else f"{value:.0f}"


def percent(share: float) -> str:
    """Return a share in percent that says 100 only where all is meant."""
    return f"{100 * share:.0f} %" if share in (0.0, 1.0) else f"{min(max(100 * share, 0.1), 99.9):.1f} %"
