"""The page of a verified package: verdict first, whether its words agree, what a step costs on targets."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from casadi_gnc.reports import page

_TARGET = (
    ("title", "target", "name"),
    ("instructions_median", "instructions a step, median", "number"),
    ("instructions_worst", "worst", "number"),
    ("instructions_climbed", "dearest sought", "number"),
    ("instructions_bound", "no step above", "number"),
    ("instructions_first", "first", "number"),
    ("instructions_init", "init", "number"),
    ("text_bytes", "code [B]", "number"),
    ("data_bytes", "data [B]", "number"),
    ("bss_bytes", "bss [B]", "number"),
    ("stack_step_bytes", "stack of step [B]", "number"),
    ("stack_step_bound_bytes", "bound of it [B]", "number"),
    ("state_bytes", "state [B]", "number"),
    ("params_bytes", "parameters [B]", "number"),
    ("compiler", "compiler", "long"),
)


def of_verification(found: dict[str, Any], target: Path) -> Path:
    """Write the page of what `casadi_gnc.verify` returned; return its path."""
    return page.write(target, page_of(found))


def page_of(found: dict[str, Any]) -> str:
    """Return the page."""
    looks = _looks(found)
    context = {
        "title": found["title"],
        "subtitle": _what(found),
        "parts": [
            ("verdict", "Verdict"),
            *([("look", "Look")] if looks else []),
            ("words", "Words"),
            *([("targets", "Targets")] if found["targets"] or found["not_installed"] else []),
        ],
        "verdict": _verdict(found),
        "looks": looks,
        "words": [_words(one) for one in found["comparisons"]],
        "details": [_signals(one) for one in found["comparisons"] if one["words"]],
        "targets": _targets(found),
        "missing": [f"{name} is not installed here ({', '.join(tools)})." for name, tools in _missing(found)],
    }
    return page.render("package.html.j2", context)


def _what(found: dict[str, Any]) -> str:
    scheme = f", scheme {found['scheme']}" if found["scheme"] else ""
    return f"Package {found['package']}{scheme}, {found['real']}, {found['steps']} samples"


def _missing(found: dict[str, Any]) -> list[tuple[str, list[str]]]:
    return list(found["not_installed"].items())


def _verdict(found: dict[str, Any]) -> dict[str, Any]:
    exact = [one for one in found["comparisons"] if one["exact"]]
    differ = found["words"]
    said = f"{differ} words differ where none may." if differ else "No word differs where none may."
    sentences = [
        said,
        f"{len(exact)} comparisons must agree in every word, of {sum(one['of'] for one in exact)} words.",
    ]
    if found["edited"] or found["not_regenerated"]:
        sentences.append("Files are not as they were generated; see below.")
    sound = bool(found["is_sound"])
    return {
        "gravity": "good" if sound else "bad",
        "word": "Verified" if sound else "Not verified",
        "sentences": sentences,
    }


def _looks(found: dict[str, Any]) -> list[tuple[str, str]]:
    """Return what to look at: how grave, and a sentence."""
    looks = [("bad", f"Edited since it was generated: {', '.join(found['edited'])}.")] if found["edited"] else []
    if found["not_regenerated"]:
        looks.append(("bad", f"This version writes otherwise: {', '.join(found['not_regenerated'])}."))
    looks += [
        ("bad", f"{one['words']} of {one['of']} words differ: {one['what']}.")
        for one in found["comparisons"]
        if one["exact"] and one["words"]
    ]
    return looks + [("warn", f"{warning[:1].upper()}{warning[1:]}") for warning in found["warnings"]]


def _words(one: dict[str, Any]) -> list[Any]:
    if one["exact"]:
        verdict = (
            {"text": "no word differs", "level": "good"} if not one["words"] else {"text": "differ", "level": "bad"}
        )
    else:
        verdict = {"text": "may differ", "level": "note"}
    return [one["what"], str(one["words"]), str(one["of"]), verdict]


def _signals(one: dict[str, Any]) -> dict[str, Any]:
    rows = [
        [
            f"{signal['signal']}{f' [{unit}]' if (unit := signal['unit']) not in ('', '-') else ''}",
            str(signal["words"]),
            str(signal["count"]),
            *(f"{signal[name]:.3g}" for name in ("ulp", "absolute", "relative")),
        ]
        for signal in one["signals"]
    ]
    return {"what": one["what"], "rows": rows}


def _targets(found: dict[str, Any]) -> dict[str, Any] | None:
    if not found["targets"]:
        return None
    rows = [["-" if row[key] is None else str(row[key]) for key, _, _ in _TARGET] for row in found["targets"]]
    return {"columns": [(label, kind) for _, label, kind in _TARGET], "rows": rows}
