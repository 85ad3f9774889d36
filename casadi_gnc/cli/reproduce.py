"""`casadi-gnc reproduce`: every printed number of a paper beside ours."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from casadi_gnc.cli.manners import print_json
from casadi_gnc.cli.progress import Progress

if TYPE_CHECKING:
    from casadi_gnc.fidelity import PaperReport


def reproduce(
    paper: Annotated[
        list[str] | None, typer.Argument(help="Papers, e.g. huang2020, or claims files; all shipped.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for claims.html, claims.json and the figures.")] = None,
    processes: Annotated[int, typer.Option(min=1, help="That fly and compute side by side.")] = 2,
    fresh: Annotated[bool, typer.Option("--fresh", help="Answer anew what is cached.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Print as JSON, nothing else.")] = False,
) -> None:
    """Answer every claim and print verdicts; exit code 1 if a claim could not be answered."""
    from casadi_gnc import fidelity
    from casadi_gnc.system.files import prepare_folder

    files = {name: fidelity.read_claims(name) for name in paper or fidelity.papers()}
    if out is not None:
        prepare_folder(out)
    reports = []
    for name, file in files.items():
        with Progress(name, quiet=json) as progress:
            answers = fidelity.answer(file, processes=processes, progress=progress, fresh=fresh)
        reports.append(fidelity.PaperReport(Path(name).stem if name.endswith(".toml") else name, file, answers))
    written = _write(out, reports) if out is not None else []
    if json:
        from casadi_gnc.fidelity.report import as_data

        print_json(as_data(reports))
    else:
        for report in reports:
            _print(report)
        for path in written:
            typer.echo(f"wrote {path}")
    if any(report.failed for report in reports):
        raise typer.Exit(1)


def _write(folder: Path, reports: list[PaperReport]) -> list[Path]:
    from casadi_gnc.fidelity import figures, report

    drawn = {each.name: figures.draw(each, folder) for each in reports}
    return report.write(folder, reports, drawn)


def _print(report: PaperReport) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    from casadi_gnc.fidelity.report import deviation, ours, printed

    console = Console(soft_wrap=True)
    table = Table(title=escape(report.file.paper))
    for name in ("claim", "printed", "ours", "deviation", "verdict"):
        numeric = name in ("printed", "ours", "deviation")
        table.add_column(name, justify="right" if numeric else "left", no_wrap=numeric)
    notes: dict[str, int] = {}
    for answer in report.answers:
        told = answer.failure or answer.claim.assumption
        mark = f" [{notes.setdefault(told, len(notes) + 1)}]" if told else ""
        numbers = (escape(printed(answer)), ours(answer), deviation(answer))
        table.add_row(escape(answer.claim.text), *numbers, escape(answer.verdict.value + mark))
    console.print(table, soft_wrap=False)
    for told, number in notes.items():
        console.print(f"[{number}] {told}", highlight=False, markup=False)
    console.print(report.summary(), highlight=False, markup=False)
