"""Find out what something is, and write the page of it."""

from __future__ import annotations

from pathlib import Path

from casadi_gnc.campaigns.store import IDENTITY
from casadi_gnc.embedded.manifest import MANIFEST
from casadi_gnc.errors import ReportError
from casadi_gnc.reports import flight_page, records
from casadi_gnc.reports.endings import check_page
from casadi_gnc.tables.wording import cut


def is_package(folder: Path) -> bool:
    """Return whether a folder has the manifest of a flight package; its page is that of its verification."""
    return (folder / MANIFEST).is_file()


def write_report(what: str | Path, target: str | Path) -> Path:
    """Write the page of what a path or a name leads to; return the page's path.

    Parameters
    ----------
    what : a folder that `casadi-gnc fly` or `casadi-gnc campaign` wrote, a mission or synthesis file, or the name of a
        shipped one.
    target : the page.

    Raises
    ------
    GncError
        Where there is nothing of which a page can be made.
    """
    page, source = Path(target), Path(what)
    check_page(page)
    if source.is_dir():
        if (source / IDENTITY).exists():
            from casadi_gnc.problem_files.by_name import open_campaign
            from casadi_gnc.reports import campaign_page

            return campaign_page.of_campaign(open_campaign(source), page)
        if records.is_flight_folder(source):
            return flight_page.of_folder(source, page)
        raise ReportError(
            f"{cut(str(what), 200)!r} is no folder with flights; expected one that `casadi-gnc fly PROBLEM --out "
            "FOLDER` or `casadi-gnc campaign` wrote"
        )
    from casadi_gnc.problem_files.checking import checked_file
    from casadi_gnc.reports import check_page as checks

    found = checked_file(what)
    return checks.of_checks(found.title, found.checks, page, found.mission)
