"""Find out what something is, and write the page of it."""

from __future__ import annotations

from pathlib import Path

from casadi_gnc.errors import ReportError
from casadi_gnc.reports import flight_page, records
from casadi_gnc.reports.style import check_page
from casadi_gnc.tables.wording import cut


def write_report(what: str | Path, target: str | Path) -> Path:
    """Write the page of what a path leads to; return the page's path.

    Raises
    ------
    ReportError
        Where there is nothing of which a page can be made.
    """
    page, source = Path(target), Path(what)
    check_page(page)
    if source.is_dir() and records.is_flight_folder(source):
        return flight_page.of_folder(source, page)
    raise ReportError(
        f"{cut(str(what), 200)!r} is no folder with flights; expected one that `casadi-gnc fly PROBLEM --out FOLDER` "
        "wrote"
    )
