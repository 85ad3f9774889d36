"""Run kernels on an NVIDIA GPU through the driver's own library, which every installed driver brings."""

from __future__ import annotations

import ctypes
import sys
from functools import cache
from typing import Any

import numpy as np

from casadi_gnc.errors import GpuError

_OUT_OF_MEMORY, _NO_DEVICE = 2, 100
_INSTEAD = "take --engine c, or a machine that has one"
_MAJOR, _MINOR = 75, 76  # attributes of a device: its compute capability


class OutOfMemoryError(GpuError):
    """Report that the GPU's memory does not suffice."""


@cache
def driver() -> ctypes.CDLL:
    """Return the driver's library, initialised.

    Raises
    ------
    GpuError
        Where there is no driver or no GPU.
    """
    name = "nvcuda.dll" if sys.platform == "win32" else "libcuda.so.1"
    try:
        found = ctypes.CDLL(name)
    except OSError:
        raise GpuError(f"no NVIDIA driver is installed ({name} cannot be loaded); {_INSTEAD}") from None
    code = found.cuInit(0)
    if code == _NO_DEVICE:
        raise GpuError(f"the NVIDIA driver finds no GPU; {_INSTEAD}")
    if code:
        raise GpuError(f"the NVIDIA driver does not start ({_name(found, code)}); {_INSTEAD}")
    return found


def _name(library: ctypes.CDLL, code: int) -> str:
    text = ctypes.c_char_p()
    library.cuGetErrorName(code, ctypes.byref(text))
    return text.value.decode() if text.value else f"error {code}"


def _check(what: str, code: int) -> None:
    if code == _OUT_OF_MEMORY:
        raise OutOfMemoryError(f"the GPU has too little memory ({what})")
    if code:
        raise GpuError(f"the GPU refused ({what}): {_name(driver(), code)}")


class Device:
    """Hold the first GPU: its name, its architecture, and memory of it.

    Raises
    ------
    GpuError
        Where there is no driver or no GPU.
    """

    def __init__(self, number: int = 0) -> None:
        self._cuda = driver()
        handle, self._context = ctypes.c_int(), ctypes.c_void_p()
        _check("cuDeviceGet", self._cuda.cuDeviceGet(ctypes.byref(handle), number))
        text = ctypes.create_string_buffer(256)
        _check("cuDeviceGetName", self._cuda.cuDeviceGetName(text, len(text), handle))
        self.name, self._handle = text.value.decode(), handle
        self.architecture = f"sm_{self._attribute(_MAJOR)}{self._attribute(_MINOR)}"

    def _attribute(self, which: int) -> int:
        value = ctypes.c_int()
        _check("cuDeviceGetAttribute", self._cuda.cuDeviceGetAttribute(ctypes.byref(value), which, self._handle))
        return value.value

    def open(self) -> None:
        """Begin to use it in this thread."""
        if not self._context:
            _check(
                "cuDevicePrimaryCtxRetain",
                self._cuda.cuDevicePrimaryCtxRetain(ctypes.byref(self._context), self._handle),
            )
        _check("cuCtxSetCurrent", self._cuda.cuCtxSetCurrent(self._context))

    def close(self) -> None:
        """Give it back."""
        if self._context:
            self._context = ctypes.c_void_p()
            self._cuda.cuDevicePrimaryCtxRelease_v2(self._handle)

    def load(self, cubin: bytes) -> ctypes.c_void_p:
        """Return a module of compiled code."""
        module = ctypes.c_void_p()
        _check("cuModuleLoadData", self._cuda.cuModuleLoadData(ctypes.byref(module), cubin))
        return module

    def kernel(self, module: ctypes.c_void_p, name: str) -> ctypes.c_void_p:
        """Return a kernel of a module."""
        found = ctypes.c_void_p()
        _check(name, self._cuda.cuModuleGetFunction(ctypes.byref(found), module, name.encode()))
        return found

    def take(self, size: int) -> int:
        """Return the address of so many bytes of its memory; raise `OutOfMemoryError` where it has none left."""
        address = ctypes.c_uint64()
        _check(f"{size} bytes", self._cuda.cuMemAlloc_v2(ctypes.byref(address), ctypes.c_size_t(max(size, 8))))
        return address.value

    def give(self, address: int) -> None:
        """Free memory."""
        self._cuda.cuMemFree_v2(ctypes.c_uint64(address))

    def send(self, array: np.ndarray, address: int) -> None:
        """Copy an array, in order of its memory, to the GPU."""
        if array.nbytes:
            there, here = ctypes.c_uint64(address), ctypes.c_void_p(array.ctypes.data)
            _check("a copy", self._cuda.cuMemcpyHtoD_v2(there, here, ctypes.c_size_t(array.nbytes)))

    def fetch(self, array: np.ndarray, address: int) -> None:
        """Fill an array from the GPU."""
        if array.nbytes:
            there, here = ctypes.c_uint64(address), ctypes.c_void_p(array.ctypes.data)
            _check("a copy", self._cuda.cuMemcpyDtoH_v2(here, there, ctypes.c_size_t(array.nbytes)))

    def launch(self, kernel: ctypes.c_void_p, blocks: int, threads: int, *arguments: Any) -> None:
        """Run a kernel with arguments of ctypes, and wait until it has ended."""
        held = (ctypes.c_void_p * len(arguments))(*(ctypes.addressof(each) for each in arguments))
        sizes = (ctypes.c_uint(each) for each in (blocks, 1, 1, threads, 1, 1, 0))
        _check("a kernel", self._cuda.cuLaunchKernel(kernel, *sizes, None, held, None))
        _check("a kernel", self._cuda.cuCtxSynchronize())
