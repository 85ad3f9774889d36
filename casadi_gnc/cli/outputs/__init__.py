"""What commands print with `--json`: one type a command, from which its JSON Schema is made.

Keys stay what they are from one version to the next; new ones may come. A number that does not exist is null, an
infinite one null or the text "inf" or "-inf", as the key's description says.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

__all__ = ["OUTPUTS", "schema"]

#: Home of what each command prints, "module:type"; "allocate --stream" prints one a line.
OUTPUTS = {
    "fly": "of_flights:Flights",
    "fly (sweeps)": "of_flights:Sweeps",
    "campaign": "of_campaigns:Campaign",
    "falsify": "of_searches:Falsification",
    "tune": "of_searches:Tuning",
    "check": "of_checks:Findings",
    "margins": "of_checks:Margins",
    "reproduce": "of_checks:Reproduction",
    "allocate": "of_gains:Allocation",
    "allocate --stream": "of_gains:Answer",
    "attainable": "of_gains:Attainable",
    "synthesize": "of_gains:Synthesis",
    "generate": "of_code:Generated",
    "verify": "of_code:Verification",
    "bench": "of_lists:Benchmark",
    "bench compare": "of_lists:Changes",
    "laws": "of_lists:Laws",
    "crafts": "of_lists:Crafts",
    "problems": "of_lists:Problems",
    "doctor": "of_lists:Doctor",
    "demo": "of_lists:Written",
    "new": "of_lists:Written",
    "report": "of_lists:Written",
    "problems copy": "of_lists:Written",
}


def schema(command: str) -> dict[str, Any]:
    """Return the JSON Schema (2020-12) of what a command prints with `--json`; `ProblemError` for another name."""
    from pydantic import TypeAdapter

    from casadi_gnc.errors import ProblemError, offer

    if command not in OUTPUTS:
        raise ProblemError(f"no output of {command!r}; {offer(command, OUTPUTS)}")
    module, name = OUTPUTS[command].split(":")
    found = TypeAdapter(getattr(import_module(f"{__name__}.{module}"), name)).json_schema()
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": f"casadi-gnc {command} --json"}
    return _strict({**found, **head})


def _strict(schema: Any) -> Any:
    """Return a schema whose objects have the keys named and no others, without the titles that repeat the keys."""
    if isinstance(schema, list):
        return [_strict(one) for one in schema]
    if not isinstance(schema, dict):
        return schema
    made = {}
    for key, value in schema.items():
        if key in ("properties", "$defs"):
            made[key] = {name: _strict({k: v for k, v in one.items() if k != "title"}) for name, one in value.items()}
        else:
            made[key] = _strict(value)
    if "properties" in made:
        made["additionalProperties"] = False
    return made
