"""What the shell offers after the Tab key; where nothing is returned, shells offer files.

Read without the rooms that understand problem files: nobody waits for the Tab key.
"""

from __future__ import annotations


def problems(incomplete: str) -> list[str]:
    """Return the shipped problems whose name begins so."""
    from casadi_gnc.system import assets

    return [name for name in assets.problems() if incomplete and name.startswith(incomplete)]


def schemes(incomplete: str) -> list[str]:
    """Return the schemes of the mission that stands on the line already."""
    import os
    import tomllib
    from pathlib import Path

    from casadi_gnc.system import assets

    # The parser gives up at an option without its value; the line stands where the shell's own function put it.
    line = os.environ.get("_TYPER_COMPLETE_ARGS") or os.environ.get("COMP_WORDS", "")
    shipped, names = set(assets.problems()), []
    for word in line.split():
        path = assets.folder("problems") / f"{word}.toml" if word in shipped else Path(word)
        if path.suffix == ".toml" and path.is_file():
            try:
                tables = tomllib.loads(path.read_text(encoding="utf-8")).get("scheme", [])
                names += [str(one["name"]) for one in tables]
            except (OSError, ValueError, TypeError, KeyError):
                pass  # what is wrong with the file is told when it is used
    return [name for name in names if name.startswith(incomplete)]


def targets(incomplete: str) -> list[str]:
    """Return lists of targets, apart by commas, whose last name is completed."""
    from casadi_gnc.embedded import boards

    *before, last = incomplete.split(",")
    names = ["host", "all", *boards.names()]
    return [",".join([*before, name]) for name in names if name.startswith(last) and name not in before]
