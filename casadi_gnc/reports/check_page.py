"""The page of checks: verdict first, every check with its margin, poles and margins of the linearised loops."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.checking.broken_loops import SchemeMargins, scheme_margins
from casadi_gnc.checking.linear import LinearLoop, loop_at
from casadi_gnc.checking.margins import BrokenLoop, Margins
from casadi_gnc.checking.sampling import settled
from casadi_gnc.checks import VERDICTS, Check, worst
from casadi_gnc.errors import FlightError
from casadi_gnc.missions.mission import Mission
from casadi_gnc.reports import page
from casadi_gnc.reports.charts import Axis, Chart, Drawn, around
from casadi_gnc.reports.check_picture import used
from casadi_gnc.reports.verdicts import listed

_LEVELS = {"ok": "good", "note": "note", "warn": "warn", "fail": "bad"}
_WORDS = {"ok": "Nothing found", "note": "Flies; notes below", "warn": "Look before you fly", "fail": "Fails"}


def of_checks(title: str, checks: Sequence[Check], target: Path, mission: Mission | None = None) -> Path:
    """Write the page of checks; return its path. With the mission, poles and margins are on it."""
    return page.write(target, page_of(title, checks, mission))


def page_of(title: str, checks: Sequence[Check], mission: Mission | None = None) -> str:
    """Return the page."""
    schemes = list(dict.fromkeys(one.scheme for one in checks if one.scheme))
    loops = [] if mission is None else [_loop(mission, name) for name in schemes]
    context = {
        "title": title,
        "subtitle": "" if mission is None else mission.source,
        "parts": [
            ("verdict", "Verdict"),
            *([("look", "Look")] if worst(list(checks)) != "ok" else []),
            ("checks", "Checks"),
            *([("loops", "Loops")] if loops else []),
        ],
        "verdict": _verdict(checks, schemes),
        "looks": _looks(checks, schemes),
        "checks": _table(checks, schemes),
        "loops": loops,
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


def _loop(mission: Mission, name: str) -> dict[str, Any]:
    """Return poles and margins of a scheme's loop, linearised at its target when funnels have stopped narrowing."""
    scheme = mission.scheme(name)
    loop = loop_at(mission, scheme, settled(mission))
    if not loop.matrix.size or not loop.exists:
        told = "The loop has no slope at its target, so it has neither poles nor margins."
        return {"scheme": scheme.title or name, "told": told, "charts": [], "rows": []}
    try:
        found = scheme_margins(mission, scheme)
    except FlightError as error:
        told = f"{str(error)[:1].upper()}{str(error)[1:]}."
        return {"scheme": scheme.title or name, "told": told, "charts": [_poles(loop).svg()], "rows": []}
    return {
        "scheme": scheme.title or name,
        "told": _told(loop, found),
        "charts": [one.svg() for one in (_poles(loop), _nichols(found), *_bode(found))],
        "rows": [_margin_row(channel, one) for channel, one in found.channels.items()],
    }


def _told(loop: LinearLoop, found: SchemeMargins) -> str:
    ends = f"{found.effort_low:.3g} and {found.effort_high:.3g}" if math.isfinite(found.effort_high) else ""
    together = (
        f"between {ends}"
        if ends
        else f"above {found.effort_low:.3g}"
        if found.effort_low
        else "whatever that factor is"
    )
    return (
        f"Linearised at its target at {loop.t:g} s, with actuators that are not at their limits; each row is the loop "
        "cut at that effort or measurement, the others closed. With one factor between the true and the commanded "
        f"effort on every axis it is stable {together}."
    )


def _margin_row(channel: str, one: Margins) -> list[str]:
    def shown(value: float, unit: str = "") -> str:
        return f"{value:.4g}{unit}" if math.isfinite(value) else "none"

    def decibel(value: float) -> str:
        return f"{value:.4g} ({20 * math.log10(value):+.1f} dB)" if math.isfinite(value) and value > 0 else "none"

    return [
        channel,
        decibel(one.gain_low),
        decibel(one.gain_high),
        "none" if math.isnan(one.phase_at) else shown(math.degrees(one.phase), "°"),
        shown(one.phase_at, " rad/s"),
        shown(one.delay, " s"),
        shown(one.modulus),
        shown(one.disk),
    ]


