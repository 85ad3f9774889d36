"""Fly many cases of one text: compiled lanes on threads.

A case's words depend on its parameters and its seed alone: they are the same one at a time, side by side in vector
lanes, on one thread or on many, and the same as those of a single flight in scalar C.
"""

from __future__ import annotations

import ctypes
import os
import platform
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from casadi_gnc.allocation import OnlineInFlight, online
from casadi_gnc.embedded.printer import Math
from casadi_gnc.errors import CampaignError
from casadi_gnc.missions import metrics
from casadi_gnc.missions.engines import flight_source
from casadi_gnc.missions.parameters import Varied
from casadi_gnc.system import assets, compilers

#: Kinds of vector instructions: lanes of double precision, and what the compiler is told.
VECTORS: dict[str, tuple[int, tuple[str, ...]]] = {
    "none": (1, ()),
    "baseline": (2, ()),  # SSE2 of every x86-64, NEON of every 64-bit ARM
    "avx2": (4, ("-mavx2",)),
    "avx512": (8, ("-mavx512f", "-mavx512dq", "-mavx512vl", "-mprefer-vector-width=512")),
}
#: gcc's partial redundancy elimination moves loads so that some loops over lanes are no longer vectorised.
_LANES = ("-O3", "-fopenmp-simd", "-fno-math-errno", "-fno-trapping-math")
_SCALAR = ("-O2",)

#: Called with the number of flights flown since the last call.
Told = Callable[[int], None]


class _Batch(ctypes.Structure):
    _fields_ = [(name, ctypes.c_void_p) for name in ("p", "fresh", "seeds", "x", "m", "actuators", "good", "tally")]
    _fields_ += [(name, ctypes.c_long) for name in ("flights", "samples")]
    _fields_ += [(name, ctypes.c_void_p) for name in ("allocation_data", "allocation_work")]


@dataclass(frozen=True, eq=False)
class Flown:
    """Hold what many flights came to, a row each: the tally, and what they carried after the last sample."""

    tally: np.ndarray
    x: np.ndarray
    m: np.ndarray
    actuators: np.ndarray
    good: np.ndarray

    @property
    def words(self) -> np.ndarray:
        """All of it as words of 64 bits, (cases, columns)."""
        columns = (self.tally, self.x, self.m, self.actuators, self.good)
        return np.hstack([np.ascontiguousarray(column).view(np.uint64) for column in columns])


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


class CompiledBatch:
    """Fly cases in generated C: lanes side by side, runs of them on threads.

    Parameters
    ----------
    varied : the mission and what differs from case to case.
    maths : elementary functions: "gnc", the same words everywhere, or "libm".
    vectors : a key of `VECTORS`; the best of this machine by default. Where the allocation iterates, flights go one
        at a time whatever it says.
    threads : how many; all cores by default.

    Raises
    ------
    CampaignError
        For an allocation by a solver outside the C, which calls back into Python at every sample.
    """

    name = "c"

    def __init__(
        self,
        varied: Varied,
        maths: Math = "gnc",
        *,
        vectors: str | None = None,
        threads: int | None = None,
        compiler: compilers.Compiler | None = None,
    ) -> None:
        mission, scheme, tapes = varied.mission, varied.scheme, varied.tapes
        allocator = scheme.actuation.allocator
        iterates = isinstance(allocator, OnlineInFlight)
        if not tapes.symbolic and not iterates:
            raise CampaignError(
                f"scheme {scheme.name!r} allocates by {type(allocator).__name__}, which is called from Python at every "
                'sample; take allocation by "pinv", or by "robust" with the on-board solver'
            )
        self.vectors = "none" if iterates or maths == "libm" else vectors or best_vectors()
        self.lanes, flags = VECTORS[self.vectors]
        self.compiler = compiler or compilers.find()
        if self.lanes > 1:
            flags = (*_LANES, *(() if "clang" in self.compiler.version else ("-fno-tree-pre",)), *flags)
        else:
            flags = (*_SCALAR, "-fno-builtin") if maths == "libm" else _SCALAR
        units: tuple[str, ...] = ()
        if iterates:
            flags, units = (*online.FAST, *flags[1:], *online.flags(allocator.problem)), online.units()
        self.source = flight_source(mission, scheme, tapes, maths, self.lanes)
        include = assets.folder("codegen") / "runtime"
        self.flags = flags
        library = compilers.load(self.source, include=include, flags=flags, units=units, compiler=self.compiler)
        self._fly = library.gnc_fly_batch
        self._fly.restype, self._fly.argtypes = None, [ctypes.POINTER(_Batch)]
        self.threads = threads or os.cpu_count() or 1
        self._solvers = [allocator.solver(self.compiler) for _ in range(self.threads)] if iterates else []
        self.tapes = tuple(tapes.functions)
        self._samples = mission.timing.samples
        self._fresh = metrics.fresh(tuple(mission.metrics), tapes.tally, tapes.watches)
        plant = mission.truth
        self._widths = {
            "x": plant.state.size,
            "m": scheme.flown.memory.size,
            "actuators": plant.inputs.size,
            "good": plant.measurement.size,
            "tally": tapes.tally.size,
        }

    def fly(self, values: np.ndarray, seeds: np.ndarray, told: Told | None = None) -> Flown:
        """Fly cases to their end.

        Parameters
        ----------
        values : (cases, P), the parameters of each.
        seeds : (cases,), of the noise of each.
        told : called from the calling thread as runs of cases end.
        """
        cases = len(seeds)
        p = np.ascontiguousarray(values, dtype=float)
        seeds = np.ascontiguousarray(seeds, dtype=np.uint64)
        columns = {name: np.zeros((cases, width)) for name, width in self._widths.items()}
        run = max(self.lanes, -(-cases // (8 * self.threads * self.lanes)) * self.lanes)
        free = list(range(self.threads))

        def part(first: int) -> int:
            last, mine = min(first + run, cases), free.pop()
            try:
                memory = self._solvers[mine].memory if self._solvers else (None, None)
                rows = {name: column[first:last] for name, column in columns.items()}
                batch = _Batch(
                    p=p[first:last].ctypes.data,
                    fresh=self._fresh.ctypes.data,
                    seeds=seeds[first:last].ctypes.data,
                    flights=last - first,
                    samples=self._samples,
                    allocation_data=memory[0],
                    allocation_work=memory[1],
                    **{name: row.ctypes.data for name, row in rows.items()},
                )
                self._fly(ctypes.byref(batch))
            finally:
                free.append(mine)
            return last - first

        starts = range(0, cases, run)
        with ThreadPoolExecutor(self.threads) as pool:
            for flown in pool.map(part, starts):
                if told:
                    told(flown)
        return Flown(**columns)
