"""The report of a verification as one HTML page that needs nothing else."""

from __future__ import annotations

from typing import Any

import jinja2

from casadi_gnc.system import assets


def render_report(found: dict[str, Any]) -> str:
    """Return the page of what `verify` returned."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(assets.folder("codegen") / "templates"),
        undefined=jinja2.StrictUndefined,
        keep_trailing_newline=True,
        autoescape=True,
    )
    return environment.get_template("package_report.html.j2").render(found=found)
