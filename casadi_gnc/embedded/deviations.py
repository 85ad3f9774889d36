"""The written deviations from MISRA C:2012 that a package carries: of the C that is printed, and of its runtime."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from typing import Any

from casadi_gnc.system import assets
from casadi_gnc.system.templates import template

DEVIATIONS = "DEVIATIONS.md"


def deviations(name: str, files: Iterable[str]) -> str:
    """Return the text of a package's deviations; `files` are its own, of which the runtime's places are told."""
    known = {path.replace(f"{name}_allocate", "gnc_allocate", 1) for path in files}
    written = []
    for row in _rows("runtime"):
        where = [f"`{place}`" for place in row["where"] if place.split(":")[0] in known]
        if row["tool"] == "misra" and where:
            written.append({**row, "where": where, "why": " ".join(row["why"].split())})
    return template("deviations.md.j2").render(name=name, printed=_rows("templates"), written=written)


def _rows(folder: str) -> list[dict[str, Any]]:
    path = assets.folder("codegen") / folder / "deviations.toml"
    return tomllib.loads(path.read_text(encoding="utf-8"))["deviation"]
