"""What `verify` does in processes of their own: make a package's controller again, and run the C that was shipped.

Both run what somebody else wrote: his laws and crafts in Python, his C. Words go to and fro as plain bytes in files of
the workshop, so that no answer is read as anything but numbers.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.delivery import making
from casadi_gnc.delivery.packaging import REALS, warnings
from casadi_gnc.delivery.vectors import WORDS, fly_package
from casadi_gnc.embedded import compare, package
from casadi_gnc.embedded.controller import Options
from casadi_gnc.embedded.coverage import COVERAGE, coverage
from casadi_gnc.embedded.frames import package_files
from casadi_gnc.embedded.host import HostPackage
from casadi_gnc.embedded.manifest import digest
from casadi_gnc.embedded.packable import Packable
from casadi_gnc.errors import PackageError
from casadi_gnc.system import compilers

#: Folders of the workshop: what the package was made of, the package made anew, and its C as shipped.
MADE_OF, ANEW, SHIPPED = "made_of", "anew", "shipped"


def put_words(shop: Path, name: str, words: np.ndarray) -> None:
    """Write words as bytes."""
    (shop / f"{name}.words").write_bytes(np.ascontiguousarray(words).tobytes())


def take_words(shop: Path, name: str, shape: tuple[int, int], word: np.dtype) -> np.ndarray:
    """Return words of a shape; raise `PackageError` where there are not so many."""
    path = shop / f"{name}.words"
    size = shape[0] * shape[1] * word.itemsize
    if path.is_symlink() or not path.is_file() or path.stat().st_size != size:
        raise PackageError(f"the package's code left no {shape[0]} times {shape[1]} words")
    return np.frombuffer(path.read_bytes(), word).reshape(shape)


def rebuild(shop: Path, about: dict[str, Any]) -> dict[str, Any]:
    """Make a package again from what it was made of, and say what its words must be.

    Parameters
    ----------
    shop : with `MADE_OF` and the shipped words, "inputs" and "outputs".
    about : the manifest, with "shape": their rows, and columns in and out.

    Returns
    -------
    dict
        `files`, their hashes by path; the signals of an output; `warnings`; whether the problem's hash `is_named`.
        In the workshop: the package as `ANEW`; its outputs on the shipped inputs, "anew"; those that a wider or
        independent arithmetic gives, "other"; and where there is a mission the flight, "flown_in" and "flown_out".
    """
    word, (steps, width, height) = WORDS[about["real"]], about["shape"]
    inputs = take_words(shop, "inputs", (steps, width), word)
    outputs = take_words(shop, "outputs", (steps, height), word)
    mission, made = making.rebuilt(shop / MADE_OF, about, about["tunable"])
    expected = made.given, made.replayed.size + 1
    if (width, height) != expected:
        raise PackageError(
            f"the vectors have {width} numbers in and {height} out a sample, the controller has {expected[0]} and "
            f"{expected[1]}; generate the package again"
        )
    options = Options(about["name"], REALS[about["real"]], frame=about["frame"])  # type: ignore[arg-type]
    files = package_files(made, options)
    files |= made.replay_files(options, inputs, outputs, about["spoiled"])
    taken = coverage(files, options.name, inputs, height)
    files[COVERAGE] = taken.to_text()
    package.put(shop / ANEW, files)
    host = HostPackage(shop / ANEW, options.name)
    put_words(shop, "anew", host.replay(inputs, height))
    if mission is not None:
        host.reset()
        scheme = mission.scheme(made.scheme)
        flown = fly_package(mission, scheme, host, height, steps, about["spoiled"])
        put_words(shop, "flown_in", flown[0])
        put_words(shop, "flown_out", flown[1])
    other = _on_the_machine if options.real == "double" else _in_double
    for name, words in other(shop, made, options, inputs).items():
        put_words(shop, name, words)
    return {
        "files": {path: digest(text) for path, text in files.items()},
        "coverage": taken.summary,
        "outputs": [{"name": one.name, "size": one.size, "unit": one.unit} for one in made.replayed.signals],
        "title": made.title,
        "scheme": made.scheme,
        "is_exact": made.is_exact,
        "machine": made.machine,
        "is_flown": mission is not None,
        "is_named": (mission is None or mission.digest == about["problem"]["sha256"]),
        "warnings": warnings(mission, made.scheme, about["real"]),
    }


def _on_the_machine(shop: Path, made: Packable, options: Options, inputs: np.ndarray) -> dict[str, np.ndarray]:
    """Return the words of the C with the C library's functions, and those of CasADi's machine."""
    libm = Options(options.name, maths="libm")
    machine = made.on_the_machine(compare.as_numbers(inputs))
    expected = compare.as_words(machine, inputs.dtype)
    expected[:, -1] = machine[:, -1].astype(int)
    return {"other": _made(shop / "libm", made, libm, inputs, ("-O2", "-fno-builtin")), "expected": expected}


def _in_double(shop: Path, made: Packable, options: Options, inputs: np.ndarray) -> dict[str, np.ndarray]:
    """Return the words that double precision gives from the same measurements, rounded to floats."""
    wide = compare.as_words(compare.as_numbers(inputs).astype(float), np.dtype(np.uint64))
    replayed = _made(shop / "double", made, Options(options.name), wide, ("-O2",))
    reals = compare.as_numbers(np.ascontiguousarray(replayed[:, :-1]))
    expected = np.column_stack([compare.as_words(reals, inputs.dtype), replayed[:, -1].astype(np.uint32)])
    return {"expected": expected.astype(np.uint32)}


def _made(folder: Path, made: Packable, options: Options, inputs: np.ndarray, flags: tuple[str, ...]) -> np.ndarray:
    """Return the output words of the controller made anew with other options."""
    files = made.files(options)
    files["test/replay.h"] = made.replay_header(options, len(inputs))
    package.put(folder, files)
    return HostPackage(folder, options.name, flags=flags).replay(inputs, made.replayed.size + 1)


def replay(shop: Path, given: dict[str, Any]) -> None:
    """Compile the C that was shipped, and write its outputs on the shipped inputs: "found".

    Parameters
    ----------
    given : name of the package, its numbers, the `compiler`, and "shape" as for `rebuild`.
    """
    compiler = compilers.Compiler(tuple(given["compiler"]), given["version"])
    word, (steps, width, height) = WORDS[given["real"]], given["shape"]
    inputs = take_words(shop, "inputs", (steps, width), word)
    host = HostPackage(shop / SHIPPED, given["name"], compiler=compiler)
    put_words(shop, "found", host.replay(inputs, height))
