"""The page of checks: verdict first, every check with its margin, poles and margins of the linearised loops."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from casadi_gnc.checks import VERDICTS, Check, worst
from casadi_gnc.missions.mission import Mission
from casadi_gnc.reports import loop_charts, page
from casadi_gnc.reports.check_picture import used
from casadi_gnc.reports.loops import loops_of
from casadi_gnc.reports.told import ShownLoops
from casadi_gnc.reports.verdicts import listed

_LEVELS = {"ok": "good", "note": "note", "warn": "warn", "fail": "bad"}
_WORDS = {"ok": "Nothing found", "note": "Flies; notes below", "warn": "Look before you fly", "fail": "Fails"}


def of_checks(title: str, checks: Sequence[Check], target: Path, mission: Mission | None = None) -> Path:
    """Write the page of checks; return its path. With the mission, poles and margins are on it."""
    return page.write(target, page_of(title, checks, mission))


def page_of(title: str, checks: Sequence[Check], mission: Mission | None = None) -> str:
    """Return the page."""
    schemes = list(dict.fromkeys(one.scheme for one in checks if one.scheme))
    found = ShownLoops() if mission is None else loops_of(mission, schemes)
    loops, slices = loop_charts.shown(found), loop_charts.slices(found.slices)
    context = {
        "title": title,
        "subtitle": "" if mission is None else mission.source,
        "parts": [
            ("verdict", "Verdict"),
            *([("look", "Look")] if worst(list(checks)) != "ok" else []),
            ("checks", "Checks"),
            *([("loops", "Loops")] if loops else []),
            *([("attainable", "Attainable")] if slices else []),
        ],
        "verdict": _verdict(checks, schemes),
        "looks": _looks(checks, schemes),
        "checks": _table(checks, schemes),
        "loops": loops,
        "slices": slices,
    }
    return page.render("check.html.j2", context)


def _verdict(checks: Sequence[Check], schemes: Sequence[str]) -> dict[str, Any]:
    grave = worst(list(checks))
    counts = {word: sum(one.verdict == word for one in checks) for word in VERDICTS}
    told = ", ".join(f"{count} {word}" for word, count in counts.items())
    sentences = [f"{len(checks)} checks before any flight{_of(schemes)}: {told}."]
    failing = list(dict.fromkeys(one.scheme for one in checks if one.verdict == "fail" and one.scheme))
    if failing and len(schemes) > 1:
        good = [name for name in schemes if name not in failing]
        sentences.append(f"{listed(failing)} will not do{f'; {listed(good)} may' if good else ''}.")
    level = {"ok": "good", "note": "good", "warn": "warn", "fail": "bad"}[grave]
    return {"gravity": level, "word": _WORDS[grave], "sentences": sentences}


def _of(schemes: Sequence[str]) -> str:
    return f" of {listed(list(schemes))}" if schemes else ""


def _looks(checks: Sequence[Check], schemes: Sequence[str]) -> list[dict[str, Any]]:
    """Return what is not ok, the gravest first, with what follows and what to do; what schemes share once."""
    found: dict[tuple[str, ...], list[Check]] = {}
    for one in checks:
        if one.verdict != "ok":
            found.setdefault((one.verdict, one.name, one.consequence, one.remedy, one.source), []).append(one)
    order = sorted(found.items(), key=lambda pair: -VERDICTS.index(pair[0][0]))  # type: ignore[arg-type]
    return [
        {
            "level": {"fail": "bad"}.get(key[0], key[0]),
            "word": key[0],
            "name": key[1],
            "consequence": key[2],
            "remedy": key[3],
            "source": key[4],
            "whose": _whose([one.scheme for one in group], schemes),
        }
        for key, group in order
    ]


def _whose(names: Sequence[str], schemes: Sequence[str]) -> str:
    own = [name for name in dict.fromkeys(names) if name]
    return "all schemes" if len(schemes) > 1 and set(own) == set(schemes) else ", ".join(own)


def _table(checks: Sequence[Check], schemes: Sequence[str]) -> list[dict[str, Any]]:
    """Return a row for each check; one that all schemes share once."""
    rows: dict[tuple[Any, ...], list[Check]] = {}
    for one in checks:
        key = (one.name, f"{one.value:.6g}", f"{one.limit:.6g}", one.unit, one.verdict, one.at_least, one.strict)
        rows.setdefault(key, []).append(one)
    names = list(dict.fromkeys(one.name for one in checks))
    return [_row(group, schemes) for group in sorted(rows.values(), key=lambda group: names.index(group[0].name))]


def _row(group: Sequence[Check], schemes: Sequence[str]) -> dict[str, Any]:
    one = group[0]
    sense = (">" if one.strict else ">=") if one.at_least else ("<" if one.strict else "<=")
    unit = "" if one.unit == "-" else one.unit
    share = used(one)
    # Four decades below the limit and one above it, the limit at four fifths.
    reach = min(1.0, max(0.0, (math.log10(share) + 4.0) / 5.0))
    return {
        "name": one.name,
        "whose": _whose([each.scheme for each in group], schemes),
        "value": f"{one.value:.4g} {unit}".rstrip(),
        "limit": f"{sense} {one.limit:.4g} {unit}".rstrip(),
        "margin": f"{one.margin:+.3g} {unit}".rstrip() if math.isfinite(one.margin) else "-",
        "reach": f"{100 * reach:.1f}",
        "share": f"{share:.3g} of the limit" if 1e-3 < share < 1e3 else "far within" if share <= 1e-3 else "far beyond",
        "verdict": one.verdict,
        "level": _LEVELS[one.verdict],
        "source": one.source,
    }
