"""`casadi-gnc check`: what would go wrong, told before the flight."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from casadi_gnc.cli import completing
from casadi_gnc.cli.manners import Ending, Figures, Format, Report, page, print_json
from casadi_gnc.cli.progress import working

if TYPE_CHECKING:
    from casadi_gnc.checks import Check
    from casadi_gnc.problem_files.checking import Checked


def check(
    problem: Annotated[
        str,
        typer.Argument(
            autocompletion=completing.problems, help="A mission or synthesis file, or the name of a shipped one."
        ),
    ],
    scheme: Annotated[
        list[str] | None, typer.Option(autocompletion=completing.schemes, help="Only this scheme; may be repeated.")
    ] = None,
    figures: Figures = None,
    ending: Format = Ending.png,
    json: Annotated[bool, typer.Option("--json", help="Print as JSON, nothing else.")] = False,
    report: Report = None,
) -> None:
    """Check a problem without flying it; exit code 1 if any check fails."""
    from casadi_gnc.checks import worst

    report = page(report, Path(f"{Path(problem).stem}-checks"))
    checked = _checked(problem, scheme)
    title, found = checked.title, checked.checks
    if report is not None:
        from casadi_gnc.reports.check_page import of_checks

        of_checks(title, found, report, checked.mission)
    drawn = None
    if figures is not None:
        from casadi_gnc.reports.check_picture import draw
        from casadi_gnc.system.files import prepare_folder

        drawn = draw(title, found, prepare_folder(figures) / f"checks.{ending.value}")
    if json:
        _print_json(title, found)
    else:
        _print(title, found, drawn)
        if report is not None:
            typer.echo(f"wrote {report}")
    if worst(found) == "fail":
        raise typer.Exit(1)


def _checked(problem: str, schemes: list[str] | None) -> Checked:
    """Return what is found; of a synthesis within its time limit."""
    from casadi_gnc.cli.synthesize import TIME_LIMIT
    from casadi_gnc.errors import ProblemError
    from casadi_gnc.problem_files.checking import checked_file
    from casadi_gnc.problem_files.document import read

    document = read(problem)
    if document.data.get("kind") != "synthesis":
        with working(f"checking {document.path.name}"):
            return checked_file(problem, schemes)
    from casadi_gnc.system.processes import within

    try:
        return within(TIME_LIMIT, checked_file, problem)
    except TimeoutError:
        message = f"cannot be checked within {TIME_LIMIT:g} s; `casadi-gnc synthesize --time-limit` takes longer"
        raise ProblemError(message, document.path.name) from None


def _print_json(title: str, found: list[Check]) -> None:
    from casadi_gnc.checking import as_data

    print_json({"problem": title, "checks": as_data(found)})


def _sections(found: list[Check]) -> list[tuple[str, list[Check]]]:
    """Return checks under their schemes; what says the same of every scheme comes first, once."""
    by_scheme = {name: list(group) for name, group in itertools.groupby(found, key=lambda one: one.scheme)}
    flown = [name for name in by_scheme if name]
    if len(flown) < 2:
        return list(by_scheme.items())
    bare = [{replace(one, scheme="") for one in by_scheme[name]} for name in flown]
    shared = set.intersection(*bare)
    first = [one for one in by_scheme[flown[0]] if replace(one, scheme="") in shared]
    made = [("", by_scheme[""])] if "" in by_scheme else []
    made += [(f"all {len(flown)} schemes", first)] if first else []
    rest = {name: [one for one in by_scheme[name] if replace(one, scheme="") not in shared] for name in flown}
    return made + [(name, checks) for name, checks in rest.items() if checks]


def _print(title: str, found: list[Check], drawn: Path | None) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table(title=escape(title), title_justify="left")
    for name, justify in (("check", "left"), ("value", "right"), ("limit", "left"), ("", "left")):
        table.add_column(name, justify=justify, no_wrap=True)  # type: ignore[arg-type]
    colours = {"ok": "green", "note": "cyan", "warn": "yellow", "fail": "red"}
    for scheme, group in _sections(found):
        if scheme:
            table.add_section()
            table.add_row(f"[bold]{escape(scheme)}[/]")
        for one in group:
            unit = "" if one.unit == "-" else f" {one.unit}"
            sense = (">" if one.strict else ">=") if one.at_least else ("<" if one.strict else "<=")
            limit = f"{sense} {one.limit:.4g}{unit}"
            table.add_row(one.name, f"{one.value:.4g}{unit}", limit, f"[{colours[one.verdict]}]{one.verdict}[/]")
    # Nothing is cut, however narrow the terminal: a line that is too long runs on.
    console = Console(soft_wrap=True)
    console.width = max(console.width, Console(width=1000).measure(table).maximum)
    console.print(table, soft_wrap=False, crop=False)
    told: dict[tuple[str, ...], list[str]] = {}
    for one in found:
        if one.verdict != "ok":
            told.setdefault((one.verdict, one.name, one.consequence, one.remedy, one.source), []).append(one.scheme)
    for (verdict, name, consequence, remedy, source), schemes in told.items():
        whom = f" ({', '.join(dict.fromkeys(s for s in schemes if s))})" if any(schemes) else ""
        sentence = f"{verdict}: {name}{whom}: {consequence} {remedy}" + (f" [{source}]" if source else "")
        console.print(sentence, highlight=False, markup=False)
    counts = {verdict: sum(one.verdict == verdict for one in found) for verdict in ("ok", "note", "warn", "fail")}
    console.print(", ".join(f"{count} {verdict}" for verdict, count in counts.items()), highlight=False)
    if drawn is not None:
        console.print(f"wrote {drawn}", highlight=False, markup=False)
