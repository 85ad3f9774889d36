"""Find a C compiler and build shared libraries, each only once.

Libraries are cached in the user's cache folder under the hash of everything that went into them:
source, headers, flags and the compiler's own version. A library is built beside its final name and
renamed, so an interrupted build leaves no broken entry.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import platformdirs

from casadi_gnc.errors import CompilerError, NoCompilerError

#: Overrides the cache folder.
CACHE_VARIABLE = "CASADI_GNC_CACHE"
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


def _candidates() -> list[tuple[str, ...]]:
    chosen = os.environ.get("CC", "").strip()
    commands = [tuple(shlex.split(chosen))] if chosen else []
    commands += [("cc",), ("gcc",), ("clang",)]
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
    return [found for command in _candidates() if (found := _probe(command)) is not None]


def find() -> Compiler:
    """Return the preferred compiler; raise `NoCompilerError` if there is none."""
    found = available()
    if not found:
        raise NoCompilerError(
            "no C compiler found (looked for $CC, cc, gcc, clang and the ziglang wheel); install gcc or clang, "
            'or pip install "casadi-gnc[zig]"'
        )
    return found[0]


def cache_folder() -> Path:
    """Return the folder of compiled libraries; it may not exist yet."""
    chosen = os.environ.get(CACHE_VARIABLE, "").strip()
    return Path(chosen) if chosen else Path(platformdirs.user_cache_dir("casadi-gnc"))


def build(source: str, *, include: Path, flags: tuple[str, ...] = ("-O2",), compiler: Compiler | None = None) -> Path:
    """Return the path of a shared library built from C text.

    Parameters
    ----------
    source : a whole translation unit.
    include : folder of headers; their content is part of the key.
    flags : added after `FLAGS`.
    compiler : `find()` by default.

    Raises
    ------
    NoCompilerError, CompilerError
        Where there is no compiler, or it refuses the source (with its first complaint).
    """
    compiler = compiler or find()
    key = hashlib.sha256()
    headers = [header.read_text(encoding="utf-8") for header in sorted(include.glob("*.h"))]
    for part in (source, *headers, *FLAGS, *flags, *compiler.command, compiler.version):
        key.update(part.encode())
        key.update(b"\0")
    folder = _writable(cache_folder())
    library = folder / f"{key.hexdigest()[:32]}{'.dll' if os.name == 'nt' else '.so'}"
    if library.exists():
        return library
    with tempfile.TemporaryDirectory(dir=folder, prefix="build-") as workshop:
        unit = Path(workshop) / "unit.c"
        unit.write_text(source, encoding="utf-8")
        product = Path(workshop) / library.name
        command = [*compiler.command, *FLAGS, *flags, f"-I{include}", "-o", str(product), str(unit), "-lm"]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=600)
        except (OSError, subprocess.SubprocessError) as error:
            raise CompilerError(f"{compiler.name} could not be run: {error}") from error
        if done.returncode:
            raise CompilerError(f"{compiler.name} refused the generated source: {_first_complaint(done.stderr)}")
        os.replace(product, library)
    return library


def _first_complaint(text: str) -> str:
    lines = [line for line in text.splitlines() if "error" in line] or text.splitlines()
    return lines[0].strip() if lines else "no message"


def _writable(folder: Path) -> Path:
    """Return `folder`, made if need be, or a private temporary one where it cannot be written."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if os.access(folder, os.W_OK):
            return folder
    except OSError:
        pass
    return _private_folder()


@lru_cache
def _private_folder() -> Path:
    """Return a folder that lasts as long as the process."""
    folder = tempfile.TemporaryDirectory(prefix="casadi-gnc-", ignore_cleanup_errors=True)
    atexit.register(folder.cleanup)
    return Path(folder.name)
