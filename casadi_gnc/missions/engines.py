"""Two engines that run the same tapes: compiled C, and CasADi's virtual machine.

Both advance the same `Carried` columns over a run of samples and write the same rows; with the C
library's elementary functions they write the same words.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Protocol

import numpy as np

from casadi_gnc.allocation import OnlineInFlight, online
from casadi_gnc.embedded.printer import Math, c_constant, print_function
from casadi_gnc.errors import FlightError
from casadi_gnc.mathematics.noise import uniform_count
from casadi_gnc.missions.metrics import unflagged
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.scheme import Scheme
from casadi_gnc.missions.tapes import Tapes, call
from casadi_gnc.registry import Registry
from casadi_gnc.status import StepStatus
from casadi_gnc.system import assets, compilers
from casadi_gnc.system.templates import template

#: Engines by name: shipped ones, and those of installed packages; each is made of (mission, scheme, tapes).
REGISTRY = Registry(
    "engine",
    "casadi_gnc.engines",
    {"c": f"{__name__}:CompiledEngine", "vm": "casadi_gnc.missions.machine_engine:VirtualMachineEngine"},
    is_one=lambda thing: isinstance(thing, type) and all(hasattr(thing, part) for part in ("name", "first", "run")),
    expected="a class with name, first and run, as casadi_gnc.missions.engines.Engine",
    error=FlightError,
)


@dataclass(eq=False)
class Carried:
    """Hold what goes from sample to sample; engines change the arrays in place."""

    x: np.ndarray
    m: np.ndarray
    actuators: np.ndarray
    good: np.ndarray
    tally: np.ndarray
    #: What follows from the parameters of the flight; nothing where it has none.
    derived: np.ndarray = field(default_factory=lambda: np.zeros(0))


class Engine(Protocol):
    """Run a mission's samples."""

    name: str

    def configure(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return what follows from these parameters alone, and the start."""
        ...

    def first(self, x: np.ndarray, derived: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the first measurement, and the law's memory at it."""
        ...

    def run(self, carried: Carried, first: int, samples: int, decimation: int, record: np.ndarray) -> int:
        """Fly `samples` samples from number `first`, filling rows of `record`; return the count flown."""
        ...


#: Ports that flights side by side have in common.
SHARED = ("t", "middle", "length", "weight")


class _Flight(ctypes.Structure):
    _fields_ = [(name, ctypes.c_void_p) for name in ("x", "m", "actuators", "good", "tally", "record")] + [
        (name, ctypes.c_long) for name in ("first", "samples", "decimation")
    ]
    _fields_ += [(name, ctypes.c_void_p) for name in ("allocator", "allocation_data", "allocation_work")]
    _fields_ += [("seeds", ctypes.c_void_p), ("derived", ctypes.c_void_p)]


_ALLOCATOR = ctypes.CFUNCTYPE(ctypes.c_int, *[ctypes.POINTER(ctypes.c_double)] * 7)


def build_options(scheme: Scheme, maths: Math, optimise: str = "-O2") -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the compiler's flags for flights of a scheme one at a time, and the C files that belong to them."""
    # Builtins would let the compiler replace the C library's functions by its own folding.
    own = ("-fno-builtin",) if maths == "libm" else ()
    allocator = scheme.actuation.allocator
    if isinstance(allocator, OnlineInFlight):
        return (*online.FAST, *own, *online.flags(allocator.problem)), online.units()
    return (optimise, *own), ()


def flight_facts(mission: Mission, scheme: Scheme) -> dict[str, Any]:
    """Return what the C of a flight is told of a mission and a scheme, whatever it does with them."""
    plant, timing = mission.truth, mission.timing
    return {
        "title": f"{mission.name}, scheme {scheme.name}",
        "mode": timing.mode,
        "substeps": timing.substeps,
        "period": c_constant(timing.sample_period),
        "states": plant.state.size,
        "measurements": plant.measurement.size,
        "memory": scheme.flown.memory.size,
        "efforts": scheme.actuation.effort.size,
        "actuators": plant.inputs.size,
        "noise": plant.noise.size,
        "noise_every": mission.noise.every,
        "uniforms": uniform_count(plant.noise.size),
    }


def flight_source(
    mission: Mission, scheme: Scheme, tapes: Tapes, maths: Math = "gnc", *, side_by_side: bool = False
) -> str:
    """Return the C of whole flights: every tape and the loop over them; side by side, LANES at once (-DLANES=4)."""
    fused = "stage" in tapes.functions
    configure = tapes.functions.get("configure")
    unused = ("before", "allocate") if fused else ("plant",)
    printed = {name: tape for name, tape in tapes.functions.items() if name not in unused}
    printed["tally_unflagged"] = unflagged(printed["tally"], tapes.row)

    def called(name: str, sample: str = "s->", **places: str) -> str:
        """Return the call of a tape; `sample` owns what one evaluation of the controller leaves behind."""
        return call(printed[name], _places(sample) | places)

    return template("flight.c.j2").render(
        **flight_facts(mission, scheme),
        side_by_side=side_by_side,
        maths=maths,
        real="double",
        report=scheme.actuation.allocator.report.size,
        row=tapes.row.size,
        tally=tapes.tally.size,
        batch=configure is not None,
        parameters=configure.numel_in("p") if configure is not None else 0,
        derived=configure.numel_out("derived") if configure is not None else 0,
        symbolic=tapes.symbolic,
        modulated="modulate" in tapes.functions,
        online=isinstance(scheme.actuation.allocator, OnlineInFlight),
        inexact=StepStatus.ALLOCATION_INEXACT.value,
        failed=StepStatus.ALLOCATION_FAILED.value,
        fused=fused,
        call=called,
        status=tapes.row.place("status").start,
        tapes={
            name: print_function(tape, maths=maths, shared=SHARED if side_by_side else None)
            for name, tape in printed.items()
        },
    )


def _places(sample: str) -> dict[str, str]:
    """Return where the columns of a sample lie in the C of a flight."""
    own = ("y", "accepted", "wanted", "limited", "lower", "upper", "flags", "report", "slope")
    return {
        **{name: f"{sample}{name}" for name in own},
        "memory": f"{sample}m",
        "told": f"{sample}actuators",
        "asked": f"{sample}asked",
        "t": "t",
        "middle": "&middle",
        "x": "x",
        "m": "m",
        "noise": "noise",
        "row": "row",
        "uniform": "uniform",
        "good": "flight->good",
        "actuators": "flight->actuators",
        "derived": "flight->derived",
        "p": "p",
    }


def _same(library: ctypes.CDLL) -> ctypes.CDLL:
    return library


class CompiledEngine:
    """Fly in generated C: a whole run of samples is one call."""

    name = "c"

    def __init__(
        self,
        mission: Mission,
        scheme: Scheme,
        tapes: Tapes,
        maths: Math = "gnc",
        *,
        compiler: compilers.Compiler | None = None,
        optimise: str = "-O2",
        pool: Executor | None = None,
    ) -> None:
        """Build; with a pool the compiler runs there, and what it refuses is raised by the first call."""
        self._report = scheme.actuation.allocator.report.size
        self.source = flight_source(mission, scheme, tapes, maths)
        self.compiler = compiler or compilers.find()
        allocator, self._online, self._solve = scheme.actuation.allocator, None, None
        if isinstance(allocator, OnlineInFlight):
            self._online = allocator.solver(self.compiler)
        elif not tapes.symbolic:
            self._solve = allocator.start()
        include, (flags, units) = assets.folder("codegen") / "runtime", build_options(scheme, maths, optimise)
        build = partial(compilers.load, self.source, include=include, flags=flags, units=units, compiler=self.compiler)
        self._library: Callable[[], ctypes.CDLL] = pool.submit(build).result if pool else partial(_same, build())
        self._memory = scheme.flown.memory.size
        self._configured = tapes.functions.get("configure")
        self._measurements = mission.truth.measurement.size
        self._seeds = np.array([mission.noise.seed], dtype=np.uint64)
        self._failure: BaseException | None = None
        self._sizes = (len(scheme.actuation.limit_below), mission.truth.inputs.size)
        self._callback = _ALLOCATOR(self._allocate)

    @property
    def library(self) -> ctypes.CDLL:
        """The library; waits for it where it is still being built."""
        return self._library()

    def reseed(self, seed: int) -> None:
        """Draw the noise of the next flight from another seed."""
        self._seeds = np.array([seed], dtype=np.uint64)

    def configure(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return what follows from these parameters, and the start."""
        assert self._configured is not None
        p = np.ascontiguousarray(values, dtype=float)
        derived, x = (np.zeros(self._configured.numel_out(name)) for name in ("derived", "x"))
        self.library.gnc_configure(*(ctypes.c_void_p(column.ctypes.data) for column in (p, derived, x)))
        return derived, x

    def first(self, x: np.ndarray, derived: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the first measurement, and the law's memory at it."""
        memory, measured = np.zeros(self._memory), np.zeros(self._measurements)
        at, m, good, follows = (ctypes.c_void_p(column.ctypes.data) for column in (x, memory, measured, derived))
        last = () if self._configured is None else (follows,)
        self.library.gnc_start(at, ctypes.c_void_p(self._seeds.ctypes.data), m, good, *last)
        return measured, memory

    def run(self, carried: Carried, first: int, samples: int, decimation: int, record: np.ndarray) -> int:
        """Fly in one call; an exception of the allocator (or Ctrl-C in it) is raised here."""
        columns = (carried.x, carried.m, carried.actuators, carried.good, carried.tally, record)
        allocator = None if self._solve is None else ctypes.cast(self._callback, ctypes.c_void_p)
        memory = self._online.memory if self._online is not None else (None, None)
        pointers = (column.ctypes.data for column in columns)
        seeds, derived = self._seeds.ctypes.data, carried.derived.ctypes.data
        flight = _Flight(*pointers, first, samples, decimation, allocator, *memory, seeds, derived)
        fly = self.library.gnc_fly
        fly.restype, fly.argtypes = ctypes.c_long, [ctypes.POINTER(_Flight)]
        flown = fly(ctypes.byref(flight))
        if self._failure is not None:
            failure, self._failure = self._failure, None
            raise failure
        return int(flown)

    def _allocate(self, *arguments: Any) -> int:
        limited, previous, lower, upper, actuators, status, report = arguments
        rows, count = self._sizes

        def view(pointer: Any, size: int) -> np.ndarray:
            return np.ctypeslib.as_array(pointer, (size,))

        assert self._solve is not None
        try:
            found = self._solve(view(limited, rows), view(previous, count), view(lower, count), view(upper, count))
            view(actuators, count)[:], status[0] = found[0], float(found[1])
            if self._report:
                view(report, self._report)[:] = found[2]
        except BaseException as error:  # nothing may propagate through C; `run` raises it again
            self._failure = error
            return 0
        return 1  # ctypes answers 0 for an exception that escapes, so 0 must mean stop
