"""Find the files that are no Python: the C of `codegen/` and the problems of `problems/`.

A wheel carries both folders inside the package; a source tree, and so an editable installation, has
them beside it.
"""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Literal

from casadi_gnc.errors import GncError


def folder(name: Literal["codegen", "problems"]) -> Path:
    """Return the path of an asset folder; raise `GncError` if the installation lacks it."""
    package = Path(str(resources.files("casadi_gnc")))
    for candidate in (package / "_assets" / name, package.parent / name):
        if candidate.is_dir():
            return candidate
    raise GncError(f"the installation lacks its {name}/ folder; install casadi-gnc again")


def problems() -> list[str]:
    """Return the names of the problems that come with the installation, e.g. "huang2020/detumble"."""
    root = folder("problems")
    return sorted(path.relative_to(root).with_suffix("").as_posix() for path in root.rglob("*.toml"))
