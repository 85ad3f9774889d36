"""`casadi-gnc new`: a commented starting point for a craft or a law of your own."""

from __future__ import annotations

import keyword
import re
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from casadi_gnc.cli.manners import tell_written


class Kind(str, Enum):
    """What is begun."""

    craft = "craft"
    law = "law"


def new(
    kind: Annotated[Kind, typer.Argument(help="craft or law.")],
    name: Annotated[str, typer.Argument(help="Name of the class, e.g. SailCraft; files are called sail_craft.")],
    folder: Annotated[Path, typer.Option(help="Where to put the files.")] = Path(),
    json: Annotated[bool, typer.Option("--json", help="Print as JSON, nothing else.")] = False,
) -> None:
    """Write NAME as a Python file with a mission that flies it; existing files are never overwritten."""
    from importlib import resources

    from casadi_gnc.errors import ProblemError
    from casadi_gnc.system.files import prepare_folder, write_beside

    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9]{0,40}", name) or keyword.iskeyword(name):
        raise ProblemError(f"{name!r} is no name for a class; write one such as SailCraft, of letters and digits")
    stem = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()
    if stem in ("numpy", "casadi", "casadi_gnc"):
        raise ProblemError(f"{stem}.py would hide the package {stem}; choose another name")
    base = name.removesuffix("Craft" if kind is Kind.craft else "Law") or name
    place, written = prepare_folder(folder), []
    targets = {ending: place / f"{stem}.{ending}" for ending in ("py", "toml")}
    for target in targets.values():
        if target.exists():
            raise ProblemError(f"{target} exists and was left alone; choose another name or --folder")
    whole = f"Starter{'Craft' if kind is Kind.craft else 'Law'}"
    for ending, target in targets.items():
        text = (resources.files("casadi_gnc") / "starters" / f"{kind.value}.{ending}").read_text(encoding="utf-8")
        text = text.replace(whole, name).replace("Starter", base).replace("starter", stem)
        write_beside(target, lambda path, text=text: path.write_text(text, encoding="utf-8"))
        written.append(target)
    tell_written(written, json=json)
    if not json:
        typer.echo(f"next: casadi-gnc check {targets['toml']}; casadi-gnc fly {targets['toml']} --out out")
