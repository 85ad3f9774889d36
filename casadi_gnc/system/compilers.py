"""Find a C compiler and build shared libraries, each only once.

Libraries are cached in the user's cache folder under the hash of everything that went into them:
source, headers, flags and the compiler's own version. A library is built beside its final name and
renamed, so an interrupted build leaves no broken entry.
"""

from __future__ import annotations

import atexit
import ctypes
import hashlib
import os
import platform
import shlex
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

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


def cache_folder() -> Path:
    """Return the folder of compiled libraries; it may not exist yet."""
    chosen = os.environ.get(CACHE_VARIABLE, "").strip()
    return Path(chosen).resolve() if chosen else Path(platformdirs.user_cache_dir("casadi-gnc"))


def build(
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
    folder = _writable(cache_folder())
    library = folder / f"{key.hexdigest()[:32]}{'.dll' if os.name == 'nt' else '.so'}"
    if library.exists():
        return library
    with tempfile.TemporaryDirectory(dir=folder, prefix="build-") as workshop:
        unit = Path(workshop) / "unit.c"
        unit.write_text(source, encoding="utf-8")
        product = Path(workshop) / library.name
        sources = [str(unit), *(str(include / name) for name in units)]
        command = [*compiler.command, *FLAGS, *flags, f"-I{include}", "-o", str(product), *sources, "-lm"]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=600)
        except (OSError, subprocess.SubprocessError) as error:
            raise CompilerError(f"{compiler.name} could not be run: {error}") from error
        if done.returncode or not product.is_file():
            raise CompilerError(f"{compiler.name} refused the generated source: {_first_complaint(done.stderr)}")
        with product.open("rb") as file:
            os.fsync(file.fileno())
        os.replace(product, library)
    return library


def load(source: str, **options: Any) -> ctypes.CDLL:
    """Return a built library, loaded; arguments as for `build`.

    A cached file that cannot be loaded (cut short by a full disk, say) is built once more.
    """
    path = build(source, **options)
    try:
        return ctypes.CDLL(str(path))
    except OSError:
        path.unlink(missing_ok=True)
    try:
        return ctypes.CDLL(str(build(source, **options)))
    except OSError as error:
        raise CompilerError(f"the library just built cannot be loaded: {error}") from error


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
