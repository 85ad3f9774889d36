"""The boards that packages are verified on: a TOML file each, shipped ones in `codegen/targets`.

A board of your own is a file like those: `--target ./board.toml`.
"""

from __future__ import annotations

import shutil
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from casadi_gnc.errors import TargetError, offer
from casadi_gnc.registry import Registry
from casadi_gnc.system import assets


@dataclass(frozen=True)
class Target:
    """Describe a board: what to compile with, what to run in; fields as in its file, and the folder of that."""

    name: str
    title: str
    compiler: str
    flags: tuple[str, ...]
    link: tuple[str, ...]
    script: str
    sources: tuple[str, ...]
    emulator: tuple[str, ...]
    hardware: tuple[str, ...]
    packages: tuple[str, ...]
    folder: Path = Path()

    @property
    def has_line(self) -> bool:
        """Tell whether the board writes to a serial line, as `{file}` in `emulator` says; else by semihosting."""
        return any("{file}" in part for part in self.emulator)

    def place(self, name: str) -> Path:
        """Return a source or script of the target: beside its own file, else among the shipped ones."""
        beside = self.folder / name
        return beside if beside.is_file() else assets.folder("codegen") / "targets" / name

    def missing(self) -> list[str]:
        """Return the commands that are not installed."""
        return [tool for tool in (self.compiler, self.emulator[0]) if shutil.which(tool) is None]

    def need(self) -> None:
        """Raise `TargetError` naming what is missing and how to get it."""
        if self.missing():
            raise TargetError(
                f"target {self.name} needs {' and '.join(self.missing())}, which is not installed; "
                f"`make targets` installs it (Debian packages {', '.join(self.packages)}), "
                "and --target host works without"
            )


def _shipped(name: str) -> Path:
    return assets.folder("codegen") / "targets" / f"{name}.toml"


#: Targets of installed packages by name: a `Target`, or the path of its file.
REGISTRY = Registry(
    "target",
    "casadi_gnc.targets",
    {},
    is_one=lambda thing: isinstance(thing, (Target, Path)),
    expected="a casadi_gnc.embedded.boards.Target, or the pathlib.Path of its file",
    error=TargetError,
)


def names() -> list[str]:
    """Return the names of the targets there are, shipped ones first."""
    own = sorted(path.stem for path in (assets.folder("codegen") / "targets").glob("*.toml"))
    return [*own, *REGISTRY.names()]


def find(name: Any) -> Target:
    """Return a target by its name, by the path of its own file ("./board.toml"), or as it is.

    Raises
    ------
    TargetError
        For a name that is none, naming those there are, or a file that does not describe a target.
    """
    if isinstance(name, Target):
        return name
    if isinstance(name, Path) or str(name).endswith(".toml"):
        return of_file(Path(name))
    if _shipped(str(name)).is_file():
        return of_file(_shipped(str(name)))
    if name not in REGISTRY.names():
        raise TargetError(
            f"no target {name!r}; {offer(name, ['host', *names()], ', and the path of a file of your own')}"
        )
    return find(REGISTRY.find(name))


def of_file(path: Path) -> Target:
    """Return the target that a TOML file describes; its sources and linker script lie beside it or are shipped ones."""
    try:
        fields = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise TargetError(f"the target {path} cannot be read: {error}") from error
    known = [field for field in Target.__dataclass_fields__ if field not in ("name", "folder")]
    wrong = [key for key in fields if key not in known]
    missing = [key for key in known if key not in fields]
    if wrong or missing:
        told = f"unknown key {wrong[0]!r}" if wrong else f"{missing[0]!r} is missing"
        raise TargetError(f"the target {path.name}: {told}; expected {', '.join(known)}")
    for key, value in fields.items():
        is_text = Target.__dataclass_fields__[key].type == "str"
        if not (isinstance(value, str) if is_text else _are_texts(value)):
            expected = "a text" if is_text else "a list of texts"
            raise TargetError(f"the target {path.name}: {key} is {value!r}, expected {expected}")
    if not fields["emulator"]:
        raise TargetError(f"the target {path.name}: emulator is empty, expected the command that runs an image")
    whole: dict[str, Any] = {key: tuple(value) if isinstance(value, list) else value for key, value in fields.items()}
    return Target(path.stem, **whole, folder=path.parent)


def _are_texts(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(one, str) for one in value)
