"""`casadi-gnc schema`: the JSON Schema of a problem file, for editors."""

from __future__ import annotations

from typing import Annotated

import typer

from casadi_gnc.cli import completing
from casadi_gnc.cli.manners import print_json


def schema(
    problem: Annotated[
        str | None,
        typer.Argument(
            autocompletion=completing.problems,
            help="A problem file: its schema alone, with the tables of your own craft and laws.",
        ),
    ] = None,
    output: Annotated[
        str | None, typer.Option(help="A command, such as fly: the schema of what it prints with --json.")
    ] = None,
) -> None:
    """Print the JSON Schema of problem files of every kind, or of one file; or of what a command prints."""
    from casadi_gnc.benchmarks.sets import BenchmarkModel
    from casadi_gnc.errors import ProblemError
    from casadi_gnc.fidelity.claims import ClaimsFile
    from casadi_gnc.problem_files import json_schema

    if output is not None:
        from casadi_gnc.cli import outputs

        if problem is not None:
            raise ProblemError("give a problem file or --output, not both")
        print_json(outputs.schema(output))
        return
    found = json_schema.every_kind(BenchmarkModel, ClaimsFile) if problem is None else json_schema.of_file(problem)
    print_json(found)
