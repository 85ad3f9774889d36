"""`casadi-gnc bench`: compare solvers, engines and steps; rebuild a report; compare two runs."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from casadi_gnc.cli.manners import print_json
from casadi_gnc.cli.progress import Progress

if TYPE_CHECKING:
    from casadi_gnc.benchmarks.results import Results
    from casadi_gnc.benchmarks.summary import Overview

app = typer.Typer(help="Benchmarks: allocation, synthesis, step, flight; report and compare.", no_args_is_help=True)


class ClockChoice(str, Enum):
    """What times are."""

    wall = "wall"
    cpu = "cpu"


class AccuracyChoice(str, Enum):
    """Which residuals count as a success."""

    low = "low"
    mid = "mid"
    high = "high"


Problems = Annotated[
    list[str] | None, typer.Argument(help="Sets, single families as SET/FAMILY, or files; all sets if left out.")
]
Backends = Annotated[str | None, typer.Option(help="Names, with commas between; all that are installed if left out.")]
Accuracy = Annotated[AccuracyChoice, typer.Option(help="Residuals that count as a success: 1e-3, 1e-6, 1e-8.")]
Out = Annotated[
    Path | None, typer.Option(help="Folder; a run that is there is gone on with. out/bench/<name> if left out.")
]
Json = Annotated[bool, typer.Option("--json", help="Print the summary as JSON, nothing else.")]
Samples = Annotated[int | None, typer.Option(min=1, help="Only the first so many samples of a family.")]
Passes = Annotated[int, typer.Option(min=1, help="Times that everything is measured; the least counts.")]
TimeLimit = Annotated[float, typer.Option(help="Seconds a solve may take; a failure is charged as much.")]
RunLimit = Annotated[float, typer.Option(help="Seconds after which nothing more is begun.")]
Shift = Annotated[float, typer.Option(help="Shift of the geometric mean [us].")]
Clock = Annotated[ClockChoice, typer.Option(help="cpu: processor time, for a machine that has other work.")]
Seed = Annotated[int, typer.Option(min=0, help="Seed of the order.")]


@app.command("allocation")
def allocation(
    problem: Problems = None,
    backends: Backends = None,
    accuracy: Accuracy = AccuracyChoice.mid,
    out: Out = None,
    samples: Samples = None,
    passes: Passes = 5,
    time_limit: TimeLimit = 1.0,
    run_limit: RunLimit = 150.0,
    clock: Clock = ClockChoice.wall,
    shift_us: Shift = 10.0,
    seed: Seed = 0,
    json: Json = False,
) -> None:
    """Compare allocation back ends, with and without uncertainty."""
    _run("allocation", problem, backends, out, as_json=json, accuracy=accuracy.value, samples=samples, passes=passes,
         time_limit=time_limit, run_limit=run_limit, shift=1e-6 * shift_us, clock=clock.value, seed=seed)  # fmt: skip


@app.command("synthesis")
def synthesis(
    problem: Problems = None,
    backends: Backends = None,
    accuracy: Accuracy = AccuracyChoice.mid,
    out: Out = None,
    samples: Samples = None,
    passes: Passes = 3,
    time_limit: TimeLimit = 10.0,
    run_limit: RunLimit = 150.0,
    clock: Clock = ClockChoice.wall,
    shift_us: Shift = 1000.0,
    seed: Seed = 0,
    json: Json = False,
) -> None:
    """Compare back ends for linear matrix inequalities."""
    _run("synthesis", problem, backends, out, as_json=json, accuracy=accuracy.value, samples=samples, passes=passes,
         time_limit=time_limit, run_limit=run_limit, shift=1e-6 * shift_us, clock=clock.value, seed=seed)  # fmt: skip


@app.command("step")
def step(
    problem: Problems = None,
    engines: Annotated[str | None, typer.Option(help="Names, with commas between; all if left out.")] = None,
    out: Out = None,
    samples: Samples = None,
    passes: Passes = 15,
    run_limit: RunLimit = 150.0,
    clock: Clock = ClockChoice.wall,
    seed: Seed = 0,
    json: Json = False,
) -> None:
    """Compare ways to run one controller step: numpy, CasADi's machine and C, our C in double and float."""
    _run("step", problem, engines, out, as_json=json, samples=samples, passes=passes, time_limit=1.0,
         run_limit=run_limit, shift=1e-7, clock=clock.value, seed=seed)  # fmt: skip


@app.command("flight")
def flight(
    problem: Problems = None,
    engines: Annotated[str | None, typer.Option(help="Names, with commas between; all if left out.")] = None,
    out: Out = None,
    passes: Passes = 5,
    run_limit: RunLimit = 150.0,
    clock: Clock = ClockChoice.wall,
    seed: Seed = 0,
    json: Json = False,
) -> None:
    """Compare engines on whole closed loops, in steps per second."""
    _run("flight", problem, engines, out, as_json=json, passes=passes, time_limit=60.0, share=5.0,
         run_limit=run_limit, shift=1e-3, clock=clock.value, seed=seed, cold_passes=0)  # fmt: skip


