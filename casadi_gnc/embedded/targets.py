"""Build a package for a board of `casadi_gnc.embedded.boards`, run it in its emulator, read what it wrote.

The emulator advances its clock with each instruction, so counts are exact and the same on every host.
"""

from __future__ import annotations

import os
import re
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.embedded import stack
from casadi_gnc.embedded.boards import Target
from casadi_gnc.embedded.worst_case import Counter
from casadi_gnc.errors import TargetError
from casadi_gnc.system import assets, folders
from casadi_gnc.system.folders import workshop

#: Flags of every target; the same as on the host, with sections that the linker may drop.
FLAGS = ("-std=c99", "-ffp-contract=off", "-fno-math-errno", "-ffunction-sections", "-fdata-sections")
#: The program's own files may use what registers and start-up need.
_BOARD_FLAGS = ("-std=gnu99", "-O2", "-ffunction-sections")
#: Seconds after which an emulator is stopped.
PATIENCE = 600.0
#: Symbols of arithmetic on doubles in software, and functions of the C library on doubles.
_DOUBLE = re.compile(
    r"^(__aeabi_(d|[a-z0-9]+2d|cd)\w*|__\w*df\w*|__\w*(extendsfdf2|truncdfsf2)|"
    r"(sin|cos|tan|exp|log|pow|sqrt|fabs|floor|ceil|tanh|atan2?|asin|acos|expm1|log1p|fmod|remainder))$"
)
#: Numbers at the head of what a program writes, in the order of `enum number` in measure.c.
_NUMBERS = 9


@dataclass(frozen=True, eq=False)
class Measured:
    """Hold what a run on a target gave.

    Parameters
    ----------
    outputs : (K, outputs) words.
    instructions : (K,), of each step, the call's own cost taken off.
    init_instructions : of init.
    step_stack, init_stack : bytes, by paint.
    step_bound : the deepest stack of a step that any input can ask for, from the compiler's call graph.
    most_instructions : that any input can ask for, from the compiled text; or why there is no such bound.
    climbed : the most instructions that a search over measurements found, and of how many steps; none without a search.
    state_size, params_size : bytes.
    text, data, bss : bytes of the package's own object files.
    compiler : version line.
    """

    outputs: np.ndarray
    instructions: np.ndarray
    init_instructions: int
    step_stack: int
    init_stack: int
    step_bound: stack.Stack
    most_instructions: int | str
    climbed: tuple[int, int] | None
    state_size: int
    params_size: int
    text: int
    data: int
    bss: int
    compiler: str

    def summary(self) -> dict[str, Any]:
        """Return the numbers as plain data."""
        return {
            "steps": len(self.instructions),
            "instructions_median": int(np.median(self.instructions)),
            "instructions_worst": int(self.instructions.max()),
            "instructions_first": int(self.instructions[0]),
            "instructions_init": self.init_instructions,
            "instructions_bound": self.most_instructions if isinstance(self.most_instructions, int) else None,
            "instructions_bound_missing": "" if isinstance(self.most_instructions, int) else self.most_instructions,
            "instructions_climbed": self.climbed[0] if self.climbed else None,
            "instructions_climbed_steps": self.climbed[1] if self.climbed else 0,
            "stack_step_bytes": self.step_stack,
            "stack_init_bytes": self.init_stack,
            "stack_step_bound_bytes": self.step_bound.bytes,
            "stack_deepest_calls": list(self.step_bound.way),
            "stack_not_counted": list(self.step_bound.unknown),
            "state_bytes": self.state_size,
            "params_bytes": self.params_size,
            "text_bytes": self.text,
            "data_bytes": self.data,
            "bss_bytes": self.bss,
            "compiler": self.compiler,
        }


