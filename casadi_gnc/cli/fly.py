"""`casadi-gnc fly`: fly a problem file and write signals, summary and pictures."""

from __future__ import annotations

import itertools
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from casadi_gnc.cli import completing
from casadi_gnc.cli.manners import Ending, Figures, Format, Report, page
from casadi_gnc.cli.progress import Progress

if TYPE_CHECKING:
    from casadi_gnc.missions.flight import Flight
    from casadi_gnc.missions.mission import Mission
    from casadi_gnc.missions.scheme import Metric
    from casadi_gnc.problem_files.sweeping import Sweep


class MathChoice(str, Enum):
    """Whose elementary functions."""

    gnc = "gnc"
    libm = "libm"


class ModeChoice(str, Enum):
    """How the law is run."""

    sampled = "sampled"
    continuous = "continuous"


def fly(
    problem: Annotated[
        str, typer.Argument(autocompletion=completing.problems, help="A problem file, or the name of a shipped one.")
    ],
    out: Annotated[Path | None, typer.Option(help="Folder for the results; out/<mission> if left out.")] = None,
    scheme: Annotated[
        list[str] | None, typer.Option(autocompletion=completing.schemes, help="Fly only this scheme; may be repeated.")
    ] = None,
    engine: Annotated[
        str, typer.Option(help="c: compiled C; vm: CasADi's virtual machine; or ./file.py:CLASS, or a package's.")
    ] = "c",
    math: Annotated[
        MathChoice, typer.Option(help="gnc: same words everywhere; libm: as CasADi's own.")
    ] = MathChoice.gnc,
    mode: Annotated[ModeChoice | None, typer.Option(help="Instead of the file's own mode.")] = None,
    decimation: Annotated[int | None, typer.Option(min=1, help="Keep every so many-th sample.")] = None,
    case: Annotated[
        str | None,
        typer.Option(help="Of a campaign's folder: a number, worst:METRIC, median:METRIC, failed:ID, failed:1."),
    ] = None,
    figures: Figures = None,
    ending: Format = Ending.png,
    report: Report = None,
    json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON, nothing else.")] = False,
) -> None:
    """Fly a mission and write <scheme>.npz, summary.json and mission.json; of sweeps summary.json alone.

    A case of a campaign is flown to be looked at: its pictures are drawn beside its records.
    """
    from casadi_gnc.errors import ReportError
    from casadi_gnc.missions.flying import fly as fly_one
    from casadi_gnc.problem_files.loading import load
    from casadi_gnc.problem_files.sweeping import load_sweeps
    from casadi_gnc.system.files import prepare_folder

    if case is not None:
        _fly_case(Path(problem), case, out, decimation, figures, ending, json, report)
        return
    mission = load(problem)
    chosen = [mission.scheme(name).name for name in scheme] if scheme else [s.name for s in mission.schemes]
    folder = Path("out") / mission.name if out is None else out
    report = page(report, folder)
    prepare_folder(folder)
    if sweeps := load_sweeps(problem):
        if report is not None or figures is not None:
            raise ReportError("a mission with sweeps keeps no records to draw; fly it without --report and --figures")
        options = {"engine": engine, "maths": math.value, "mode": mode.value if mode else None}
        _fly_sweeps(mission, sweeps, list(dict.fromkeys(chosen)), folder, json, options)
        return
    flights: list[Flight] = []
    _warn(mission, chosen, mode)
    for name in dict.fromkeys(chosen):
        with Progress(name, quiet=json) as progress:
            flights.append(
                fly_one(
                    mission, name, engine=engine, maths=math.value, mode=mode.value if mode else None,
                    decimation=decimation, progress=progress,
                )
            )  # fmt: skip
        flights[-1].save(folder)
    written = _keep(mission.with_timing(mode=mode.value) if mode else mission, flights, folder, figures, ending, report)
    if json:
        typer.echo((folder / "summary.json").read_text(encoding="utf-8"), nl=False)
    else:
        _print(mission, flights, written, report)
    if any(flight.diverged for flight in flights):
        raise typer.Exit(1)


def _keep(
    mission: Mission, flights: list[Flight], folder: Path, figures: Path | None, ending: Ending, report: Path | None
) -> list[Path]:
    """Write what is kept of flights beside their records, and what is to be looked at; return all paths."""
    from casadi_gnc.missions.flight import save_summary
    from casadi_gnc.reports import describing

    written = [folder / f"{flight.scheme}.npz" for flight in flights]
    written += [save_summary(folder, flights), describing.save(folder, mission, [one.scheme for one in flights])]
    if figures is not None:
        from casadi_gnc.reports.flight_pictures import plot_flights
        from casadi_gnc.system.files import prepare_folder

        written += plot_flights(mission, flights, prepare_folder(figures), ending.value)
    if report is not None:
        from casadi_gnc.reports import flight_page, loops

        known = loops.loops_of(mission, [one.scheme for one in flights])
        written.append(loops.save(folder, known))
        flight_page.of_mission(mission, flights, report, known)
    return written


