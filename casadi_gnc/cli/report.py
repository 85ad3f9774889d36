"""`casadi-gnc report`: one page to look at and to send, of what lies in a folder."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def report(
    what: Annotated[str, typer.Argument(help="A folder of flights, a campaign or a package; or a problem.")],
    out: Annotated[Path, typer.Option(help="The page to write.")] = Path("report.html"),
) -> None:
    """Write one HTML page that needs nothing else: it works from disk, offline, and says what it lacks.

    A problem is checked, and a package verified on this machine, which runs the code that it keeps with your rights.

    Examples
    --------
    casadi-gnc report out/detumble --out detumble.html

    casadi-gnc report huang2020/detumble --out checks.html
    """
    from casadi_gnc.reports import writing
    from casadi_gnc.reports.style import check_page

    check_page(out)
    is_package = writing.is_package(Path(what))
    typer.echo(f"wrote {_of_package(Path(what), out) if is_package else writing.write_report(what, out)}")


def _of_package(package: Path, out: Path) -> Path:
    """Verify a package on this machine, and write the page of that."""
    from casadi_gnc.delivery.verifying import verify
    from casadi_gnc.reports.package_page import of_verification

    return of_verification(verify(package), out)
