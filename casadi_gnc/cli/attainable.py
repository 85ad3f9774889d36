"""`casadi-gnc attainable`: which effort the actuators can make, and with what margin."""

from __future__ import annotations

from typing import Annotated

import typer

from casadi_gnc.cli import completing
from casadi_gnc.cli.manners import Ending, Figures, Format, print_json, tell
from casadi_gnc.cli.progress import working


def attainable(
    problem: Annotated[
        str,
        typer.Argument(autocompletion=completing.problems, help="An allocation file, or the name of a shipped one."),
    ],
    figures: Figures = None,
    ending: Format = Ending.png,
    samples: Annotated[int, typer.Option(min=0, help="Errors tried besides the corners.")] = 200,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the samples.")] = 0,
    json: Annotated[bool, typer.Option("--json", help="Print as JSON.")] = False,
) -> None:
    """Report largest box, inscribed spheres and axis margins of three attainable sets.

    The sets: nominal geometry; every error with forces of its own; one choice of forces for all
    errors. The box that the file's torque_limit_N_m asks for is judged against each.
    """
    from casadi_gnc.allocation.attainable import attainable as analyse
    from casadi_gnc.problem_files.allocation_file import load_allocation
    from casadi_gnc.system.files import prepare_folder

    case = load_allocation(problem)
    drawn = None if figures is None else prepare_folder(figures) / f"attainable.{ending.value}"
    if case.least_propellant is not None and case.least_propellant.has_limits:
        typer.echo("warning: the sets are those of the bounds alone; [[limit]] tables are not in them", err=True)
    with working("measuring attainable sets"):
        found = analyse(case.physical, case.torque_limit, samples=samples, seed=seed, units=case.units)
    if json:
        print_json({"problem": case.name, **found.summary()})
    else:
        typer.echo(case.title or case.name)
        for sentence in found.sentences():
            typer.echo(sentence)
        for reach in found.reaches:
            typer.echo(reach.along(found.directions))
    if drawn is not None:
        from casadi_gnc.allocation.attainable_plots import plot_slices

        plot_slices(case.physical, drawn, wanted=case.torque_limit)
        tell(f"wrote {drawn}", aside=json)
