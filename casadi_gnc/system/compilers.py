"""Find a C compiler and build shared libraries, each only once.

Libraries are cached in the user's cache folder under the hash of everything that went into them:
source, headers, flags and the compiler's own version. A library is built beside its final name and
renamed, so an interrupted build leaves no broken entry, and its own hash is looked at before it is loaded
(`casadi_gnc.system.library_cache`). Where that folder cannot serve, another does (`casadi_gnc.system.folders`).
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import platform
import shlex
import shutil
import subprocess
import sys
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from casadi_gnc.errors import CompilerError, NoCompilerError
from casadi_gnc.system import folders, library_cache, temporary
from casadi_gnc.system.folders import CACHE_VARIABLE, cache_folder, workshop

__all__ = [
    "CACHE_VARIABLE",
    "Compiler",
    "available",
    "cache_folder",
    "compile_in",
    "compiled",
    "different",
    "find",
    "load",
    "open_library",
    "workshop",
]
#: -ffp-contract=off: no fused operation, so every compiler rounds alike.
FLAGS = ("-std=c99", "-ffp-contract=off", "-fPIC", "-shared")


@dataclass(frozen=True)
class Compiler:
    """Name a C compiler: its command, e.g. ``("gcc",)``, and its version line."""

    command: tuple[str, ...]
    version: str

    @property
    def name(self) -> str:
        """Short name for messages."""
        return Path(self.command[0]).name

    @property
    def identity(self) -> str:
        """What tells it from another: its version without the name that it was called by, or else its real file.

        `cc` and `gcc` that are one program say the same but for that name; programs behind one wrapper (ccache, a
        chooser) have one file and say different things.
        """
        said = self.version.removeprefix(self.name).strip()
        known = any(character.isdigit() for character in said)
        return said if known else os.path.realpath(shutil.which(self.command[0]) or self.command[0])


def different(found: list[Compiler]) -> list[Compiler]:
    """Return the compilers that are not the same program under another name; of each the first."""
    return list({compiler.identity: compiler for compiler in reversed(found)}.values())[::-1]


def _chosen() -> tuple[str, ...] | None:
    """Return the command that $CC names, if any; raise `CompilerError` if it cannot be read."""
    text = os.environ.get("CC", "").strip()
    try:
        return tuple(shlex.split(text)) or None
    except ValueError as error:
        raise CompilerError(f"the variable CC is {text!r}: {error}") from None


def _candidates() -> list[tuple[str, ...]]:
    commands: list[tuple[str, ...]] = [("cc",), ("gcc",), ("clang",)]
    try:
        import ziglang  # type: ignore[import-not-found]  # the optional extra `zig`
    except ImportError:
        return commands
    return [*commands, (sys.executable, "-m", ziglang.__name__, "cc")]


@lru_cache
def _probe(command: tuple[str, ...]) -> Compiler | None:
    if shutil.which(command[0]) is None:
        return None
    try:
        answer = subprocess.run([*command, "--version"], capture_output=True, text=True, timeout=60, check=True)
    except (OSError, subprocess.SubprocessError):
        return None
    return Compiler(command, answer.stdout.strip().splitlines()[0] if answer.stdout.strip() else "unknown version")


def available() -> list[Compiler]:
    """Return the compilers found, in order of preference: $CC, cc, gcc, clang, the zig wheel."""
    try:
        chosen = _chosen()
    except CompilerError:
        chosen = None
    commands = [*([chosen] if chosen else []), *_candidates()]
    return [found for command in commands if (found := _probe(command)) is not None]


def find() -> Compiler:
    """Return the preferred compiler.

    Raises
    ------
    NoCompilerError, CompilerError
        If there is none; if $CC names one that cannot be run (no other is taken behind one's back).
    """
    chosen = _chosen()
    if chosen and _probe(chosen) is None:
        raise CompilerError(f"the variable CC is {shlex.join(chosen)!r}, which cannot be run; unset it or mend it")
    found = available()
    if not found:
        raise NoCompilerError(
            "no C compiler found (looked for $CC, cc, gcc, clang and the ziglang wheel); install gcc or clang, "
            'or pip install "casadi-gnc[zig]"'
        )
    return found[0]


def compiled(
    source: str,
    *,
    include: Path,
    flags: tuple[str, ...] = ("-O2",),
    units: tuple[str, ...] = (),
    compiler: Compiler | None = None,
) -> Path:
    """Return the path of a shared library built from C text.

    Parameters
    ----------
    source : a whole translation unit.
    include : folder of headers and of `units`; their content is part of the key.
    flags : added after `FLAGS`.
    units : further C files of `include` to compile, with the same flags.
    compiler : `find()` by default.

    Raises
    ------
    NoCompilerError, CompilerError
        Where there is no compiler, or it refuses the source (with its first complaint).
    """
    compiler = compiler or find()
    key = hashlib.sha256()
    read = [*sorted(include.glob("*.h")), *(include / unit for unit in units)]
    texts = [path.read_text(encoding="utf-8") for path in read]
    machine = (platform.system(), platform.machine())
    for part in (source, *texts, *FLAGS, *flags, *compiler.command, compiler.version, *machine):
        key.update(part.encode())
        key.update(b"\0")
    name, troubles = key.hexdigest()[:32], dict[Path, str]()
    for find_folder in (cache_folder, folders.private_folder):
        folder = find_folder()
        if folder in troubles:
            continue
        if not folders.forbids_running(folder) and (known := library_cache.find(folder, name)) is not None:
            return known
        found = folders.trouble(folder)
        if found is None:
            try:
                return _built(folder, name, source, units, compiler, (*FLAGS, *flags, f"-I{include}"), include)
            except _NoRoomError:  # the other folder may be on another disk
                found = "has no space left"
            except OSError as error:
                found = f"cannot be written ({folders.reason(error)})"
        troubles[folder] = found
    told = "; ".join(f"{folder} {found}" for folder, found in troubles.items())
    raise CompilerError(f"compiled libraries have no folder: {told}; {folders.remedy(None)}")


class _NoRoomError(CompilerError):
    """A folder without space."""


def _built(
    folder: Path,
    name: str,
    source: str,
    units: tuple[str, ...],
    compiler: Compiler,
    flags: tuple[str, ...],
    include: Path,
) -> Path:
    """Build a library beside its place, and put it there."""
    with temporary.folder(folder) as shop:
        unit, product = shop / "unit.c", shop / f"product{library_cache.ENDING}"
        unit.write_text(source, encoding="utf-8")
        sources = [str(unit), *(str(include / name) for name in units)]
        compile_in(shop, compiler, [*flags, "-o", str(product), *sources, "-lm"], "the generated source")
        return library_cache.keep(folder, name, product)


def compile_in(shop: Path, compiler: Compiler, words: list[str], what: str) -> None:
    """Run a compiler, whose own temporary files go to `shop`.

    Parameters
    ----------
    words : its arguments, with `-o` and a file.
    what : is compiled, for the message.

    Raises
    ------
    CompilerError
        If it cannot be run, refuses (with its first complaint), or the disk is full.
    """
    product = Path(words[words.index("-o") + 1])
    # Complaints in English, whatever the user's language: they are looked through for their cause.
    environment = {**os.environ, "TMPDIR": str(shop), "LC_ALL": "C"}
    if not environment.get("HOME"):
        environment.setdefault("ZIG_GLOBAL_CACHE_DIR", str(shop))
    try:
        done = subprocess.run(
            [*compiler.command, *words], capture_output=True, text=True, errors="replace", timeout=600, env=environment
        )
    except (OSError, subprocess.SubprocessError) as error:
        raise CompilerError(f"{compiler.name} could not be run: {error}") from error
    if done.returncode or not product.is_file():
        full = folders.out_of_room(done.stderr, shop.parent)
        if full:
            raise _NoRoomError(full)
        raise CompilerError(f"{compiler.name} refused {what}: {_first_complaint(done.stderr)}")


def load(source: str, **options: Any) -> ctypes.CDLL:
    """Return a built library, loaded; arguments as for `compiled`.

    A library that cannot be loaded here (another machine with the same cache built it, say) is built once more.
    """
    path = compiled(source, **options)
    try:
        return ctypes.CDLL(str(path))
    except OSError:
        library_cache.forget(path)
    return open_library(compiled(source, **options))


def open_library(path: Path) -> ctypes.CDLL:
    """Return a library, loaded; raise `CompilerError` that says which folder is in the way."""
    try:
        return ctypes.CDLL(str(path))
    except OSError as error:
        raise CompilerError(
            f"the library just built in {path.parent} cannot be loaded: {error}; {folders.remedy(None)}"
        ) from None


def _first_complaint(text: str) -> str:
    lines = [line for line in text.splitlines() if "error" in line] or text.splitlines()
    return lines[0].strip() if lines else "no message"
