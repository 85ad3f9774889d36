"""Compile device code with NVRTC, NVIDIA's compiler as a library: no toolkit and no GPU is needed.

Cubins are kept as other builds are, by the hash of all that went into them; the same text gives the same bytes.
"""

from __future__ import annotations

import ctypes
import hashlib
import importlib.util
import re
import sys
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Literal

from casadi_gnc.errors import GpuError
from casadi_gnc.system import folders, library_cache, temporary

ENDING = ".cubin"
#: Names of NVRTC and of what it loads by itself.
_OF_LINUX = ("libnvrtc.so.*", "libnvrtc-builtins.so.*")


@cache
def library() -> ctypes.CDLL:
    """Return NVRTC of the installed wheel.

    Raises
    ------
    GpuError
        Where it is not installed, or cannot be loaded.
    """
    name, builtins = ("nvrtc64_*.dll", "nvrtc-builtins64_*.dll") if sys.platform == "win32" else _OF_LINUX
    places = _wheels(name)
    if not places:
        raise GpuError('NVRTC is not installed; pip install "casadi-gnc[cuda]"')
    try:
        for more in places[0].parent.glob(builtins):
            ctypes.CDLL(str(more))  # NVRTC looks for it on the loader's path alone
        return ctypes.CDLL(str(places[0]))
    except OSError as error:
        raise GpuError(f"NVRTC of {places[0].parent} cannot be loaded: {error}") from None


def _wheels(name: str) -> list[Path]:
    """Return files of that name of NVIDIA's wheels, the newest first."""
    try:
        spec = importlib.util.find_spec("nvidia")
    except (ImportError, ValueError):
        return []
    homes = [Path(home) for home in (spec.submodule_search_locations or [])] if spec else []
    found = [path for home in homes for path in home.glob(f"*/*/{name}")]
    return sorted(found, key=lambda path: [int(number) for number in re.findall(r"\d+", path.name)], reverse=True)


def version() -> tuple[int, int]:
    """Return the version of NVRTC."""
    major, minor = ctypes.c_int(), ctypes.c_int()
    _check("nvrtcVersion", library().nvrtcVersion(ctypes.byref(major), ctypes.byref(minor)))
    return major.value, minor.value


def _check(what: str, code: int, log: str = "") -> None:
    if not code:
        return
    tell = library().nvrtcGetErrorString
    tell.restype = ctypes.c_char_p
    lines = [line.strip() for line in log.splitlines() if "error" in line] or [tell(code).decode()]
    raise GpuError(f"NVRTC refused ({what}): {lines[0]}")


def compiled(source: str, headers: Mapping[str, str], options: tuple[str, ...]) -> bytes:
    """Return the cubin of a text, from the cache where it is there.

    Parameters
    ----------
    source : device code.
    headers : texts by the names under which they are included.
    options : of NVRTC, with the architecture.

    Raises
    ------
    GpuError
        Where NVRTC is not installed, or refuses the text (with its first complaint).
    """
    key = hashlib.sha256()
    for part in (source, *(text for pair in sorted(headers.items()) for text in pair), *options, *map(str, version())):
        key.update(part.encode())
        key.update(b"\0")
    name, folder = key.hexdigest()[:32], folders.cache_folder()
    kept = library_cache.find(folder, name, ENDING)
    if kept is not None:
        return kept.read_bytes()
    made = translated(source, headers, options)[0]
    if folders.trouble(folder) is None:
        with temporary.folder(folder) as shop:
            product = shop / f"product{ENDING}"
            product.write_bytes(made)
            library_cache.keep(folder, name, product, ENDING)
    return made


def translated(
    source: str, headers: Mapping[str, str], options: tuple[str, ...], kind: Literal["CUBIN", "PTX"] = "CUBIN"
) -> tuple[bytes, str]:
    """Return the code of a text and what the compiler says of it; arguments and errors as of `compiled`."""
    nvrtc, program = library(), ctypes.c_void_p()
    names = (ctypes.c_char_p * len(headers))(*(name.encode() for name in headers))
    texts = (ctypes.c_char_p * len(headers))(*(text.encode() for text in headers.values()))
    words = (ctypes.c_char_p * len(options))(*(option.encode() for option in options))
    made = nvrtc.nvrtcCreateProgram(ctypes.byref(program), source.encode(), b"flight.cu", len(headers), texts, names)
    _check("nvrtcCreateProgram", made)
    try:
        code = nvrtc.nvrtcCompileProgram(program, len(options), words)
        log = _text(nvrtc.nvrtcGetProgramLogSize, nvrtc.nvrtcGetProgramLog, program).decode(errors="replace")
        _check("the generated source", code, log)
        size_of, get = (getattr(nvrtc, f"nvrtcGet{kind}{end}") for end in ("Size", ""))
        return _text(size_of, get, program), log
    finally:
        nvrtc.nvrtcDestroyProgram(ctypes.byref(program))


def _text(size_of: ctypes._FuncPointer, get: ctypes._FuncPointer, program: ctypes.c_void_p) -> bytes:
    size = ctypes.c_size_t()
    _check("a size", size_of(program, ctypes.byref(size)))
    held = ctypes.create_string_buffer(size.value)
    _check("a result", get(program, held))
    return held.raw
