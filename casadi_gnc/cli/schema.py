"""`casadi-gnc schema`: the JSON Schema of a problem file, for editors."""

from __future__ import annotations

import json

import typer


def schema() -> None:
    """Print the JSON Schema of a problem file."""
    from casadi_gnc.missions.schema import MissionModel

    content = {"$schema": "https://json-schema.org/draft/2020-12/schema", **MissionModel.model_json_schema()}
    typer.echo(json.dumps(content, indent=2))
