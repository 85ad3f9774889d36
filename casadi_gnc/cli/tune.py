"""`casadi-gnc tune`: better gains, within the conditions of the law and the checks."""

from __future__ import annotations

import math
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from casadi_gnc.cli import completing
from casadi_gnc.cli.manners import Report, page, print_json, tell

if TYPE_CHECKING:
    from casadi_gnc.tuning.outcome import Moved, Tuned


class AgainstChoice(str, Enum):
    """Which flights count."""

    nominal = "nominal"
    worst = "worst"
    campaign = "campaign"


class ConditionsChoice(str, Enum):
    """Which conditions of the law must hold."""

    held = "held"
    all = "all"


def tune(
    problem: Annotated[
        str, typer.Argument(autocompletion=completing.problems, help="A mission file, or the name of a shipped one.")
    ],
    free: Annotated[str, typer.Option(help="Gains that may change, with commas: rate_gain,attitude_gain=0.1:5.")],
    out: Annotated[Path, typer.Option(help="The problem file with the new gains; comments stay.")],
    scheme: Annotated[
        str | None, typer.Option(autocompletion=completing.schemes, help="The scheme; the first if left out.")
    ] = None,
    against: Annotated[
        AgainstChoice, typer.Option(help="The mission as it is, its worst case, or the mean of a campaign.")
    ] = AgainstChoice.nominal,
    cost: Annotated[
        str | None,
        typer.Option(help="What is made small: terms joined by +, such as integral(mrp) + 0.1 integral(achieved)."),
    ] = None,
    conditions: Annotated[
        ConditionsChoice, typer.Option(help="Of the law's theorems: those that hold before must hold after, or all.")
    ] = ConditionsChoice.held,
    keep: Annotated[
        list[str] | None,
        typer.Option(help="NAME=LEAST of the linear loop: disk, decay_1_s or damping; may be repeated."),
    ] = None,
    digits: Annotated[int, typer.Option(min=1, max=17, help="Of the gains that are written.")] = 3,
    iterations: Annotated[int, typer.Option(min=1, help="At most so many.")] = 20,
    cases: Annotated[int, typer.Option(min=1, help="Of a campaign.")] = 64,
    plan: Annotated[str, typer.Option(help="Of a campaign, as for `casadi-gnc campaign`.")] = "sobol",
    seed: Annotated[int, typer.Option(min=0, help="Of all that is drawn.")] = 0,
    threads: Annotated[int | None, typer.Option(min=1, help="All cores if left out.")] = None,
    report: Report = None,
    json: Annotated[bool, typer.Option("--json", help="Print as JSON, nothing else.")] = False,
) -> None:
    """Tune gains and write them; exit code 1 if none better were found. A run that was killed goes on where it was."""
    from casadi_gnc.tuning.tune import tune as tuned

    report = page(report, out)
    found = tuned(
        problem,
        [each for each in free.split(",") if each.strip()],
        scheme=scheme,
        against=against.value,
        cost=cost,
        conditions=conditions.value,
        keep=_least(keep or []),
        digits=digits,
        iterations=iterations,
        cases=cases,
        plan=plan,
        seed=seed,
        out=out,
        threads=threads,
        told=tell,
    )
    if report is not None:
        from casadi_gnc.problem_files.loading import load
        from casadi_gnc.reports.tuning_page import of_tuning

        of_tuning(found.data(), load(problem, strict=False), load(out, strict=False), report)
    if json:
        print_json(found.data())
    else:
        _print(found)
        typer.echo("\n".join(f"wrote {path}" for path in (out, report) if path is not None))
    if not found.cost_after < found.cost_before:
        raise typer.Exit(1)


def _least(told: list[str]) -> dict[str, float]:
    """Return the bounds that are told as NAME=LEAST; raise `TuningError` for what is not."""
    from casadi_gnc.errors import TuningError

    found = {}
    for each in told:
        name, _, least = each.partition("=")
        try:
            found[name.strip()] = float(least)
        except ValueError:
            raise TuningError(f"--keep is {each!r}; expected NAME=LEAST, such as disk=0.5") from None
    return found


def _print(found: Tuned) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table(title=escape(f"{found.title or found.mission}, {found.scheme}"), title_justify="left")
    for name in ("", "before", "after", "unit"):
        table.add_column(name, justify="left" if name in ("", "unit") else "right", no_wrap=True)

    def part(title: str, rows: tuple[Moved, ...], *, worst: bool) -> None:
        if not rows:
            return
        table.add_section()
        table.add_row(f"[bold]{escape(title)}[/]")
        for one in rows:
            table.add_row(escape(one.name), number(one.before), number(one.after), escape(one.unit))
            if worst:
                table.add_row("  worst case", number(one.worst_before), number(one.worst_after), escape(one.unit))

    several = len(found.cases) > 1
    part("gains", found.gains, worst=False)
    part("cost", found.terms, worst=several)
    part("metrics", found.metrics, worst=several)
    part("requirements, robustness", found.requirements, worst=several)
    console = Console(soft_wrap=True)
    console.width = max(console.width, Console(width=1000).measure(table).maximum)
    console.print(table, soft_wrap=False, crop=False)
    typer.echo(found.sentence())
    if found.worse:
        typer.echo(f"moved the wrong way: {', '.join(one.name for one in found.worse)}")
    typer.echo(_checked(found))
    typer.echo(f"flown again from the file by other code: the cost differs by a share of {found.disagreement:.1g}")


def _checked(found: Tuned) -> str:
    mended = [name for name, was in found.checks_before.items()
              if was in ("warn", "fail") and found.checks_after.get(name, "ok") not in ("warn", "fail")]  # fmt: skip
    left = [f"{name} ({now})" for name, now in found.checks_after.items() if now in ("warn", "fail")]
    said = "checks: no new failure or warning"
    said += f"; mended {', '.join(mended)}" if mended else ""
    return said + (f"; as before {', '.join(left)}" if left else "")


def number(value: float) -> str:
    """Return a number as tables show it."""
    return "never" if math.isnan(value) else f"{value:.4g}"