def measure(
    folder: Path,
    name: str,
    target: Target,
    *,
    optimise: str = "-O2",
    float_only: bool = False,
    prove: bool = False,
    climb: bool = False,
) -> Measured:
    """Build a package for a target and replay its vectors there.

    Parameters
    ----------
    folder, name : of the package and its prefix.
    target : what for.
    optimise : flag of the optimiser.
    float_only : refuse objects that compute with doubles.
    prove : bound the instructions of a step too; for an allocator that takes some seconds.
    climb : search for the dearest step too, over changed measurements.

    Raises
    ------
    TargetError
        Where a tool is missing, the compiler refuses, a symbol of double arithmetic is found in a
        package of floats, or the program does not end well.
    """
    target.need()
    with workshop() as shop:
        objects = [
            _compile(source, shop, folder, target, (*FLAGS, optimise, "-fcallgraph-info=su"))
            for source in units(folder, name)
        ]
        if float_only:
            _refuse_doubles(objects, target)
        board = assets.folder("codegen") / "targets"
        common = [folder / "test" / "vectors.c", *map(target.place, target.sources)]
        objects_of_board = [_compile(source, shop, folder, target, _BOARD_FLAGS) for source in common]

        def written(program: str, file: str) -> bytes:
            main = _compile(board / f"{program}.c", shop, folder, target, _BOARD_FLAGS)
            image = _link([*objects, *objects_of_board, main], shop / f"{program}.elf", target, shop)
            return _emulate(image, target, shop, file)

        words = written("measure", "words.bin")
        climbed = _integers(written("climb", "climb.bin"))[1:] if climb else None
        most: int | str = "it was not asked for"
        if prove:
            most = _most_instructions(shop / "measure.elf", ("replay_step", f"{name}_step"), target, shop)
        text, data, bss = _size(objects, target)
        bound = stack.deepest([path.with_suffix(".ci") for path in objects], f"{name}_step")
    compiler = _run([target.compiler, "--version"], target).splitlines()[0]
    return _read(words, text, data, bss, bound, compiler, most, (climbed[0], climbed[1]) if climbed else None)


def _link(objects: list[Path], image: Path, target: Target, shop: Path) -> Path:
    link = [target.compiler, *target.flags, *target.link, f"-T{target.place(target.script)}", "-Wl,--gc-sections"]
    _run([*link, *map(str, objects), "-lm", "-o", str(image)], target, shop)
    return image


def _most_instructions(image: Path, entries: tuple[str, ...], target: Target, shop: Path) -> int | str:
    """Return the instructions that no input of the first function there is exceeds, or why that is not known."""
    if "-mthumb" not in target.flags:
        return "only the instructions of Cortex-M are read"
    text = _run([_tool(target, "objdump"), "-d", "--no-show-raw-insn", str(image)], target, shop)
    _run([_tool(target, "objcopy"), "-O", "binary", "-j", ".text", str(image), str(shop / "image.bin")], target, shop)
    try:
        counter = Counter(text, (shop / "image.bin").read_bytes())
        return counter.worst(next((entry for entry in entries if counter.has(entry)), entries[-1]), 4)
    except TargetError as error:
        return str(error)


def units(folder: Path, name: str) -> list[Path]:
    """Return the C files of a package that fly."""
    monitor = folder / f"{name}_monitor.c"
    return [
        folder / f"{name}.c",
        *sorted(folder.glob(f"{name}_allocate*.c")),
        *([monitor] if monitor.is_file() else []),
    ]


def doubles_in(objects: list[Path], target: Target) -> list[str]:
    """Return the symbols of double arithmetic that object files ask for."""
    found = []
    for line in _run([_tool(target, "nm"), "-u", *map(str, objects)], target).splitlines():
        symbol = line.split()[-1] if line.split() else ""
        if _DOUBLE.match(symbol):
            found.append(symbol)
    return found


def _refuse_doubles(objects: list[Path], target: Target) -> None:
    found = doubles_in(objects, target)
    if found:
        raise TargetError(
            f"a package of floats calls double arithmetic on {target.name}: {', '.join(sorted(set(found)))}"
        )


def _tool(target: Target, tool: str) -> str:
    return f"{target.compiler.removesuffix('gcc')}{tool}"


