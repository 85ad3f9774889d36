"""Lay out answers: a summary line a paper, JSON, and a page with figures beside their claims."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from casadi_gnc.fidelity.claims import ClaimsFile
from casadi_gnc.fidelity.page import TEMPLATE
from casadi_gnc.fidelity.verdict import Answer, Verdict
from casadi_gnc.system.files import write_beside
from casadi_gnc.system.templates import environment


@dataclass(frozen=True)
class PaperReport:
    """Hold the answers to one paper's claims; `figures` are paths of pictures by claim id."""

    name: str
    file: ClaimsFile
    answers: list[Answer]

    @property
    def failed(self) -> bool:
        """Whether some claim could not be answered."""
        return any(answer.verdict is Verdict.FAILED for answer in self.answers)

    def summary(self) -> str:
        """Return one line: how many claims got which verdict."""
        counts = Counter(answer.verdict for answer in self.answers)
        told = ", ".join(f"{counts[verdict]} {verdict.value}" for verdict in Verdict if counts[verdict])
        return f"{self.name}: {len(self.answers)} claims, {told}"


def as_data(reports: list[PaperReport]) -> dict[str, Any]:
    """Return all reports as plain data."""
    return {
        "papers": [
            {
                "name": report.name,
                "paper": report.file.paper,
                "doi": report.file.doi,
                "summary": report.summary(),
                "claims": [answer.as_data() for answer in report.answers],
            }
            for report in reports
        ]
    }


def printed(answer: Answer) -> str:
    """Return the printed number with its relation and unit."""
    sign = {"equals": "", "at_most": "< ", "at_least": "> "}[answer.claim.relation]
    return f"{sign}{answer.claim.printed:.6g} {answer.claim.unit}".rstrip()


def ours(answer: Answer) -> str:
    """Return our number, or why there is none."""
    if answer.failure:
        return "-"
    return "never" if answer.ours is None else f"{answer.ours:.5g}"


def deviation(answer: Answer) -> str:
    """Return the deviation from an equality in percent; bounds have none."""
    value = answer.deviation
    if value is None or answer.claim.relation != "equals":
        return ""
    return f"{100 * value:+.2g} %" if answer.claim.printed else f"{value:+.2g}"


def write(folder: Path, reports: list[PaperReport], figures: dict[str, list[Path]]) -> list[Path]:
    """Write claims.json and claims.html; `figures` are pictures in the folder by paper. Return the paths."""
    data, page = folder / "claims.json", folder / "claims.html"
    text = json.dumps(as_data(reports), indent=2, allow_nan=False) + "\n"
    write_beside(data, lambda path: path.write_text(text, encoding="utf-8"))
    rendered = (
        environment(markup=True)
        .from_string(TEMPLATE)
        .render(
            reports=reports,
            printed=printed,
            ours=ours,
            deviation=deviation,
            figures={name: [path.name for path in paths] for name, paths in figures.items()},
        )
    )
    write_beside(page, lambda path: path.write_text(rendered, encoding="utf-8"))
    return [data, page]
