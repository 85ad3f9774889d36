"""Compiled libraries that are kept, each with a record of its size and hash, which are looked at before it is loaded.

An entry is two files of the cache folder: `KEY-HASH.so`, named by its own content so that two builds of one source
never write over each other, and `KEY.json`, which names it and is renamed into place last. An entry that was cut short,
changed, or can be written by others is none; it is built again.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import logging
import os
from pathlib import Path

from casadi_gnc.system import folders
from casadi_gnc.system.files import put_in_place, write_beside

LOG = logging.getLogger("casadi_gnc")
ENDING = ".dll" if os.name == "nt" else ".so"


def find(folder: Path, key: str, ending: str = ENDING) -> Path | None:
    """Return the library (or another build with that ending) of a key, if it is there as it was built."""
    try:
        said = json.loads((folder / f"{key}.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    if not isinstance(said, dict) or not isinstance(said.get("sha256"), str):
        return None
    library = folder / _name(key, said["sha256"], ending)
    try:
        found = {"size": library.stat().st_size, "sha256": _digest(library)}
    except OSError:
        return None
    if found != said or folders.not_ours(library):
        LOG.warning("the compiled library %s is not as it was built; it is not used, and built again", library)
        return None
    return library


def keep(folder: Path, key: str, product: Path, ending: str = ENDING) -> Path:
    """Move a library that was just built, on the same disk, into a folder; return where it is.

    Raises
    ------
    OSError
        Where the folder cannot be written or is full.
    """
    os.chmod(product, 0o700)
    record = {"size": product.stat().st_size, "sha256": _digest(product)}
    library = folder / _name(key, record["sha256"], ending)
    put_in_place(product, library)
    write_beside(folder / f"{key}.json", lambda place: place.write_text(json.dumps(record), encoding="utf-8"))
    return library


def forget(library: Path) -> None:
    """Take a library's entry out, so that it is built again."""
    with contextlib.suppress(OSError):
        library.with_name(f"{library.name.split('-')[0]}.json").unlink(missing_ok=True)


def _name(key: str, sha256: str, ending: str = ENDING) -> str:
    return f"{key}-{sha256[:16]}{ending}"


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
