"""`casadi-gnc campaign`: fly many dispersed cases, go on where it was interrupted, and tell what they say."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from casadi_gnc.cli import completing
from casadi_gnc.cli.campaign_summary import print_summary
from casadi_gnc.cli.manners import Ending, Figures, Format, Report, page, print_json, tell
from casadi_gnc.cli.progress import Progress

if TYPE_CHECKING:
    from casadi_gnc.campaigns.result import Campaign


def campaign(
    problem: Annotated[
        str,
        typer.Argument(
            autocompletion=completing.problems, help='A problem file, a shipped one\'s name; or "show" and a folder.'
        ),
    ],
    folder: Annotated[Path | None, typer.Argument(help='After "show": folder of a campaign.')] = None,
    flights: Annotated[
        int | None, typer.Option(min=1, help="Number of cases; 1000 if left out. More than a folder has: goes on.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder of the rows; out/<mission>-campaign if left out.")] = None,
    scheme: Annotated[
        str | None, typer.Option(autocompletion=completing.schemes, help="Which scheme flies; the first if left out.")
    ] = None,
    plan: Annotated[
        str,
        typer.Option(
            help="independent, latin_hypercube, sobol, corners, one_at_a_time, grid:LEVELS, pick_freeze (sensitivity "
            "indices) or importance:SHIFT:KEY=PART,... (rare events along a direction)."
        ),
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
    keep: Annotated[
        str | None, typer.Option(help="Whole records to keep, such as worst:20,failed:50,random:10.")
    ] = None,
    figures: Figures = None,
    ending: Format = Ending.png,
    report: Report = None,
    threads: Annotated[int | None, typer.Option(min=1, help="All cores if left out.")] = None,
    confidence: Annotated[float, typer.Option(help="Of the bounds that are told.")] = 0.9,
    json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON, nothing else.")] = False,
) -> None:
    """Fly dispersed cases of a mission, or `campaign show FOLDER`: percentiles with bounds, statuses, drivers, worst.

    Ctrl-C or a kill lose nothing that is finished: the same command goes on. Examples:

    casadi-gnc campaign mission.toml --flights 10000 --out mc/

    casadi-gnc campaign show mc/ --figures mc/figures
    """
    from casadi_gnc.campaigns.campaign import parts_of
    from casadi_gnc.campaigns.keeping import FOLDER, Keep
    from casadi_gnc.errors import CampaignError
    from casadi_gnc.problem_files import by_name

    own = out or Path("out") / f"{Path(problem).stem}-campaign"
    report = page(report, folder if problem == "show" and folder is not None else own)
    if problem == "show":
        if folder is None:
            raise CampaignError("which campaign? give its folder: casadi-gnc campaign show FOLDER")
        _tell(by_name.open_campaign(folder), confidence, json, figures, ending, report)
        return
    if folder is not None:
        raise CampaignError(f"what is {str(folder)!r}? the folder of a campaign is given as --out {folder}")

    def said(sentence: str) -> None:
        if not json:
            tell(sentence)

    with Progress("cases", quiet=json) as told:
        made = by_name.campaign(
            problem,
            1000 if flights is None else flights,
            scheme=scheme,
            plan=plan,
            seed=seed,
            out=own,
            shard=parts_of(shard),
            audit=audit,
            engine=engine,
            scheduler=scheduler,
            threads=threads,
            keep=None if keep is None else Keep.of(keep),
            told=told,
            said=said,
        )
    if made.is_empty and not json:
        files = -(-made.identity["cases"] // made.identity["shard"])
        typer.echo(f"part {shard} has no cases: the campaign is {'one file' if files == 1 else f'{files} files'}")
        return
    _tell(made, confidence, json, figures, ending, report)
    if keep is not None and (made.folder / FOLDER).exists():
        count = len(list((made.folder / FOLDER).glob("*.npz")))
        tell(f"kept {count} whole records in {made.folder / FOLDER}", aside=json)


def _tell(
    made: Campaign, confidence: float, json: bool, figures: Path | None, ending: Ending, report: Path | None
) -> None:
    """Print what a campaign says, and draw it where that is asked for."""
    if not json:
        print_summary(made, confidence)
    else:
        print_json(made.summary(confidence))
    if figures is not None:
        from casadi_gnc.reports.campaign_gallery import draw_campaign

        drawn = draw_campaign(made, figures, confidence=confidence, ending=ending.value)
        tell(f"drew {len(drawn)} pictures into {figures}", aside=json)
    if report is not None:
        from casadi_gnc.reports.campaign_page import of_campaign

        tell(f"wrote {of_campaign(made, report, confidence)}", aside=json)