def _poles(loop: LinearLoop) -> Chart:
    poles = np.linalg.eigvals(loop.moving) if loop.moving.size else np.zeros(0, dtype=complex)
    real, imaginary = np.real(poles), np.imag(poles)
    crosses = Drawn("cross", real, imaginary, "c1", f"{len(poles)} poles")
    if loop.sampled:
        angle = np.linspace(0, 2 * math.pi, 181)
        reach = max(1.15, float(np.abs(poles).max(initial=0.0)) * 1.05)
        # As wide as it is high on the chart, so that the circle is one.
        wide = reach * (560 - 80) / (300 - 58)
        circle = Drawn("line", np.cos(angle), np.sin(angle), "quiet", "unit circle: stable inside")
        ends = Axis("real part [-]", -wide, wide), Axis("imaginary part [-]", -reach, reach)
        return Chart("Poles of the closed loop, sample to sample", *ends, [circle, crosses])
    ends = Axis("real part [1/s]", *around(real, [0.0])), Axis("imaginary part [1/s]", *around(imaginary, [0.0]))
    rule = Drawn("rule", 0.0, None, "quiet", "stable left of it")
    return Chart("Poles of the closed loop", *ends, [rule, crosses])


def _curves(found: SchemeMargins) -> list[tuple[str, np.ndarray, np.ndarray, np.ndarray]]:
    """Return name, frequency, gain [dB] and phase [deg] of the loop cut at each effort, few enough points."""
    return [(name, *_seen(found.loop.channel(i))) for i, name in enumerate(list(found.channels)[: found.loop.channels])]


def _seen(loop: BrokenLoop) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    grid = loop.frequencies()
    response = loop.at(grid)[:, 0, 0]
    size = 20 * np.log10(np.maximum(np.abs(response), 1e-30))
    phase = np.degrees(np.unwrap(np.angle(response)))
    middle = phase[np.argmin(np.abs(size))]
    some = slice(None, None, 6)
    return grid[some], size[some], (phase - 360.0 * round((middle + 180.0) / 360.0))[some]


def _nichols(found: SchemeMargins) -> Chart:
    drawn = [
        Drawn("line", np.where(np.abs(phase + 180) < 190, phase, np.nan), np.where(np.abs(size) < 42, size, np.nan),
              f"c{i % 6}", name)
        for i, (name, _, size, phase) in enumerate(_curves(found))
    ]  # fmt: skip
    point = Drawn("cross", np.array([-180.0]), np.array([0.0]), "bad", "-1")
    return Chart("Nichols", Axis("phase [deg]", -360, 0), Axis("gain [dB]", -40, 40), [*drawn, point])


def _bode(found: SchemeMargins) -> list[Chart]:
    curves, gains, phases = _curves(found), [], []
    lowest, highest = min(at[0] for _, at, _, _ in curves), max(at[-1] for _, at, _, _ in curves)
    across = Axis("frequency [rad/s]", float(lowest), float(highest), logarithmic=True)
    for i, (name, at, size, phase) in enumerate(curves):
        gains.append(Drawn("line", at, np.clip(size, -100, 140), f"c{i % 6}", name))
        phases.append(Drawn("line", at, np.where(np.abs(phase + 180) < 361, phase, np.nan), f"c{i % 6}", name))
    gain = Axis("gain [dB]", *around(*[one.y for one in gains]))
    phase = Axis("phase [deg]", *around(*[one.y for one in phases], [-180.0]))
    levels = [Drawn("rule", None, level, "quiet") for level in (0.0, -180.0)]
    return [
        Chart("Bode, gain of the open loop", across, gain, [levels[0], *gains]),
        Chart("Bode, phase of the open loop", across, phase, [levels[1], *phases]),
    ]
