"""`casadi-gnc falsify`: the smallest dispersion that breaks a requirement, as a problem file."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args

import typer

from casadi_gnc.cli import completing
from casadi_gnc.cli.manners import Ending, Figures, Format, print_json, tell
from casadi_gnc.cli.progress import Progress

if TYPE_CHECKING:
    from casadi_gnc.missions.mission import Mission
    from casadi_gnc.tuning.broken_case import Break, Moved
    from casadi_gnc.tuning.falsified import Falsified


class Within(str, Enum):
    """Sets of dispersions."""

    contour = "contour"
    box = "box"
    ellipsoid = "ellipsoid"


def falsify(
    problem: Annotated[
        str,
        typer.Argument(
            autocompletion=completing.problems, help="A mission file with [[dispersion]]s, or a shipped one's name."
        ),
    ],
    requirement: Annotated[str, typer.Option(help="The id of the requirement that is to break.")],
    scheme: Annotated[
        str | None, typer.Option(autocompletion=completing.schemes, help="Which scheme flies; the first if left out.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Problem file of the break; out/<mission>-<requirement>.toml if left out."),
    ] = None,
    over: Annotated[
        list[str] | None,
        typer.Option(
            help="KEY=VALUE,VALUE,...: a further key of the file, a build for each value; allocation or theorem: all "
            "that these claim to cover. May be repeated."
        ),
    ] = None,
    within: Annotated[
        Within, typer.Option(help="contour of the density, box, or ellipsoid in that box.")
    ] = Within.contour,
    radius: Annotated[float, typer.Option(help="Of that set, in standard deviations of what is normal.")] = 4.0,
    flights: Annotated[int, typer.Option(min=1, help="At most.")] = 1000,
    seed: Annotated[int, typer.Option(min=0, help="Of the plan.")] = 0,
    figures: Figures = None,
    ending: Format = Ending.png,
    threads: Annotated[int | None, typer.Option(min=1, help="All cores if left out.")] = None,
    json: Annotated[bool, typer.Option("--json", help="Print as JSON, nothing else.")] = False,
) -> None:
    """Look for the smallest dispersion that breaks a requirement; exit code 1 if one does.

    The break is written as a problem file that flies like any other. Ctrl-C or a kill lose nothing that was flown: the
    same command goes on.
    """
    from casadi_gnc.problem_files.loading import load
    from casadi_gnc.system.files import prepare_folder
    from casadi_gnc.tuning.claims import Claimant
    from casadi_gnc.tuning.falsifying import falsify as look

    mission = load(problem)
    file = out or Path("out") / f"{mission.name}-{requirement}.toml"
    target = None if figures is None else prepare_folder(figures) / f"falsify.{ending.value}"
    with Progress("flights", quiet=json) as told:
        found = look(
            mission,
            requirement,
            scheme=scheme,
            over=_values([each for each in over or [] if each not in get_args(Claimant)]),
            claims=[each for each in get_args(Claimant) if each in (over or [])],
            within=within.value,
            radius=radius,
            flights=flights,
            seed=seed,
            out=file,
            threads=threads,
            told=told,
        )
    drawn = None if target is None else _draw(mission, found, target)
    if json:
        print_json(found.as_data())
    else:
        _print(found)
        if drawn is not None:
            typer.echo(f"wrote {drawn}")
    if found.known:
        tell(f"{found.known} of the flights were known from {file}.journal")
    if found.broken is not None:
        raise typer.Exit(1)


def _values(told: list[str]) -> dict[str, list[Any]]:
    """Return the values of each key that is told as KEY=VALUE,VALUE,...; raise `CampaignError` for what is not."""
    import tomllib

    from casadi_gnc.errors import CampaignError

    found: dict[str, list[Any]] = {}
    for each in told:
        key, _, values = each.partition("=")
        if key in found:
            raise CampaignError(f"--over names {key!r} twice; give all its values at once")
        try:
            found[key] = tomllib.loads(f"values = [{values}]")["values"] if values.strip() and key else []
        except tomllib.TOMLDecodeError:
            found[key] = []
        if not found[key]:
            raise CampaignError(
                f"--over is {each!r}; expected KEY=VALUE,VALUE,..., values as in the file, or allocation, theorem"
            )
    return found


def _draw(mission: Mission, found: Falsified, target: Path) -> Path:
    from casadi_gnc.missions.flying import fly
    from casadi_gnc.reports.falsify_picture import draw

    steps = [(each.did, each.flights, each.robustness, each.distance) for each in found.path]
    flights = [] if found.broken is None else [fly(mission, found.scheme), found.broken.flight]
    title = f"{mission.title or mission.name}: {found.requirement.id}"
    return draw(title, found.requirement, steps, found.way, flights, target, unit=found.unit)


def _print(found: Falsified) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    console = Console(soft_wrap=True)

    def say(sentence: str) -> None:
        console.print(sentence, highlight=False, markup=False)

    say(f"{found.mission}, {found.scheme}: {found.requirement.id}: {found.requirement.asked}")
    table = Table(title="the search's path", title_justify="left")
    for name in ("", "flights", "robustness", "distance"):
        table.add_column(name, justify="right" if name else "left", no_wrap=True)
    for step in found.path:
        table.add_row(step.did, str(step.flights), f"{step.robustness:+.4g}", f"{step.distance:.4g}")
    console.print(table, soft_wrap=False)
    if found.broken is None:
        _table(console, "where it is least", found.left_at, None)
    else:
        _table(console, "the smallest break", found.broken.moved, found.minimal)
    for note in found.notes:
        say(f"note: {note}")
    say(found.sentence)
    if found.proved is not None:
        say(found.proved.sentence)
    if found.minimal is not None and found.minimal is not found.broken:
        names = ", ".join(escape(each.key) for each in found.minimal.moved)
        say(f"alone enough, at {found.minimal.distance:.3g} standard deviations: {names}")
    for file in (one.file for one in (found.broken, found.minimal) if one is not None and one.file is not None):
        say(f"wrote {file}")


def _table(console: Any, title: str, moved: tuple[Moved, ...], minimal: Break | None) -> None:
    """Print what differs from the file, and what of it is enough."""
    from rich.markup import escape
    from rich.table import Table

    table = Table(title=title, title_justify="left")
    for name in ("key", "file", "here", "deviations", *(["alone enough"] if minimal else [])):
        table.add_column(name, justify="left" if name == "key" else "right", no_wrap=True)
    few = {each.key: each.value for each in minimal.moved} if minimal else {}
    for each in moved:
        away = "" if each.deviations is None else f"{each.deviations:+.2f}"
        enough = [_number(few[each.key]) if each.key in few else ""] if minimal else []
        table.add_row(escape(each.key), _number(each.nominal), _number(each.value), away, *enough)
    if moved:
        console.print(table, soft_wrap=False)


def _number(value: Any) -> str:
    return f"{value:.5g}" if isinstance(value, float) else "" if value is None else str(value)
