# SPDX-License-Identifier: MIT-0
"""Measure the largest error of every elementary function of `codegen/runtime` against mpmath.

    python tests/bench/math_accuracy.py                       a table of the largest errors found
    python tests/bench/math_accuracy.py --write docs/c_runtime.md   and put it into the page, between its marks

Two million arguments of every function in both precisions, half of them random bit patterns in the range that
the header states and half close to where such functions go wrong; about six minutes on two cores. It fails
where an error exceeds the bound in the header, or 1.5 ulp.
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "oracles"))

from math_functions import EXACT, FUNCTIONS, PRECISIONS, Library, build_plain
from math_truth import arguments, stated_bound, stated_range, worst_error

BEGIN, END = "<!-- accuracy: begin -->\n", "<!-- accuracy: end -->\n"
CHUNK = 20_000  # points of one draw


def measure(job: tuple[str, int, int, str]) -> tuple[str, int, int, float, tuple]:
    """Return function, place of the precision, points, largest error and where, over draws of their own seeds."""
    name, place, points, library = job
    p, functions = PRECISIONS[place], Library(Path(library))
    done, worst, where, seed = 0, -1.0, (), 1
    while done < points:
        columns = arguments(name, p, CHUNK // 4, seed)
        error, at = worst_error(name, p, columns, functions(name, p, *columns))
        if error > worst:
            worst, where = error, at
        done, seed = done + columns[0].size, seed + 1
    return name, place, done, worst, where


def table(rows: dict[tuple[str, int], tuple[int, float, tuple]]) -> str:
    lines = [
        "| function | range | double: max ulp | stated | range | float: max ulp | stated |",
        "|---|---|---|---|---|---|---|",
    ]
    for name in dict.fromkeys(name for name, _ in rows):
        cells = [f"`{name}`"]
        for place, p in enumerate(PRECISIONS):
            _, worst, _ = rows[name, place]
            cells += [stated_range(name, p).replace("|", "\\|"), f"{worst:.3f}", f"{stated_bound(name, p):.2f}"]
        lines.append(f"| {' | '.join(cells)} |")
    points = min(count for count, _, _ in rows.values())
    lines.append("")
    lines.append(f"At least {points:,} points of each function and precision, against mpmath with 140 bits.")
    return "\n".join(lines) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=2_000_000, help="of each function and precision")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--write", type=Path, help="page to put the table into")
    options = parser.parse_args()
    names = [name for name in FUNCTIONS if name not in EXACT]
    with tempfile.TemporaryDirectory() as folder:
        library = str(build_plain(Path(folder)))
        jobs = [(name, place, options.points, library) for name in names for place in range(len(PRECISIONS))]
        with multiprocessing.Pool(options.jobs) as pool:
            found = {(name, place): rest for name, place, *rest in pool.imap(measure, jobs)}
    text = table(found)
    print(text)
    failed = 0
    for (name, place), (_, worst, where) in found.items():
        p = PRECISIONS[place]
        if worst > min(1.5, stated_bound(name, p)):
            print(f"{name}{p.suffix}: {worst:.3f} ulp at {where}, more than stated", file=sys.stderr)
            failed = 1
    if options.write:
        page = options.write.read_text(encoding="utf-8")
        before, after = page[: page.index(BEGIN)], page[page.index(END) :]
        options.write.write_text(before + BEGIN + text + after, encoding="utf-8")
    return failed


if __name__ == "__main__":
    raise SystemExit(main())
