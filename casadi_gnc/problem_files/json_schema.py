"""The JSON Schema of problem files, for editors: of every kind, or of one file with the tables of its own craft."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import BaseModel

from casadi_gnc.laws import REGISTRY as LAWS
from casadi_gnc.missions.craft import REGISTRY as CRAFTS
from casadi_gnc.missions.craft import Craft
from casadi_gnc.problem_files import catalogue
from casadi_gnc.problem_files.allocation_tables import AllocationModel
from casadi_gnc.problem_files.document import read
from casadi_gnc.problem_files.law_tables import law_table
from casadi_gnc.problem_files.loading import scheme_table
from casadi_gnc.problem_files.mission_tables import MissionTables
from casadi_gnc.problem_files.synthesis_file import SynthesisModel
from casadi_gnc.tables.part import own_tables

DIALECT = "https://json-schema.org/draft/2020-12/schema"
_REFERENCE = "#/$defs/{model}"


class Gathered:
    """Gather the definitions that schemas refer to; equal names of unlike models get numbers."""

    def __init__(self) -> None:
        self.definitions: dict[str, Any] = {}

    def of(self, model: type[BaseModel]) -> dict[str, Any]:
        """Return the schema of a model, its own definitions put beside all others."""
        schema = model.model_json_schema(ref_template=_REFERENCE)
        renamed: dict[str, str] = {}
        inner = schema.pop("$defs", {})
        for name, definition in inner.items():
            free = name
            while free in self.definitions and self.definitions[free] != definition:
                free = f"{free}_"
            renamed[name] = free
        for name, definition in inner.items():
            self.definitions[renamed[name]] = _with_names(definition, renamed)
        return _with_names(schema, renamed)


def _with_names(schema: Any, renamed: dict[str, str]) -> Any:
    if isinstance(schema, dict):
        found = {key: _with_names(value, renamed) for key, value in schema.items()}
        reference = schema.get("$ref")
        if isinstance(reference, str):
            found["$ref"] = _REFERENCE.format(model=renamed[reference.removeprefix("#/$defs/")])
        return found
    return [_with_names(each, renamed) for each in schema] if isinstance(schema, list) else schema


def every_kind(*others: type[BaseModel]) -> dict[str, Any]:
    """Return the schema of problem files of every kind; `others` are models of kinds that live elsewhere."""
    gathered = Gathered()
    laws = {name: LAWS.find(name) for name in LAWS.names()}
    missions = [mission(gathered, name, CRAFTS.find(name), laws) for name in CRAFTS.names()]
    rest = [gathered.of(model) for model in (AllocationModel, SynthesisModel, *others)]
    return {"$schema": DIALECT, "anyOf": [*missions, *rest], "$defs": gathered.definitions}


def of_file(problem: str | Path) -> dict[str, Any]:
    """Return the schema of one problem file: its own craft's tables, and all laws with those that it names."""
    kind, gathered = read(problem).data.get("kind"), Gathered()
    if kind == "mission":
        craft = catalogue.crafts(problem)
        model = read(problem).at("spacecraft", "model")
        own = next(one for one in craft if one.name == model)
        schema = mission(gathered, own.name, own.kind, {law.name: law.kind for law in catalogue.laws(problem)})
    else:
        models = {"allocation": AllocationModel, "synthesis": SynthesisModel}
        if kind not in models:
            return every_kind()
        schema = gathered.of(models[kind])
    return {"$schema": DIALECT, **schema, "$defs": gathered.definitions}


def mission(gathered: Gathered, name: str, craft: type[Craft], laws: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a mission file of one craft, with the tables of some laws by name."""
    common, whole, own = gathered.of(MissionTables), gathered.of(craft), own_tables(craft)
    properties, required = whole["properties"], whole.get("required", [])
    spacecraft = {
        "type": "object",
        "description": whole.get("description", ""),
        "additionalProperties": False,
        "properties": {
            "model": {"const": name, "type": "string", "description": "names the craft"},
            **{key: value for key, value in properties.items() if key not in own},
        },
        "required": ["model", *(key for key in required if key not in own)],
    }
    scheme = gathered.of(scheme_table(craft))
    scheme["properties"]["law"] = {
        "description": "type names the law, the other keys are its gains",
        "anyOf": [_law(gathered, law, kind) for law, kind in laws.items()],
    }
    tables = {key: value for key, value in properties.items() if key in own}
    common["title"] = f"Mission of {name}"
    common["properties"] |= {"spacecraft": spacecraft, **tables}
    common["properties"]["scheme"] = {"type": "array", "minItems": 1, "items": scheme}
    common["required"] = [*common["required"], "spacecraft", "scheme", *(key for key in required if key in own)]
    return common


def _law(gathered: Gathered, name: str, kind: Any) -> dict[str, Any]:
    schema = gathered.of(law_table(kind))
    schema["properties"] = {"type": {"const": name, "type": "string"}, **schema.get("properties", {})}
    schema["required"] = ["type", *schema.get("required", [])]
    return schema