def _compile(source: Path, shop: Path, folder: Path, target: Target, flags: tuple[str, ...]) -> Path:
    product = shop / f"{source.stem}.o"
    include = [f"-I{path}" for path in (folder, folder / "test", assets.folder("codegen") / "targets")]
    _run([target.compiler, *target.flags, *flags, *include, "-c", str(source), "-o", str(product)], target, shop)
    return product


def _run(command: list[str], target: Target, shop: Path | None = None) -> str:
    """Return what a tool said; its own temporary files go to `shop`, and its complaints are in English."""
    environment = {**os.environ, "LC_ALL": "C", **({"TMPDIR": str(shop)} if shop else {})}
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, errors="replace", timeout=PATIENCE, env=environment
        )
    except (OSError, subprocess.SubprocessError) as error:
        raise TargetError(f"target {target.name}: {command[0]} could not be run: {error}") from error
    if done.returncode and shop and (full := folders.out_of_room(done.stderr, shop.parent)):
        raise TargetError(f"target {target.name}: {full}")
    if done.returncode:
        lines = [line for line in done.stderr.splitlines() if not line.startswith("collect2:")]
        said = [line for word in ("error", "cannot", "undefined", "overflow") for line in lines if word in line]
        complaint = said[0] if said else done.stderr[:200]
        raise TargetError(f"target {target.name}: {command[0]} refused: {complaint.strip()}")
    return done.stdout


def _emulate(image: Path, target: Target, shop: Path, file: str) -> bytes:
    """Run an image in the emulator; return what it wrote to a file."""
    quiet = ["-nographic", "-monitor", "none", "-serial", "none"]
    if not target.has_line:
        quiet += ["-semihosting-config", "enable=on,target=native"]
    command = [*(part.replace("{file}", file) for part in target.emulator), *quiet, "-kernel", str(image)]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=PATIENCE, cwd=shop, stdin=subprocess.DEVNULL
        )
    except (OSError, subprocess.SubprocessError) as error:
        raise TargetError(f"target {target.name}: the emulator could not be run: {error}") from error
    told, code = b"", done.returncode
    if not code:
        told = (shop / file).read_bytes()
    if not code and target.has_line:
        told, code = told[:-1], told[-1] if told else 3
    if code:
        meaning = {3: "could not write its results", 4: "stopped with a fault", 5: "had its init refuse"}
        raise TargetError(
            f"target {target.name}: the program {meaning.get(code, f'ended with {code}')}"
            f"{': ' + done.stderr.strip().splitlines()[0] if done.stderr.strip() else ''}"
        )
    return told


def _size(objects: list[Path], target: Target) -> tuple[int, int, int]:
    rows = _run([_tool(target, "size"), *map(str, objects)], target).splitlines()[1:]
    columns = [[int(number) for number in row.split()[:3]] for row in rows]
    return tuple(sum(column) for column in zip(*columns, strict=True))  # type: ignore[return-value]


def _read(
    raw: bytes,
    text: int,
    data: int,
    bss: int,
    bound: stack.Stack,
    compiler: str,
    most: int | str,
    climbed: tuple[int, int] | None,
) -> Measured:
    _, steps, outputs, empty, init, init_stack, step_stack, state, params = _integers(raw[: 8 * _NUMBERS])
    counts = np.array(_integers(raw[: 8 * (_NUMBERS + steps)])[_NUMBERS:])
    rest = raw[8 * (_NUMBERS + steps) :]
    wide = len(rest) == 8 * steps * outputs
    written = np.frombuffer(rest, f"{_order(raw)}u{8 if wide else 4}")
    words = written.astype(np.uint64 if wide else np.uint32).reshape(steps, outputs)
    dearest = (climbed[0] - empty, climbed[1]) if climbed else None
    return Measured(
        words, counts - empty, init - empty, step_stack, init_stack,
        bound, most, dearest, state, params, text, data, bss, compiler,
    )  # fmt: skip


def _order(raw: bytes) -> str:
    """Return the order of octets of the board that wrote a file: the first number in it is 1."""
    return "<" if raw[:1] == b"\x01" else ">"


def _integers(raw: bytes) -> list[int]:
    return np.frombuffer(raw, f"{_order(raw)}u8").astype(int).tolist()
