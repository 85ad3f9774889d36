"""Verify a flight package: its words on this machine, against CasADi's machine, and on targets.

A package comes from a stranger. Its manifest and vectors are read by a model, its controller is made again from what it
was made of, and only files that such a package has are compiled, from copies, in processes of their own
(`casadi_gnc.delivery.rebuilding`). What the processes answer is compared here.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError

from casadi_gnc.delivery import making, rebuilding
from casadi_gnc.delivery.rebuilding import ANEW, MADE_OF, SHIPPED, put_words, take_words
from casadi_gnc.delivery.vectors import WORDS, read_vectors
from casadi_gnc.embedded import boards as known_boards
from casadi_gnc.embedded import compare, targets
from casadi_gnc.embedded.manifest import MANIFEST, Manifest, content, digest, edited, is_taken_up, read_manifest
from casadi_gnc.errors import PackageError
from casadi_gnc.signals import Layout, Signal
from casadi_gnc.system import apart, compilers

LOG = logging.getLogger("casadi_gnc")
#: Seconds that a process may take, and more for each sample.
PATIENCE, A_SAMPLE = 600.0, 0.05


class _Answer(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid")


class _Output(_Answer):
    name: str
    size: int
    unit: str


class _Rebuilt(_Answer):
    """What the process that made the package again answers."""

    files: dict[str, str]
    coverage: dict[str, int]
    outputs: list[_Output]
    title: str
    scheme: str
    is_exact: bool
    machine: str
    is_flown: bool
    is_named: bool
    warnings: list[str]


def verify(folder: str | Path, target: Sequence[Any] = ("host",)) -> dict[str, Any]:
    """Compare a package with what it was made of, CasADi's virtual machine, other compilers and targets, word by word.

    The package's code is run: its C, and the user's own Python that it keeps. It runs in processes of their own with
    this user's rights; verify what comes from somebody whom you do not trust where nothing can be lost.

    Parameters
    ----------
    folder : of the package.
    target : "host" and names of targets.

    Returns
    -------
    dict
        Plain data: for each comparison the differences signal by signal, for each target its measures;
        `words` is the number of words that differ where none may. `is_sound` tells whether nothing is wrong.

    Raises
    ------
    PackageError, TargetError, CompilerError
        For a folder that is no package or has files that builds would take up and no package has; code that crashes
        or does not end; tools that are missing or refuse.
    """
    folder = Path(folder)
    about, changes = read_manifest(folder), edited(folder)
    refuse_strangers([change.removesuffix(" (added)") for change in changes if change.endswith(" (added)")], folder)
    boards = [known_boards.find(one) for one in dict.fromkeys(target) if one != "host"]
    for board in boards:
        board.need()
    inputs, outputs = read_vectors(folder, about.real)
    if len(inputs) != about.steps:
        raise PackageError(f"{folder} has vectors of {len(inputs)} samples, its manifest says {about.steps}")
    with compilers.workshop() as shop:
        bench = _Bench(folder, about, shop, inputs, outputs)
        comparisons = bench.on_host() if "host" in target else []
        comparisons += bench.made_anew()
        measured = []
        for board in boards:
            only = about.real == "float32"
            found = targets.measure(bench.on_board(), about.name, board, float_only=only, prove=True, climb=True)
            lines = compare.differences(found.outputs, outputs, bench.layout)
            comparisons.append(_comparison(f"{board.name} against the shipped flight", lines, exact=True))
            measured.append({"target": board.name, "title": board.title, **found.summary()})
    versions = {"casadi_gnc": metadata.version("casadi-gnc"), "casadi": metadata.version("casadi")}
    report = {
        "package": about.name,
        "title": about.title,
        "scheme": about.scheme,
        "real": about.real,
        "steps": len(inputs),
        "edited": changes if bench.is_named else [*changes, f"{MANIFEST} (names another problem, title or scheme)"],
        "warnings": bench.anew.warnings,
        "not_regenerated": bench.not_regenerated(),
        "made_by_this_version": about.made_by.model_dump() == versions,
        "comparisons": comparisons,
        "targets": measured,
        "not_installed": {one.name: one.missing() for one in _known_boards() if one.missing()},
        "words": sum(one["words"] for one in comparisons if one["exact"]),
    }
    return {**report, "is_sound": _is_sound(report)}


def _is_sound(report: dict[str, Any]) -> bool:
    """Tell whether a package is as it was made.

    No word differs, no step takes more than its bound, no file was edited, and the text is the one that this version
    writes, if it did.
    """
    strange = [change for change in report["edited"] if not change.endswith("(added)")]
    other = report["not_regenerated"] if report["made_by_this_version"] else []
    return not (report["words"] or strange or other or any(_is_exceeded(row) for row in report["targets"]))


def _is_exceeded(row: dict[str, Any]) -> bool:
    """Tell whether a step took more instructions than any can."""
    bound, climbed = row["instructions_bound"], row["instructions_climbed"] or 0
    return bound is not None and max(row["instructions_worst"], climbed) > bound


def refuse_strangers(names: list[str], folder: Path) -> None:
    """Raise `PackageError` for files that do not belong to a package and that a build would take up by itself."""
    taken = [name for name in names if is_taken_up(name)]
    if taken:
        more = f" and {len(taken) - 1} more" if len(taken) > 1 else ""
        raise PackageError(
            f"{folder} has the file {taken[0]!r}{more}, which is no part of such a package and which a compiler, make, "
            "CMake or Python may take up; move it away, then verify again"
        )


class _Bench:
    """A workshop with copies of what a package ships, and the package made anew beside them."""

    def __init__(self, folder: Path, about: Manifest, shop: Path, inputs: np.ndarray, outputs: np.ndarray) -> None:
        self._folder, self._about, self._shop, self._outputs = folder, about, shop, outputs
        self._shape = (*inputs.shape, outputs.shape[1])
        self._limit = PATIENCE + A_SAMPLE * len(inputs)
        put_words(shop, "inputs", inputs)
        put_words(shop, "outputs", outputs)
        kept = making.KEPT[about.problem.made_of]
        for path in (kept, *about.problem.code):
            self._copy(path, MADE_OF)
        for path, sha256 in about.problem.code.items():
            LOG.info("running the code of %s (sha256 %s), which the package keeps", folder / path, sha256[:12])
        found = self._apart("rebuild", {**about.model_dump(), "shape": self._shape}, "made again")
        try:
            self.anew = _Rebuilt.model_validate(found)
            self.layout = Layout(tuple(Signal(one.name, one.size, one.unit) for one in self.anew.outputs))
        except (ValidationError, ValueError):
            raise PackageError(f"{folder} cannot be made again: its code left no answer of ours") from None
        own = {*self.anew.files, kept, *(path for path in about.problem.code if path.endswith(".py")), "README.md"}
        refuse_strangers([path for path in about.files if path not in own], folder)
        for path in self.anew.files:
            if not path.startswith("test/") and (folder / path).exists():
                self._copy(path, SHIPPED)
        self._copy_text(self._shop / ANEW / "test" / "replay.h", self._shop / SHIPPED / "test" / "replay.h")

    @property
    def is_named(self) -> bool:
        """Whether the manifest says what the package was made of."""
        found = self.anew
        return found.is_named and (found.title, found.scheme) == (self._about.title, self._about.scheme)

    def _copy(self, path: str, where: str) -> None:
        self._copy_text(self._folder / path, self._shop / where / path)

    def _copy_text(self, source: Path, target: Path) -> None:
        try:
            found = content(source)
        except OSError as error:
            found, told = None, error.strerror or error
        else:
            told = "it is a link, no plain file, or too large"
        if found is None:
            raise PackageError(f"{source} cannot be read: {told}; generate the package again")
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(found)

    def _apart(self, function: str, given: dict[str, Any], what: str) -> Any:
        try:
            return apart.call(f"{rebuilding.__name__}:{function}", self._shop, given, limit=self._limit)
        except apart.ApartError as error:
            raise PackageError(f"{self._folder} cannot be {what}: its code, in a process of its own, {error}") from None

    def on_host(self) -> list[dict[str, Any]]:
        """Return the shipped C against the shipped words, by each compiler that is another one."""
        lines = []
        for compiler in compilers.different(compilers.available() or [compilers.find()]):
            given = {"name": self._about.name, "real": self._about.real, "shape": self._shape}
            given |= {"compiler": compiler.command, "version": compiler.version}
            self._apart("replay", given, f"run as {compiler.name} compiles it")
            differences = compare.differences(self._words("found"), self._outputs, self.layout)
            lines.append(_comparison(f"host, {compiler.version}, against the shipped flight", differences, exact=True))
        return lines

    def made_anew(self) -> list[dict[str, Any]]:
        """Return the package made anew against the shipped words, and against an independent or wider arithmetic."""
        made = self._about.problem.file or "what it was made of"
        lines = [self._compared(f"made again from {made}, against the shipped flight", "anew", self._outputs)]
        if self.anew.is_flown:
            lines.append(
                self._compared("flown again in closed loop, against the shipped flight", "flown_out", self._outputs)
            )
            inputs = self._words("inputs", self._shape[1])
            wrong = int((self._words("flown_in", self._shape[1]) != inputs).sum())
            lines[-1]["words"], lines[-1]["of"] = lines[-1]["words"] + wrong, lines[-1]["of"] + inputs.size
        if self._about.real == "float64":
            what = f"host with the C library's functions against {self.anew.machine}"
            differences = compare.differences(self._words("other"), self._words("expected"), self.layout)
            lines.append(_comparison(what, differences, exact=self.anew.is_exact))
        else:
            differences = compare.differences(self._outputs, self._words("expected"), self.layout)
            lines.append(_comparison("float32 against float64, from the same inputs", differences, exact=False))
        return lines

    def _compared(self, what: str, found: str, expected: np.ndarray) -> dict[str, Any]:
        return _comparison(what, compare.differences(self._words(found), expected, self.layout), exact=True)

    def _words(self, name: str, width: int | None = None) -> np.ndarray:
        shape = (self._shape[0], width or self._shape[2])
        return take_words(self._shop, name, shape, WORDS[self._about.real])

    def on_board(self) -> Path:
        """Return a folder to build for boards: the shipped C with the shipped words."""
        vectors = self._shop / SHIPPED / "test" / "vectors.c"
        if not vectors.exists():
            self._copy_text(self._shop / ANEW / "test" / "vectors.c", vectors)
        return self._shop / SHIPPED

    def not_regenerated(self) -> list[str]:
        """Return the files that this version would write otherwise."""
        found = []
        for path, sha256 in self.anew.files.items():
            shipped = content(self._folder / path) if (self._folder / path).exists() else None
            if shipped is None or digest(shipped.decode("utf-8", "replace")) != sha256:
                found.append(path)
        if self._about.coverage != self.anew.coverage:
            found.append(MANIFEST)
        return found


def _known_boards() -> list[known_boards.Target]:
    return [known_boards.find(name) for name in known_boards.names()]


def _comparison(what: str, lines: list[compare.Difference], *, exact: bool) -> dict[str, Any]:
    """Return one comparison as data; `exact` where no word may differ."""
    return {
        "what": what,
        "exact": exact,
        "words": compare.words_that_differ(lines),
        "of": sum(line.count for line in lines),
        "signals": compare.as_data(lines),
    }
