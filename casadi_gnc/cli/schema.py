"""`casadi-gnc schema`: the JSON Schema of a problem file, for editors."""

from __future__ import annotations

import json
from typing import Annotated

import typer


def schema(
    problem: Annotated[
        str | None, typer.Argument(help="A problem file: its schema alone, with the tables of your own craft and laws.")
    ] = None,
) -> None:
    """Print the JSON Schema of problem files of every kind, or of one file."""
    from casadi_gnc.benchmarks.sets import BenchmarkModel
    from casadi_gnc.fidelity.claims import ClaimsFile
    from casadi_gnc.problem_files import json_schema

    found = json_schema.every_kind(BenchmarkModel, ClaimsFile) if problem is None else json_schema.of_file(problem)
    typer.echo(json.dumps(found, indent=2))
