"""`casadi-gnc report`: one page to look at and to send, of what lies in a folder."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def report(
    what: Annotated[str, typer.Argument(help="A folder of flights or of a campaign, or a problem to check.")],
    out: Annotated[Path, typer.Option(help="The page to write.")] = Path("report.html"),
) -> None:
    """Write one HTML page that needs nothing else: it works from disk, offline, and says what it lacks.

    Examples
    --------
    casadi-gnc report out/detumble --out detumble.html

    casadi-gnc report huang2020/detumble --out checks.html
    """
    from casadi_gnc.reports.writing import write_report

    typer.echo(f"wrote {write_report(what, out)}")
