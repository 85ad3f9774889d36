"""The manifest of a package: what it was made of, and the hash of each of its files.

What is read is a stranger's: a model says what a manifest may hold, paths stay inside the folder, and nothing that is
no plain file is opened.
"""

from __future__ import annotations

import hashlib
import re
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from casadi_gnc.embedded.names import check_package
from casadi_gnc.errors import PackageError

MANIFEST = "manifest.json"
#: Where a package's own Makefile and CMake build; never looked at.
BUILD = "build"
#: Most samples of the flight that is shipped, and most bytes of a file that is read.
MOST_STEPS, MOST_BYTES = 100_000, 2**29
_ENDINGS = """c h i s cc cpp cxx c++ hh hpp hxx inc inl ipp gch pch o obj a so dylib dll lib ld mk make cmake py pyc pyd
pth"""
_NAMES = """makefile gnumakefile cmakelists.txt specs"""
#: Endings, and names, of files that a compiler, a linker, make, CMake or Python may take up by itself.
_TAKEN_UP = frozenset([*(f".{one}" for one in _ENDINGS.split()), *_NAMES.split()])

_Hash = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


def _is_inside(path: str) -> str:
    """Return a path that stays inside a folder on every system; raise `ValueError` for any other."""
    plain = re.fullmatch(r"[^\\:\x00-\x1f\x7f]{1,250}", path)
    if not plain or any(part in ("", ".", "..") for part in path.split("/")):
        raise ValueError("leads out of the folder")
    return path


_Path = Annotated[str, AfterValidator(_is_inside)]


class _Model(BaseModel):
    model_config = ConfigDict(strict=True, extra="ignore", allow_inf_nan=False)


class MadeOf(_Model):
    """What a package was made of: a problem file, what was changed and the user's own code; objects; a function."""

    sha256: _Hash
    made_of: Literal["", "objects", "function", "allocation"] = ""
    file: str = ""
    changes: dict[str, Any] = {}
    code: dict[_Path, _Hash] = {}


class MadeBy(_Model):
    """The versions that wrote a package."""

    casadi_gnc: str
    casadi: str


class Manifest(_Model):
    """What a manifest says."""

    format: Annotated[int, Field(ge=1, le=1)]
    name: str
    title: str
    scheme: str
    real: Literal["float64", "float32"]
    frame: str = ""
    tunable: list[str]
    steps: Annotated[int, Field(gt=0, le=MOST_STEPS)]
    spoiled: Annotated[int, Field(ge=0, le=MOST_STEPS)]
    problem: MadeOf
    made_by: MadeBy
    coverage: dict[str, int] = {}
    files: Annotated[dict[_Path, _Hash], Field(min_length=1)]


def digest(text: str) -> str:
    """Return the SHA-256 of a text."""
    return hashlib.sha256(text.encode()).hexdigest()


def read_manifest(folder: Path) -> Manifest:
    """Return the manifest of a package folder; raise `PackageError` if it is none."""
    path = folder / MANIFEST
    try:
        found = Manifest.model_validate_json(content(path) or b"")
    except OSError as error:
        raise PackageError(
            f"{folder} is no package: its {MANIFEST} cannot be read ({error.strerror or error})"
        ) from None
    except (ValidationError, RecursionError) as error:
        where = ".".join(str(key) for key in error.errors()[0]["loc"]) if isinstance(error, ValidationError) else ""
        told = f"{where[:80]!r} of it is missing or not as this version writes it" if where else "it is no JSON of ours"
        raise PackageError(f"{folder} is no package of this version: its {MANIFEST} has another form, {told}") from None
    check_package(found.name)
    return found


def content(path: Path) -> bytes | None:
    """Return the bytes of a plain file of a package; None where there is none, or it is a link or too large.

    Raises
    ------
    OSError
        Where it cannot be read.
    """
    if path.is_symlink() or (path.exists() and not path.is_file()):
        return None
    return None if path.stat().st_size > MOST_BYTES else path.read_bytes()


def edited(folder: Path) -> list[str]:
    """Return the files of a package that were changed, added or taken away since it was made, with what happened."""
    known = read_manifest(folder).files
    strange, seen = [], set()
    for path in sorted(folder.rglob("*")):
        inside = path.relative_to(folder).as_posix()
        if (path.is_dir() and not path.is_symlink()) or inside == MANIFEST or inside.split("/")[0] == BUILD:
            continue
        seen.add(inside)
        if inside not in known:
            strange.append(f"{inside} (added)")
            continue
        found = content(path)
        if found is None or hashlib.sha256(found).hexdigest() != known[inside]:
            strange.append(f"{inside} (changed)")
    return [*strange, *(f"{inside} (missing)" for inside in known if inside not in seen)]


def is_taken_up(path: str) -> bool:
    """Tell whether a build or Python may take up a file of this name without being asked for it."""
    place = Path(path.lower())
    return place.suffix in _TAKEN_UP or place.name in _TAKEN_UP
