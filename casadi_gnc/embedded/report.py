"""The report of a verification as one HTML page that needs nothing else."""

from __future__ import annotations

from typing import Any

from casadi_gnc.system.templates import template


def render_report(found: dict[str, Any]) -> str:
    """Return the page of what `verify` returned."""
    return template("package_report.html.j2").render(found=found)
