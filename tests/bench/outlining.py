"""What it would bring to print elementary functions once, not in every place: bytes of code and speed of flights.

In vector lanes of this machine each function becomes one that takes four numbers (gcc's attribute `simd`); in the
code that NVRTC makes for an H100 one that is called (`__noinline__`), where NVRTC is installed. Words must be equal.

python tests/bench/outlining.py [MISSION ...]

Needs gcc and `size`. Processor time of one thread, the least of seven runs, the two kinds in turn; bytes on the GPU
are those of the kernel that flies. Nothing is timed on a GPU.
"""

from __future__ import annotations

import argparse
import dataclasses
import re
import subprocess
import tempfile
import time
from importlib.util import find_spec
from pathlib import Path

import numpy as np

import casadi_gnc
from casadi_gnc.campaigns import cuda
from casadi_gnc.campaigns.engines import CompiledBatch
from casadi_gnc.campaigns.program import Program, program_of
from casadi_gnc.missions.parameters import vary
from casadi_gnc.system import assets, nvrtc

MISSIONS = (
    "huang2020/detumble",
    "shi2020/docking",
    "sun2018/circular_orbit",
    "tao2019/case1",
    "satellites/slew_and_track",
    "satellites/earth_pointing",
    "satellites/earth_pointing_day",
)
ONE = "sin|cos|tan|asin|acos|atan|exp|expm1|log|log1p|sinh|cosh|tanh|erf"
TWO = "atan2|pow|fmod|remainder"
RUNTIME = assets.folder("codegen") / "runtime"
FLIGHTS, SAMPLES = 64, 150


def lanes_apart(program: Program) -> Program:
    """Return a program whose lanes call elementary functions."""
    header = (RUNTIME / "gnc_math.h").read_text(encoding="utf-8")
    kind = 'static __attribute__((noinline, unused, simd("notinbranch")))'
    header = re.sub(rf"GNC_INLINE (double gnc_(?:{ONE}|{TWO})\()", rf"{kind} \1", header)
    return dataclasses.replace(program, lanes=program.lanes.replace('#include "gnc_math.h"', header))


def lanes_size(batch: CompiledBatch) -> int:
    """Return the bytes of instructions that gcc makes of lanes."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "lanes.c"
        place.write_text(batch.source)
        flags = ["-std=c99", "-ffp-contract=off", "-fPIC", *batch.flags, f"-I{RUNTIME}"]
        subprocess.run(["gcc", *flags, "-c", place.name], check=True, cwd=folder)
        told = subprocess.run(["size", "-A", "lanes.o"], check=True, cwd=folder, capture_output=True, text=True).stdout
    return sum(int(line.split()[1]) for line in told.splitlines() if line.startswith(".text"))


def kernel_size(program: Program, apart: bool) -> int:
    """Return the bytes of instructions that NVRTC makes of the kernel that flies."""
    text = cuda.kernel_text(program)
    if apart:
        declared = [f"static __noinline__ double gnc_{name}(double);\n" for name in ONE.split("|")]
        declared += [f"static __noinline__ double gnc_{name}(double, double);\n" for name in TWO.split("|")]
        text = "".join(declared) + text
    cubin = nvrtc.translated(text, cuda.headers(), cuda.options(program, "sm_90"))[0]
    word = lambda at, size: int.from_bytes(cubin[at : at + size], "little")  # noqa: E731
    heads = [word(40, 8) + i * word(58, 2) for i in range(word(60, 2))]
    names = word(heads[word(62, 2)] + 24, 8)
    named = [(cubin[names + word(head, 4) :].split(b"\0", 1)[0], word(head + 32, 8)) for head in heads]
    return sum(size for name, size in named if name.startswith(b".text.") and name != b".text.gnc_begin")


def measure(name: str) -> None:
    """Print a line of one mission."""
    mission = casadi_gnc.load(name)
    mission = mission.with_timing(duration=SAMPLES * mission.timing.sample_period)
    varied = vary(mission, ["truth.inertia_factor" if name.startswith("satellites/") else "initial.*"])
    program, nominal = program_of(varied), varied.parameters.nominal
    kinds = [CompiledBatch(each, vectors="avx2", threads=1) for each in (program, lanes_apart(program))]
    turns = np.sin(np.arange(FLIGHTS * nominal.size)).reshape(FLIGHTS, -1)
    given = nominal * (1 + 0.01 * turns), np.arange(FLIGHTS, dtype=np.uint64) + 5
    words = [batch.fly(*given).words for batch in kinds]
    taken = [np.inf, np.inf]
    for _ in range(7):
        for i, batch in enumerate(kinds):
            begun = time.process_time()
            batch.fly(*given)
            taken[i] = min(taken[i], time.process_time() - begun)
    sizes = [lanes_size(batch) / 1000 for batch in kinds]
    line = f"{name}: {int((words[0] != words[1]).sum())} words differ; AVX2 {sizes[0]:.0f} -> {sizes[1]:.0f} kB, "
    line += f"{taken[0] / taken[1]:.2f} times as fast"
    if find_spec("nvidia") is not None:
        there = [kernel_size(program, apart) / 1000 for apart in (False, True)]
        line += f"; H100 {there[0]:.0f} -> {there[1]:.0f} kB"
    print(line, flush=True)


def main() -> None:
    """Print a line for each mission."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("mission", nargs="*", default=MISSIONS)
    for name in parser.parse_args().mission:
        measure(name)


if __name__ == "__main__":
    main()
