"""Run a contest: passes interleaved, so that drift of the machine hits all alike.

A pass goes through the families; in each, the contestants come in an order drawn anew; each solves all
samples once. Every cell is written as soon as it is measured; a run that is started again measures
what is missing and nothing else. A contestant that has spent its share of a family's time is given no
further passes there: many passes are for short times, which suffer most from the rest of the machine.
"""

from __future__ import annotations

import random
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

from casadi_gnc.benchmarks import machine
from casadi_gnc.benchmarks.contest import Family, contest
from casadi_gnc.benchmarks.field import Field
from casadi_gnc.benchmarks.measuring import Mode
from casadi_gnc.benchmarks.results import FILE, FORMAT, Results, Writer, read_results
from casadi_gnc.benchmarks.settings import Settings
from casadi_gnc.errors import BenchmarkError
from casadi_gnc.system.files import prepare_folder, write_beside

#: What a contest adds to the report.
APPENDIX = "appendix.md"
#: Settings that every cell of a results file must share.
_SAME = ("accuracy", "samples", "cold_every", "clock", "time_limit")
#: Called before each cell with cells done, cells in all, and what comes.
Progress = Callable[[int, int, str], None]


def run(
    name: str,
    problems: list[str],
    folder: Path,
    *,
    contestants: list[str] | None = None,
    settings: Settings | None = None,
    progress: Progress | None = None,
) -> Results:
    """Measure what is not in the folder's results yet, and return all of them.

    Parameters
    ----------
    name : of the contest.
    problems : sets, families or files; the contest's own sets if empty.
    folder : for the results; made if need be.
    contestants : all that can take part here by default.

    Raises
    ------
    BenchmarkError, OutputError
        For an unknown contestant, an empty set, a folder that cannot be written, or results in it
        that are of another version, of other settings or of other data.
    """
    settings = settings or Settings()
    game = contest(name)
    chosen = game.contestants(contestants)
    families = game.families(problems or list(game.SETS), settings.samples)
    pairs = {(who, f.name) for who in chosen for f in families if game.able(who, f)}
    if not pairs:
        raise BenchmarkError("no contestant can solve any of these families; name others with --backends")
    prepare_folder(folder)
    header = _header(game, chosen, families, settings)
    old = _resumed(folder, header)
    prepare_folder(folder / "logs")
    writer = Writer(folder / FILE, header)
    field = Field(name, settings, folder / "logs", old.cells if old else {})
    todo = list(_plan(chosen, families, pairs, settings))
    started = time.monotonic()
    try:
        for done, (who, family, mode, number) in enumerate(todo):
            if time.monotonic() - started > settings.run_limit:
                break
            if field.has(who, family.name, mode, number) or field.has_spent(who, family.name, number):
                continue
            if progress:
                progress(done, len(todo), f"{family.name}: {who}")
            cell = field.measure(who, family, mode, number, time.monotonic() - started)
            writer.add(cell)
    finally:
        writer.close()
        field.stop()
    if hasattr(game, "appendix") and not (folder / APPENDIX).exists():
        text = game.appendix(families)
        write_beside(folder / APPENDIX, lambda path: path.write_text(text, encoding="utf-8"))
    return read_results(folder)


def left_out(results: Results) -> int:
    """Return how many first passes a run never came to, because of its limit or because it was killed."""
    header, missing = results.header, 0
    for who, able in header["able"].items():
        missing += sum(not results.of(who, family, "warm") for family in able)
    return missing


def _plan(
    chosen: list[str], families: list[Family], pairs: set[tuple[str, str]], settings: Settings
) -> Iterator[tuple[str, Family, Mode, int]]:
    """Yield the cells in order; a seed gives the same order however often a run is resumed."""
    passes: dict[Mode, int] = {"warm": settings.passes, "cold": settings.cold_passes}
    for number in range(max(passes.values())):
        due: list[Mode] = [mode for mode, count in passes.items() if number < count]
        for mode in due:
            for family in families:
                order = [who for who in chosen if (who, family.name) in pairs]
                random.Random(f"{settings.seed} {number} {mode} {family.name}").shuffle(order)
                for who in order:
                    yield who, family, mode, number


def _header(game: Any, chosen: list[str], families: list[Family], settings: Settings) -> dict[str, Any]:
    return {
        "format": FORMAT,
        "contest": game.NAME,
        "title": game.TITLE,
        "casadi_gnc": machine.version("casadi-gnc"),
        "machine": machine.describe(),
        "settings": asdict(settings),
        "residuals": list(game.RESIDUALS),
        "limitations": list(game.LIMITATIONS),
        "families": {
            f.name: {"group": f.group, "title": f.title, "samples": f.count, "digest": f.digest} for f in families
        },
        "able": {who: [f.name for f in families if game.able(who, f)] for who in chosen},
        "versions": {who: game.versions(who) for who in chosen},
        "absent": game.absent(),
        "missed": getattr(game, "MISSED", ""),
        "objectives": {who: told for who in chosen if (told := _objective(game, who))},
    }


def _objective(game: Any, who: str) -> str:
    return game.objective_of(who) if hasattr(game, "objective_of") else ""


def _resumed(folder: Path, header: dict[str, Any]) -> Results | None:
    """Return the results that are there, if any; refuse those that new ones cannot stand beside."""
    path = folder / FILE
    if not path.exists() or not path.stat().st_size:
        return None
    old = read_results(folder)
    advice = "choose another --out, or move it away"
    if old.header["casadi_gnc"] != header["casadi_gnc"]:
        raise BenchmarkError(
            f"{path} was written by casadi-gnc {old.header['casadi_gnc']}, this is {header['casadi_gnc']}; {advice}"
        )
    if old.header["contest"] != header["contest"]:
        raise BenchmarkError(f"{path} has results of {old.header['contest']!r}, not of {header['contest']!r}; {advice}")
    for name in _SAME:
        before, now = old.header["settings"].get(name), header["settings"][name]
        if before != now:
            raise BenchmarkError(f"{path} was measured with {name} {before}, not {now}; {advice}")
    for who, families in header["able"].items():
        if old.header["able"].get(who) != families:
            raise BenchmarkError(f"{path} was begun with other families or without {who!r}; {advice}")
        if old.header["versions"].get(who) != header["versions"][who]:
            raise BenchmarkError(f"{path} has results of {who!r} in another version; {advice}")
    for name, family in header["families"].items():
        if old.header["families"].get(name, {}).get("digest") != family["digest"]:
            raise BenchmarkError(f"{path} has results of other data for the family {name!r}; {advice}")
    return old