def _fly_case(
    campaign: Path,
    case: str,
    out: Path | None,
    decimation: int | None,
    figures: Path | None,
    ending: Ending,
    json: bool,
    report: Path | None,
) -> None:
    """Fly one case of a campaign again, word for word, and write it as any flight, with its pictures."""
    from casadi_gnc.problem_files.by_name import open_campaign
    from casadi_gnc.system.files import prepare_folder

    found = open_campaign(campaign).case(case)
    mission = found.cases.varied.nominal
    folder = Path("out") / f"{mission.name}-case-{found.number}" if out is None else out
    report = page(report, folder)
    prepare_folder(folder)
    with Progress(f"case {found.number}", quiet=json) as progress:
        flight = found.fly(decimation=decimation, progress=progress)
    flight.save(folder)
    written = _keep(mission, [flight], folder, folder if figures is None else figures, ending, report)
    if json:
        typer.echo((folder / "summary.json").read_text(encoding="utf-8"), nl=False)
    else:
        typer.echo(f"case {found.number}")
        _print(mission, [flight], written, report)
    if flight.diverged:
        raise typer.Exit(1)


def _warn(mission: Mission, chosen: list[str], mode: ModeChoice | None) -> None:
    """Tell before the flight what laws say against their sample period."""
    from casadi_gnc.missions.noting import cautions

    timed = mission.with_timing(mode=mode.value) if mode else mission
    for name in dict.fromkeys(chosen):
        for sentence in cautions(timed.scheme(name)):
            typer.echo(f"{name}: before the flight: {sentence}", err=True)


def _fly_sweeps(
    mission: Mission, sweeps: tuple[Sweep, ...], chosen: list[str], folder: Path, quiet: bool, options: dict[str, Any]
) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    from casadi_gnc.problem_files.sweeping import fly_sweep, save_sweeps

    flown = []
    for sweep in sweeps:
        with Progress(sweep.name, quiet=quiet) as progress:
            flown.append((sweep, fly_sweep(sweep, chosen, told=progress, **options)))
    written = save_sweeps(folder, flown)
    if quiet:
        typer.echo(written.read_text(encoding="utf-8"), nl=False)
        return
    console = Console(soft_wrap=True)
    console.print(mission.title or mission.name, highlight=False, markup=False)
    for sweep, rows in flown:
        metric = next((metric for metric in mission.metrics if metric.name == sweep.show), None)
        unit = "s" if metric is None else metric.unit
        shown = sweep.show.replace("_", " ").lower() + (f" [{unit}]" if unit else "")
        table = Table(title=escape(shown))
        changed = [part for part in sweep.key.split(".") if part != "*"][-1]
        table.add_column(escape(changed.replace("_", " ")), justify="right")
        for name in chosen:
            table.add_column(name.replace("_", " "), justify="right")
        for value, row in zip(sweep.values, rows, strict=True):
            results = [sweep.shown(flight) for flight in row.values()]
            table.add_row(escape(f"{value}"), *("never" if each is None else f"{each:.5g}" for each in results))
        console.print(table, soft_wrap=False)
    console.print(f"wrote to {folder}: {written.name}", highlight=False, markup=False)


def _print(mission: Mission, flights: list[Flight], written: list[Path], report: Path | None) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    console = Console(soft_wrap=True)
    table = Table(title=escape(mission.title or mission.name))
    table.add_column("")
    for flight in flights:
        table.add_column(escape(flight.scheme.replace("_", " ")), justify="right")
    for metric in mission.metrics:
        unit = f" [{metric.unit}]" if metric.unit not in ("", "-") else ""
        values = (_shown(metric, flight.metrics[metric.name]) for flight in flights)
        table.add_row(escape(metric.name.replace("_", " ") + unit), *values)
    console.print(table, soft_wrap=False)
    if mission.requirements:
        console.print(_judged(mission, flights), soft_wrap=False)
        for one in mission.requirements:
            told = f"{one.id}: {one.text} ({one.asked})" if one.text else f"{one.id}: {one.asked}"
            console.print(told, highlight=False, markup=False)
    for flight in flights:
        for bit, (count, first) in flight.statuses.items():
            share = 100 * count / mission.timing.samples
            console.print(
                f"{flight.scheme}: {share:.3g} % of samples, first at {first:g} s: {bit.sentences[0]}",
                highlight=False,
                markup=False,
            )
        for note in flight.notes:
            console.print(f"{flight.scheme}: note: {note}", highlight=False, markup=False)
    if flights and flights[0].made["seed"] is not None:
        console.print(
            f"noise is drawn with the seed {flights[0].made['seed']} (noise.seed)", highlight=False, markup=False
        )
    for where, paths in itertools.groupby(written, key=lambda path: path.parent):
        names = ", ".join(path.name for path in paths)
        console.print(f"wrote to {where}: {names}", highlight=False, markup=False)
    if report is not None:
        console.print(f"wrote {report}", highlight=False, markup=False)


def _judged(mission: Mission, flights: list[Flight]) -> Any:
    """Return the table of the verdicts: met or not, and by how much."""
    from rich.markup import escape
    from rich.table import Table

    table = Table(title="Requirements")
    table.add_column("")
    for flight in flights:
        table.add_column(escape(flight.scheme.replace("_", " ")), justify="right")
    for one in mission.requirements:
        verdicts = [flight.verdicts[one.id] for flight in flights]
        told = [f"[{'green' if each.met else 'red'}]{each.word}[/] {escape(each.margin)}" for each in verdicts]
        table.add_row(escape(one.id), *told)
    return table


def _shown(metric: Metric, value: float | None) -> str:
    if value is not None:
        return f"{value:.5g}"
    return "never" if metric.kind in ("settling", "reaching") else "-"
