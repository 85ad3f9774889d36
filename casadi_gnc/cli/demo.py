"""`casadi-gnc demo`: a flight and its page, with nothing but the installed package."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from casadi_gnc.cli.manners import tell_written, unheard

#: What flies: twelve thrusters that push one way only, three schemes, a funnel that one of them keeps.
_PROBLEM = "huang2020/slew"


def demo(
    out: Annotated[Path, typer.Option(help="Folder for what it makes.")] = Path("demo"),
    json: Annotated[bool, typer.Option("--json", help="Print as JSON, nothing else.")] = False,
) -> None:
    """Fly a shipped mission, and write its problem file, records and a page to look at.

    It needs no source tree; with a C compiler it takes seconds, without one minutes. Then change the copy and fly it.
    """
    from casadi_gnc.cli.fly import fly
    from casadi_gnc.problem_files.document import locate
    from casadi_gnc.system.files import prepare_folder
    from casadi_gnc.system.text import shell

    copy = prepare_folder(out) / f"{Path(_PROBLEM).name}.toml"
    if not copy.exists():
        copy.write_text(locate(_PROBLEM).read_text(encoding="utf-8"), encoding="utf-8")
    page = out / "report.html"
    if json:
        with unheard():
            fly(str(copy), out=out, report=page)
        tell_written([copy, page], json=True)
        return
    fly(str(copy), out=out, report=page)
    typer.echo(f"look at {page} in a browser; change {copy}, then: casadi-gnc fly {shell(copy)} --report {shell(page)}")
