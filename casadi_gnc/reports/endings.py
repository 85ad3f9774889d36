"""What a page's file may be called."""

from __future__ import annotations

from pathlib import Path

from casadi_gnc.errors import ReportError


def check_page(target: Path) -> None:
    """Raise `ReportError` for an ending that is no page's."""
    if target.suffix not in (".html", ".htm"):
        raise ReportError(f"{target.name} has the ending {target.suffix!r}; a report ends in .html")
