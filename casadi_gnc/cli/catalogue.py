"""`casadi-gnc laws` and `casadi-gnc crafts`: what there is, and what fits what."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from casadi_gnc.cli import completing
from casadi_gnc.cli.manners import print_json

if TYPE_CHECKING:
    from casadi_gnc.registry import Registry

_PROBLEM = typer.Argument(
    autocompletion=completing.problems, help="A mission file: what it names of your own is listed too."
)
_NAME = typer.Option("--show", help="Show this one only, in full.")
_JSON = typer.Option("--json", help="Print as JSON, nothing else.")


def laws(
    problem: Annotated[str | None, _PROBLEM] = None,
    show: Annotated[str | None, _NAME] = None,
    json: Annotated[bool, _JSON] = False,
) -> None:
    """List the laws: gains with symbols and units, the crafts that each fits, and why it does not fit others."""
    from casadi_gnc.laws import REGISTRY
    from casadi_gnc.problem_files import catalogue

    _refuse_name(problem, REGISTRY, "laws")
    samples = {craft.name: catalogue.sample_of(craft, problem) for craft in catalogue.crafts(problem)}
    found = [catalogue.law_data(law, samples) for law in catalogue.laws(problem)]
    found = _chosen(found, show, "law")
    if json:
        print_json({"laws": found})
        return
    for law in found:
        _heading(law)
        typer.echo(f"  reads {', '.join(law['reads']) or 'what the craft gives'}; commands {_or(law['commands'])}"
                   + (f"; models a {law['models']}" if law["models"] else ""))  # fmt: skip
        _table(["gain", "symbol", "unit", "range", "default", "meaning"], [_gain(gain) for gain in law["gains"]])
        fitting = [name + (f" as in {law['fits_as'][name]}" if name in law["fits_as"] else "") for name in law["fits"]]
        typer.echo(f"  fits {', '.join(fitting) or 'no craft that is known'}")
        for craft, why in law["does_not_fit"].items():
            typer.echo(f"  not {craft}: {'; '.join(why)}")


def crafts(
    problem: Annotated[str | None, _PROBLEM] = None,
    show: Annotated[str | None, _NAME] = None,
    json: Annotated[bool, _JSON] = False,
) -> None:
    """List the crafts: what each measures and makes, the keys of its tables, and the laws that fit it."""
    from casadi_gnc.missions.craft import REGISTRY
    from casadi_gnc.problem_files import catalogue
    from casadi_gnc.problem_files.document import shipped

    _refuse_name(problem, REGISTRY, "crafts")
    known = catalogue.laws(problem)
    found = []
    for craft in catalogue.crafts(problem):
        sample = catalogue.sample_of(craft, problem)
        fitting = [law.name for law in known if catalogue.fits(law, sample) == []]
        found.append(catalogue.craft_data(craft, sample, fitting))
    found = _chosen(found, show, "craft")
    if json:
        print_json({"crafts": found})
        return
    for craft in found:
        _heading(craft)
        typer.echo(f"  measures {_signals(craft['measures'])}")
        if craft["makes"] is not None:
            typer.echo(f"  makes {_signals(craft['makes'])}; believes in {_or(craft['believes'])}")
            typer.echo(f"  laws that fit: {', '.join(craft['laws']) or 'none that is known'}")
        if craft["example"]:
            is_ours = craft["example"] in shipped()
            told = f"casadi-gnc problems copy {craft['example']} ." if is_ours else craft["example"]
            typer.echo(f"  example: {told}")
        rows = [
            [key["table"], key["name"], "" if key["required"] else "optional", key["meaning"]] for key in craft["keys"]
        ]
        _table(["table", "key", "", "meaning"], rows)


def _refuse_name(problem: str | None, known: Registry, command: str) -> None:
    """Raise `RegistryError` where the name of a law or a craft stands in the place of a file."""
    from casadi_gnc.errors import RegistryError

    if problem in known.names() and not Path(str(problem)).exists():
        told = f"{problem!r} is a {known.kind} and no problem file"
        raise RegistryError(f"{told}; `casadi-gnc {command} --show {problem}` shows it")


def _chosen(found: list[dict[str, Any]], name: str | None, kind: str) -> list[dict[str, Any]]:
    from casadi_gnc.errors import RegistryError, offer

    if name is None:
        return found
    if name not in [one["name"] for one in found]:
        raise RegistryError(f"no {kind} {name!r}; {offer(name, [one['name'] for one in found])}")
    return [one for one in found if one["name"] == name]


def _heading(thing: dict[str, Any]) -> None:
    typer.echo(f"\n{thing['name']}: {thing['about']}")


def _gain(gain: dict[str, Any]) -> list[str]:
    default = "" if gain["required"] else "none" if gain["default"] is None else str(gain["default"])
    kind = " or ".join(map(str, gain["choices"])) or gain["range"]
    size = "" if gain["size"] == 1 else f" ({gain['size']})"
    return [f"{gain['name']}{size}", gain["symbol"], gain["unit"], kind, default, gain["meaning"]]


def _or(value: Any) -> str:
    return ", ".join(value) if isinstance(value, list) else value or "nothing of its own"


def _signals(signals: list[dict[str, Any]] | None) -> str:
    if signals is None:
        return "what a mission says (give its file)"
    return ", ".join(f"{s['name']} ({s['size']}) [{s['unit'] or '-'}]" for s in signals) or "nothing"


def _table(columns: list[str], rows: list[list[str]]) -> None:
    """Print rows under their columns; nothing is cut."""
    if not rows:
        return
    widths = [max(len(row[i]) for row in [columns, *rows]) for i in range(len(columns))]
    for row in [columns, *rows]:
        typer.echo("    " + "  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip())
