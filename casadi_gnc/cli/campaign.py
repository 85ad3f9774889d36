"""`casadi-gnc campaign`: fly many dispersed cases, go on where it was interrupted, and tell what they say."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from casadi_gnc.cli.progress import Progress

if TYPE_CHECKING:
    from casadi_gnc.campaigns.result import Campaign


def campaign(
    problem: Annotated[str, typer.Argument(help='A problem file, a shipped one\'s name; or "show" and a folder.')],
    folder: Annotated[Path | None, typer.Argument(help='After "show": folder of a campaign.')] = None,
    flights: Annotated[int | None, typer.Option(min=1, help="Number of cases; 1000 if left out.")] = None,
    out: Annotated[Path | None, typer.Option(help="Folder of the rows; out/<mission>-campaign if left out.")] = None,
    scheme: Annotated[str | None, typer.Option(help="Which scheme flies; the first if left out.")] = None,
    plan: Annotated[
        str, typer.Option(help="independent, latin_hypercube, sobol, corners, one_at_a_time or grid:LEVELS.")
    ] = "independent",
    seed: Annotated[int, typer.Option(min=0, help="Of the cases and their noise.")] = 0,
    engine: Annotated[
        str, typer.Option(help="c (lanes on threads), cuda, dask, dask:cuda, or auto: the first to be done.")
    ] = "auto",
    scheduler: Annotated[
        str | None, typer.Option(help="Of dask, such as tcp://host:8786; left out, workers are started here.")
    ] = None,
    shard: Annotated[str, typer.Option(help="i/n: only the i-th of n parts; machines may share a folder.")] = "1/1",
    audit: Annotated[int, typer.Option(min=0, help="Cases of each shard flown again in scalar C.")] = 3,
    threads: Annotated[int | None, typer.Option(min=1, help="All cores if left out.")] = None,
    confidence: Annotated[float, typer.Option(help="Of the bounds that are told.")] = 0.9,
    json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON, nothing else.")] = False,
) -> None:
    """Fly dispersed cases of a mission, or `campaign show FOLDER`: percentiles with bounds, statuses, drivers, worst.

    Ctrl-C or a kill lose nothing that is finished: the same command goes on. Examples:

    casadi-gnc campaign mission.toml --flights 10000 --out mc/

    casadi-gnc campaign show mc/ --json
    """
    from casadi_gnc.campaigns.campaign import parts_of
    from casadi_gnc.errors import CampaignError
    from casadi_gnc.problem_files import by_name

    if problem == "show":
        if folder is None:
            raise CampaignError("which campaign? give its folder: casadi-gnc campaign show FOLDER")
        _print(by_name.open_campaign(folder), confidence, json)
        return
    if folder is not None:
        raise CampaignError(f"what is {str(folder)!r}? the folder of a campaign is given as --out {folder}")

    def said(sentence: str) -> None:
        if not json:
            typer.echo(sentence, err=True)

    with Progress("cases", quiet=json) as told:
        made = by_name.campaign(
            problem,
            1000 if flights is None else flights,
            scheme=scheme,
            plan=plan,
            seed=seed,
            out=out or Path("out") / f"{Path(problem).stem}-campaign",
            shard=parts_of(shard),
            audit=audit,
            engine=engine,
            scheduler=scheduler,
            threads=threads,
            told=told,
            said=said,
        )
    _print(made, confidence, json)


def _print(found: Campaign, confidence: float, json: bool) -> None:
    import json as text

    summary = found.summary(confidence)
    if json:
        typer.echo(text.dumps(summary, indent=2, allow_nan=False))
        return
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    console = Console(soft_wrap=True)

    def say(sentence: str) -> None:
        console.print(sentence, highlight=False, markup=False)

    flew = summary["cases"] - summary["refused"]
    say(f"{summary['mission']}, {summary['scheme']}: {flew} flights of {summary['asked']} cases")
    for why, count in summary["why"].items():
        say(f"{count} cases refused: {why}")
    title = f"what a share of all flights stays within, with bounds that hold at {100 * confidence:g} %"
    table = Table(title=title, title_justify="left")
    for name in ("", "share", "within", "bounds"):
        table.add_column(name, justify="left" if name in ("", "bounds") else "right")
    for name, one in summary["metrics"].items():
        unit = f" [{one['unit']}]" if one["unit"] not in ("", "-") else ""
        if one.get("range"):
            table.add_row(escape(name.replace("_", " ") + unit), "all", "", "{:.4g} to {:.4g}".format(*one["range"]))
        for number, (share, found_one) in enumerate(one["percentiles"].items()):
            value, low, high = (_shown(found_one[part]) for part in ("value", "low", "high"))
            first = escape(name.replace("_", " ") + unit) if number == 0 else ""
            table.add_row(first, f"{share} %", value, f"{low} to {high}")
        table.add_section()
    if summary["metrics"]:
        console.print(table, soft_wrap=False)
    for name, one in summary["metrics"].items():
        if one["without"]:
            say(f"{one['without']} flights have no {name.replace('_', ' ')}, which counts as the worst")
    for name, one in summary["requirements"].items():
        shown = one["shown"]
        bounds = f"{_percent(shown['low'])} to {_percent(shown['high'])}"
        more = one.get("more_if_all_pass")
        todo = f"; {more} more flights that all pass would meet it" if one["verdict"] == "undecided" and more else ""
        say(
            f"{name}: {one['verdict']}: {one['asked']} in {one['met_by']} of {one['of']} flights, {bounds} of all, "
            f"asked of {_percent(one['share'])} with {_percent(one['confidence'])} confidence{todo}"
        )
    for one in summary["statuses"].values():
        share = one["share"]
        low, high = 100 * share["low"], 100 * share["high"]
        say(f"{one['flights']} flights ({low:.3g} to {high:.3g} % of all): {one['sentence']}")
    for name, one in summary["metrics"].items():
        drivers = [each for each in one.get("drivers", []) if abs(each["rank_correlation"]["value"]) >= 0.1][:3]
        if drivers:
            told = ", ".join(f"{each['key']} ({each['rank_correlation']['value']:+.2f})" for each in drivers)
            say(f"{name.replace('_', ' ')} goes with {told}")
    worst = [f"{name} of case {one['worst'][0]['case']}" for name, one in summary["metrics"].items()]
    if worst:
        say(f"the worst: {', '.join(worst)}")
    say(f"kept in {found.folder}; a case again: casadi-gnc fly {found.folder} --case worst:METRIC")


def _percent(share: float | None) -> str:
    return "?" if share is None else f"{100 * share:.6g} %"


def _shown(value: float | None) -> str:
    """Return a number; what has no value, or no bound, is beyond all numbers."""
    return "none" if value is None else f"{value:.4g}"
