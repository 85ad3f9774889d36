"""Fly many cases of one text: compiled lanes on threads.

A case's words depend on its parameters and its seed alone: they are the same one at a time, side by side in vector
lanes, on one thread or on many, and the same as those of a single flight in scalar C.
"""

from __future__ import annotations

import ctypes
import os
import platform
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from pathlib import Path

import numpy as np

from casadi_gnc.campaigns.program import BatchEngine, Flown, Program, Told, program_of
from casadi_gnc.embedded.printer import Math
from casadi_gnc.errors import CompilerError
from casadi_gnc.missions.parameters import Varied
from casadi_gnc.system import assets, compilers

#: Kinds of vector instructions: lanes of double precision, and what the compiler is told.
VECTORS: dict[str, tuple[int, tuple[str, ...]]] = {
    "none": (1, ()),
    "baseline": (2, ()),  # SSE2 of every x86-64, NEON of every 64-bit ARM
    "avx2": (4, ("-mavx2",)),
    "avx512": (8, ("-mavx512f", "-mavx512dq", "-mavx512vl", "-mprefer-vector-width=512")),
}
_LANES = ("-O3", "-fopenmp-simd", "-fno-math-errno", "-fno-trapping-math")
#: gcc's partial redundancy elimination moves loads so that some loops over lanes are no longer vectorised.
_KEEP = "-fno-tree-pre"


class _Batch(ctypes.Structure):
    _fields_ = [(name, ctypes.c_void_p) for name in ("p", "fresh", "seeds", "x", "m", "actuators", "good", "tally")]
    _fields_ += [(name, ctypes.c_long) for name in ("flights", "samples")]
    _fields_ += [(name, ctypes.c_void_p) for name in ("allocation_data", "allocation_work")]


@lru_cache
def best_vectors() -> str:
    """Return the widest kind of vector instructions that this machine's processor has."""
    machine = platform.machine().lower()
    if machine in ("aarch64", "arm64"):
        return "baseline"
    if machine not in ("x86_64", "amd64"):
        return "none"
    try:
        told = Path("/proc/cpuinfo").read_text(encoding="ascii", errors="replace")
    except OSError:
        return "baseline"
    flags = set(next((line for line in told.splitlines() if line.startswith("flags")), "").split())
    if {"avx512f", "avx512dq", "avx512vl"} <= flags:
        return "avx512"
    return "avx2" if "avx2" in flags else "baseline"


class CompiledBatch(BatchEngine):
    """Fly cases in generated C: lanes side by side, runs of them on threads.

    Parameters
    ----------
    flown : a program; or the mission with what differs from case to case, and `maths`, of which it is made.
    vectors : a key of `VECTORS`; the best of this machine by default. Where the allocation iterates, flights go one
        at a time whatever it says.
    threads : how many; all cores by default.

    Raises
    ------
    CampaignError, CompilerError
        For an allocation by a solver outside the C; where there is no compiler.
    """

    name = "c"

    def __init__(
        self,
        flown: Program | Varied,
        maths: Math = "gnc",
        *,
        vectors: str | None = None,
        threads: int | None = None,
        compiler: compilers.Compiler | None = None,
    ) -> None:
        self.program = program = program_of(flown, maths) if isinstance(flown, Varied) else flown
        self.vectors = (vectors or best_vectors()) if program.lanes else "none"
        self.lanes, kind = VECTORS[self.vectors]
        self.compiler = compiler or compilers.find()
        self.source, self.flags, units = program.source, program.flags, program.units
        if self.lanes > 1:
            own = () if "clang" in self.compiler.version else (_KEEP,)
            self.source, self.flags, units = program.lanes, (*_LANES, *own, *kind, f"-DLANES={self.lanes}"), ()
        include = assets.folder("codegen") / "runtime"
        try:
            library = compilers.load(
                self.source, include=include, flags=self.flags, units=units, compiler=self.compiler
            )
        except CompilerError as error:
            if "internal compiler error" not in str(error) or _KEEP not in self.flags:
                raise
            # GCC 12 ends with an error of its own on some tapes for two lanes; without the option it does not.
            self.flags = tuple(flag for flag in self.flags if flag != _KEEP)
            library = compilers.load(
                self.source, include=include, flags=self.flags, units=units, compiler=self.compiler
            )
        self._fly = library.gnc_fly_batch
        self._fly.restype, self._fly.argtypes = None, [ctypes.POINTER(_Batch)]
        self.threads = threads or os.cpu_count() or 1

    def fly(self, values: np.ndarray, seeds: np.ndarray, told: Told | None = None) -> Flown:
        """Fly cases to their end, as `BatchEngine.fly`; several threads may call it at once."""
        program, cases = self.program, len(seeds)
        p = np.ascontiguousarray(values, dtype=float)
        seeds = np.ascontiguousarray(seeds, dtype=np.uint64)
        columns = {name: np.zeros((cases, width)) for name, width in program.widths.items()}
        run = max(self.lanes, -(-cases // (8 * self.threads * self.lanes)) * self.lanes)
        free = [np.zeros(program.workspace) for _ in range(self.threads)]

        def part(first: int) -> int:
            last, workspace = min(first + run, cases), free.pop()
            try:
                rows = {name: column[first:last] for name, column in columns.items()}
                batch = _Batch(
                    p=p[first:last].ctypes.data,
                    fresh=program.fresh.ctypes.data,
                    seeds=seeds[first:last].ctypes.data,
                    flights=last - first,
                    samples=program.samples,
                    allocation_data=program.data.ctypes.data,
                    allocation_work=workspace.ctypes.data,
                    **{name: row.ctypes.data for name, row in rows.items()},
                )
                self._fly(ctypes.byref(batch))
            finally:
                free.append(workspace)
            return last - first

        starts = range(0, cases, run)
        with ThreadPoolExecutor(self.threads) as pool:
            for flown in pool.map(part, starts):
                if told:
                    told(flown)
        return Flown(**columns)
