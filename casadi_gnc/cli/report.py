"""`casadi-gnc report`: one page to look at and to send, of what lies in a folder."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from casadi_gnc.cli.manners import tell_written
from casadi_gnc.cli.progress import working


def report(
    what: Annotated[str, typer.Argument(help="A folder of flights, a campaign or a package; or a problem.")],
    out: Annotated[Path, typer.Option(help="The page to write.")] = Path("report.html"),
    json: Annotated[bool, typer.Option("--json", help="Print as JSON, nothing else.")] = False,
) -> None:
    """Write one HTML page that needs nothing else: it works from disk, offline, and says what it lacks.

    A problem is checked, and a package verified on this machine, which runs the code that it keeps with your rights.
    """
    from casadi_gnc.reports import writing
    from casadi_gnc.reports.endings import check_page

    check_page(out)
    with working(f"writing {out}"):
        written = _of_package(Path(what), out) if writing.is_package(Path(what)) else writing.write_report(what, out)
    tell_written([written], json=json)


def _of_package(package: Path, out: Path) -> Path:
    """Verify a package on this machine, and write the page of that."""
    from casadi_gnc.delivery.verifying import verify
    from casadi_gnc.reports.package_page import of_verification

    return of_verification(verify(package), out)
