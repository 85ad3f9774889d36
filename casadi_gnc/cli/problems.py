"""`casadi-gnc problems`: list the shipped problems, and copy one to change."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(help="List the problems shipped; `copy` gives one to change.", invoke_without_command=True)


@app.callback()
def list_problems(context: typer.Context) -> None:
    """List the problems shipped; `copy` gives one to change."""
    if context.invoked_subcommand is not None:
        return
    from casadi_gnc.problem_files.document import read, shipped

    names = shipped()
    width = max(map(len, names))
    for name in names:
        data = read(name).data
        typer.echo(f"{name:<{width}}  {data.get('kind', '')}: {data.get('title', '')}")


@app.command("copy")
def copy(
    name: Annotated[str, typer.Argument(help="A shipped problem, e.g. huang2020/detumble.")],
    folder: Annotated[Path, typer.Argument(help="Where to put it.")],
) -> None:
    """Copy a shipped problem into a folder; an existing file is never overwritten."""
    from casadi_gnc.errors import ProblemError
    from casadi_gnc.problem_files.document import read, shipped
    from casadi_gnc.system.files import prepare_folder, write_beside

    if name.removesuffix(".toml") not in shipped():
        raise ProblemError(f"no shipped problem {name!r}; there is {', '.join(shipped())}")
    found = read(name)
    source, text = found.path, found.text
    target = prepare_folder(folder) / source.name
    if target.exists():
        raise ProblemError(f"{target} exists and was left alone; choose another folder, or move it away")
    write_beside(target, lambda path: path.write_text(text, encoding="utf-8"))
    typer.echo(str(target))
