"""Fly many cases on an NVIDIA GPU, a thread each: the same printed text, compiled by NVRTC without fused operations.

Nothing of CUDA is imported: NVRTC is a library of the wheel of the extra `cuda`, the rest is the driver's.
"""

from __future__ import annotations

import ctypes
import time
from functools import cache

import numpy as np

from casadi_gnc.campaigns.program import BatchEngine, Flown, Program, Told
from casadi_gnc.errors import CampaignError
from casadi_gnc.system import assets, nvrtc
from casadi_gnc.system.cuda_driver import Device, OutOfMemoryError
from casadi_gnc.system.templates import template

#: Threads of a block; one block a multiprocessor gives each thread the most registers.
BLOCK = 256
#: Seconds that one launch is to take: long enough to cost nothing, short enough for Ctrl-C.
_LAUNCH = 0.2
#: The least number of cases that memory must hold before it is given up.
_LEAST = BLOCK
_OPTIONS = ("--std=c++17", "--fmad=false", "--device-as-default-execution-space", "-D_Bool=bool")
#: With the on-board solver the assembler takes minutes otherwise.
_OPTIONS_SOLVER = ("--Ofast-compile=mid",)


class _Columns(ctypes.Structure):
    _fields_ = [
        (name, ctypes.c_uint64)
        for name in ("p", "fresh", "seeds", "derived", "x", "m", "actuators", "good", "tally", "data", "work")
    ]
    _fields_ += [("flights", ctypes.c_longlong)]


def kernel_text(program: Program) -> str:
    """Return the device code of a program: the flight, the kernels, and the on-board solver where it has one."""
    units = [unit for unit in program.units if unit != "gnc_allocate_setup.c"]  # the data are set up already
    return template("flight_kernel.cu.j2").render(
        flight=program.source, online=bool(program.workspace), units=units, block=BLOCK
    )


@cache
def headers() -> dict[str, str]:
    """Return what the device code includes, by name."""
    codegen = assets.folder("codegen")
    found = [*(codegen / "runtime").glob("*.[hc]"), *(codegen / "kernel").glob("*.h")]
    return {path.name: path.read_text(encoding="utf-8") for path in sorted(found)}


def options(program: Program, architecture: str) -> tuple[str, ...]:
    """Return what NVRTC is told, for a GPU of an architecture such as "sm_90"."""
    sizes = tuple(flag for flag in program.flags if flag.startswith("-D"))
    solver = _OPTIONS_SOLVER if program.workspace else ()
    return (f"--gpu-architecture={architecture}", *_OPTIONS, *solver, *sizes)


@cache
def present() -> str:
    """Return the name of the GPU that would fly, with all that it needs.

    Raises
    ------
    GpuError
        Where there is no driver, no GPU or no NVRTC.
    """
    name = Device().name
    nvrtc.library()
    return name


class CudaBatch(BatchEngine):
    """Fly cases on the first GPU of this machine.

    Parameters
    ----------
    program : what flies.

    Raises
    ------
    GpuError, CampaignError
        Where there is no driver, no GPU or no NVRTC, or it refuses; for elementary functions of the C library, whose
        words are not those of a GPU.
    """

    name = "cuda"
    at_once = 2**17

    def __init__(self, program: Program) -> None:
        if "-fno-builtin" in program.flags:
            raise CampaignError(
                'engine "cuda" has no elementary functions of the C library; take maths="gnc", or --engine c'
            )
        self.program, self._device = program, Device()
        cubin = nvrtc.compiled(kernel_text(program), headers(), options(program, self._device.architecture))
        self._device.open()
        module = self._device.load(cubin)
        self._begin, self._go_on = (self._device.kernel(module, name) for name in ("gnc_begin", "gnc_go_on"))
        self._room, self._step = self.at_once, 100

    def fly(self, values: np.ndarray, seeds: np.ndarray, told: Told | None = None) -> Flown:
        """Fly cases to their end, as `BatchEngine.fly`: as many at once as memory holds."""
        self._device.open()
        flown, at = [], 0
        while at < len(seeds) or not flown:
            last = min(at + self._room, len(seeds))
            try:
                flown.append(self._run(values[at:last], seeds[at:last], told))
            except OutOfMemoryError:
                if last - at <= _LEAST:
                    raise
                self._room = max(_LEAST, (last - at) // 2)
                continue
            at = last
        return Flown(*(np.vstack([getattr(each, name) for each in flown]) for name in Flown.__dataclass_fields__))

    def close(self) -> None:
        """Give the GPU back."""
        self._device.close()

    def _run(self, values: np.ndarray, seeds: np.ndarray, told: Told | None) -> Flown:
        """Fly cases that go at once."""
        program, cases = self.program, len(seeds)
        widths = {"derived": program.derived, "work": program.workspace, **program.widths}
        sent = {
            "p": np.ascontiguousarray(values.T, dtype=float),
            "fresh": program.fresh,
            "seeds": np.ascontiguousarray(seeds, dtype=np.uint64),
            "data": program.data,
        }
        device, held = self._device, dict[str, int]()
        try:
            for name, array in sent.items():
                held[name] = device.take(array.nbytes)
                device.send(array, held[name])
            for name, width in widths.items():
                held[name] = device.take(8 * width * cases)
            columns = _Columns(**held, flights=cases)
            blocks = -(-cases // BLOCK)
            if cases:
                device.launch(self._begin, blocks, BLOCK, columns)
                self._samples(columns, blocks, cases, told)
            found = {name: np.empty((width, cases)) for name, width in program.widths.items()}
            for name, array in found.items():
                device.fetch(array, held[name])
        finally:
            for address in held.values():
                device.give(address)
        return Flown(**{name: np.ascontiguousarray(array.T) for name, array in found.items()})

    def _samples(self, columns: _Columns, blocks: int, cases: int, told: Told | None) -> None:
        """Fly all samples, a stretch of them at each launch."""
        first, done, samples = 0, 0, self.program.samples
        while first < samples:
            count, begun = min(self._step, samples - first), time.perf_counter()
            self._device.launch(self._go_on, blocks, BLOCK, columns, ctypes.c_longlong(first), ctypes.c_longlong(count))
            taken, first = time.perf_counter() - begun, first + count
            if count == self._step and taken < _LAUNCH / 2:
                self._step *= 2
            elif taken > 2 * _LAUNCH and self._step > 1:
                self._step //= 2
            now = cases * first // samples
            if told and now > done:
                told(now - done)
            done = now