@app.command("report")
def report(
    folder: Annotated[Path, typer.Argument(help="Folder of a run.")],
    out: Annotated[Path | None, typer.Option(help="Where to write; the same folder if left out.")] = None,
    json: Json = False,
) -> None:
    """Rebuild the report from stored results."""
    from casadi_gnc.benchmarks import read_results

    results = read_results(folder)
    _finish(results, out, as_json=json)


@app.command("compare")
def compare(
    first: Annotated[Path, typer.Argument(help="Folder of a run.")],
    second: Annotated[Path, typer.Argument(help="Folder of another run.")],
    json: Json = False,
) -> None:
    """Print how many times as long the second run took as the first, with the spread, by contestant."""
    from dataclasses import asdict

    from casadi_gnc.benchmarks import comparing, read_results

    runs = [read_results(first), read_results(second)]
    for run in runs:
        _tell_corrupt(run)
    found = comparing.compare(*runs)
    if json:
        print_json([asdict(one) for one in found])
        return
    for run in runs:
        typer.echo(comparing.conditions(run))
    for one in found:
        typer.echo(f"{one.group} ({', '.join(one.families)}):")
        for sentence in comparing.sentences(one):
            typer.echo(f"  {sentence}")


def _run(
    name: str, problems: list[str] | None, named: str | None, out: Path | None, *, as_json: bool, **settings: Any
) -> None:
    from casadi_gnc.benchmarks import Settings, run

    chosen = None if named is None else [part.strip() for part in named.split(",") if part.strip()]
    folder = Path("out") / "bench" / name if out is None else out
    with Progress(name, quiet=as_json) as progress:
        results = run(
            name, problems or [], folder, contestants=chosen, settings=Settings(**settings), progress=progress
        )
    _finish(results, None, as_json=as_json)


def _finish(results: Results, out: Path | None, *, as_json: bool) -> None:
    from casadi_gnc.benchmarks.report import write_report
    from casadi_gnc.benchmarks.running import left_out
    from casadi_gnc.benchmarks.summary import overview

    _tell_corrupt(results)
    found = overview(results)
    written = write_report(found, out)
    if as_json:
        summary = next(path for path in written if path.name == "summary.json")
        typer.echo(summary.read_text(encoding="utf-8"), nl=False)
        return
    _print(found)
    missing = left_out(results)
    if missing:
        typer.echo(f"not complete: {missing} first passes are missing; run again with the same --out to go on")
    typer.echo(f"wrote to {written[0].parent}: {', '.join(path.name for path in written)}")


def _tell_corrupt(results: Results) -> None:
    for number, what in results.corrupt:
        typer.echo(f"warning: {results.folder}, line {number} {what}; left out, the rest was kept", err=True)


def _print(found: Overview) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    from casadi_gnc.benchmarks.markdown import missed, percent, shown, steps_per_second
    from casadi_gnc.benchmarks.summary import alike

    console = Console()
    console.width = max(console.width, 128)
    for group, order in found.orders.items():
        table = Table(title=escape(f"{found.results.header['title']}: {group} [us]"))
        table.add_column("", no_wrap=True)
        for head in ("success", "correct", "set-up", "cold", "warm", "p99", "max", "solver", "mean"):
            table.add_column(head, justify="right", no_wrap=True)
        rows, told = found.whole(group), found.results.header.get("objectives", {})
        is_missed = any(row["missed"] is not None for row in rows.values())
        for head in ("gap", *(["missed"] if is_missed else [])):
            table.add_column(head, justify="right", no_wrap=True)
        for row in rows.values():
            times = [shown(row[f"{name}_us"]) for name in ("setup", "cold", "warm", "p99", "max", "solver", "mean")]
            worth = [f"{row['gap']:.0e}", *([missed(row)] if is_missed else [])]
            table.add_row(row["contestant"], percent(row["success"]), percent(row["correct"]), *times, *worth)
        console.print(table)
        others = [f"{who} ({told[who]})" for who in rows if who in told]
        if others:
            console.print(f"another objective: {'; '.join(others)}", highlight=False, markup=False)
        if found.results.header["contest"] == "flight":
            rates = (f"{who} {steps_per_second(row):.3g}" for who, row in found.whole(group).items())
            console.print(f"steps per second: {', '.join(rates)}", highlight=False)
        for names in alike(order):
            console.print(f"do not differ beyond doubt, each from its neighbour: {', '.join(names)}", highlight=False)
