"""`casadi-gnc schema`: the JSON Schema of a problem file, for editors."""

from __future__ import annotations

import json
from typing import Any

import typer


def schema() -> None:
    """Print the JSON Schema of a problem file."""
    from pydantic import TypeAdapter

    from casadi_gnc import vehicles as crafts
    from casadi_gnc.benchmarks.sets import BenchmarkModel
    from casadi_gnc.fidelity.claims import ClaimsFile
    from casadi_gnc.problem_files.allocation_file import AllocationModel
    from casadi_gnc.problem_files.synthesis_file import SynthesisModel

    files: Any = AllocationModel | SynthesisModel | BenchmarkModel | ClaimsFile
    for name in crafts.names():
        files = files | crafts.module(name).MissionFile
    described = TypeAdapter(files).json_schema()
    content = {"$schema": "https://json-schema.org/draft/2020-12/schema", **described}
    typer.echo(json.dumps(content, indent=2))
