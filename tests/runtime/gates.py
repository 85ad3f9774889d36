# SPDX-License-Identifier: MIT-0
"""Hold the hand-written C of `codegen/runtime` to what flight software is held to; one line a gate.

    python tests/runtime/gates.py            everything (about four minutes on two cores)
    python tests/runtime/gates.py misra ...  some gates by name

Needs gcc, g++, clang, clang++, clang-tidy and cppcheck.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
import time
from pathlib import Path

import branch_coverage
import compilers
import fuzzing
import misra
import power_of_ten
from c_sources import GateError

PROGRAMS = {
    "gcc": "gcc",
    "g++": "g++",
    "clang": "clang",
    "clang++": "clang",
    "clang-tidy": "clang-tidy",
    "cppcheck": "cppcheck",
    "gcov": "gcc",
}
#: Name to what runs it in a scratch folder.
GATES = {
    "warnings": compilers.warnings,
    "analyzer": compilers.analyzer,
    "clang-tidy": compilers.tidy,
    "misra": misra.gate,
    "power-of-ten": lambda folder: power_of_ten.gate(),
    "coverage": branch_coverage.gate,
    "chosen cases": fuzzing.chosen,
    "fuzz maths": lambda folder: fuzzing.maths(folder, whole=True),
    "fuzz allocator": lambda folder: fuzzing.allocator(folder, whole=True),
}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("gates", nargs="*", metavar="gate", help=f"one of: {', '.join(GATES)}; all by default")
    chosen = parser.parse_args().gates or list(GATES)
    if unknown := [name for name in chosen if name not in GATES]:
        parser.error(f"no gate {unknown[0]!r}; there are: {', '.join(GATES)}")
    if absent := sorted({package for program, package in PROGRAMS.items() if shutil.which(program) is None}):
        print(f"missing: {', '.join(absent)}; apt-get install -y --no-install-recommends {' '.join(absent)}")
        return 2
    failed = 0
    for name in chosen:
        start = time.monotonic()
        with tempfile.TemporaryDirectory() as folder:
            try:
                verdict, text = "ok", GATES[name](Path(folder))
            except GateError as error:
                verdict, text, failed = "FAILED", f"\n{error}", failed + 1
        print(f"{name:14} {verdict:6} {time.monotonic() - start:5.1f} s  {text}", flush=True)
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
