"""Instructions of the online allocator on an emulated board, call by call, from the last answer and from none."""

import subprocess
from pathlib import Path

import numpy as np
import online_allocator as oa

from casadi_gnc.embedded import boards, targets
from casadi_gnc.system import assets

HERE = Path(__file__).resolve().parent


def counts(folder, size, problem, commands, *, board="cortex-m7", single=False):
    """Return (cold, warm), structured arrays with a row a command, and the bytes of code.

    `problem` is (A0, E, D, m1, m2, h); `commands` is (u, previous, lower, upper), rows of which are taken in turn.
    """
    N, R, P, V = size
    target, shapes = boards.find(board), ((R, N), (P, N), (V, R, P), (N,), (N,))
    parts = [
        np.broadcast_to(np.asarray(x, float), s).ravel() for x, s in zip(problem, shapes, strict=False) if 0 not in s
    ]
    np.concatenate([*parts, np.zeros(N), [problem[5]]]).tofile(folder / "problem.bin")
    count = len(commands[0])
    rows = [np.broadcast_to(np.asarray(x, float), (count, w)) for x, w in zip(commands, (R, N, N, N), strict=True)]
    np.hstack(rows).tofile(folder / "commands.bin")
    defines, runtime = oa.defines(N, R, P, V, single), assets.folder("codegen") / "runtime"
    include = [f"-I{runtime}", f"-I{assets.folder('codegen') / 'targets'}"]
    objects = []
    for unit in [
        *(runtime / name for name in oa.SOLVER_FILES),
        HERE / "allocator_counts.c",
        *map(target.place, target.sources),
    ]:
        own = unit.parent == runtime
        flags = (*targets.FLAGS, "-O2") if own else ("-std=gnu99", "-O2")
        objects.append(folder / f"{unit.stem}.o")
        command = [target.compiler, *target.flags, *flags, *defines, *include, "-c", str(unit), "-o", str(objects[-1])]
        subprocess.run(command, check=True, cwd=folder)
    link = [target.compiler, *target.flags, *target.link, f"-T{target.place(target.script)}", "-Wl,--gc-sections"]
    subprocess.run([*link, *map(str, objects), "-lm", "-o", "image.elf"], check=True, cwd=folder)
    quiet = ["-nographic", "-monitor", "none", "-serial", "none", "-semihosting-config", "enable=on,target=native"]
    command = [*target.emulator, *quiet, "-kernel", "image.elf"]
    subprocess.run(command, check=True, cwd=folder, stdin=subprocess.DEVNULL, timeout=600)
    row = np.dtype([("instructions", "u4"), ("active_set", "i4"), ("interior_point", "i4"), ("status", "i4"),
                    ("relative_gap", "f8"), ("force", "f8", (N,))])  # fmt: skip
    found = np.fromfile(folder / "counts.bin", row)
    size_tool = target.compiler.removesuffix("gcc") + "size"
    sizes = subprocess.run(
        [size_tool, *map(str, objects[: len(oa.SOLVER_FILES)])], check=True, capture_output=True, text=True
    )
    text = sum(int(line.split()[0]) for line in sizes.stdout.splitlines()[1:])
    return found[::2], found[1::2], text
