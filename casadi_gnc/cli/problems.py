"""`casadi-gnc problems`: list the shipped problems, and copy one to change."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from casadi_gnc.cli import completing
from casadi_gnc.cli.manners import print_json

app = typer.Typer(help="List the problems shipped; `copy` gives one to change.", invoke_without_command=True)


@app.callback()
def list_problems(
    context: typer.Context,
    json: Annotated[bool, typer.Option("--json", help="Print as JSON, nothing else.")] = False,
) -> None:
    """List the problems shipped; `copy` gives one to change."""
    if context.invoked_subcommand is not None:
        return
    from casadi_gnc.problem_files.document import read, shipped

    names = shipped()
    about = {name: read(name).data for name in names}
    found = [
        {"name": name, "kind": data.get("kind", ""), "title": data.get("title", "")} for name, data in about.items()
    ]
    if json:
        print_json({"problems": found})
        return
    width = max(map(len, names))
    for one in found:
        typer.echo(f"{one['name']:<{width}}  {one['kind']}: {one['title']}")


@app.command("copy")
def copy(
    name: Annotated[
        str, typer.Argument(autocompletion=completing.problems, help="A shipped problem, e.g. huang2020/detumble.")
    ],
    folder: Annotated[Path, typer.Argument(help="Where to put it.")],
    json: Annotated[bool, typer.Option("--json", help="Print as JSON, nothing else.")] = False,
) -> None:
    """Copy a shipped problem into a folder; an existing file is never overwritten."""
    from casadi_gnc.errors import ProblemError, offer
    from casadi_gnc.problem_files.document import read, shipped
    from casadi_gnc.system.files import prepare_folder, write_beside

    if name.removesuffix(".toml") not in shipped():
        raise ProblemError(f"no shipped problem {name!r}; {offer(name, shipped())}")
    found = read(name)
    source, text = found.path, found.text
    target = prepare_folder(folder) / source.name
    if target.exists():
        raise ProblemError(f"{target} exists and was left alone; choose another folder, or move it away")
    write_beside(target, lambda path: path.write_text(text, encoding="utf-8"))
    if json:
        print_json({"wrote": [str(target)]})
    else:
        typer.echo(str(target))
