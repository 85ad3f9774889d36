"""Build a package on this machine and run it: the words that every target must repeat."""

from __future__ import annotations

import ctypes
from pathlib import Path

import numpy as np

from casadi_gnc.embedded.targets import units
from casadi_gnc.errors import CompilerError, PackageError
from casadi_gnc.system import assets, compilers

#: -fno-math-errno: the square root is one instruction; the words stay the same.
FLAGS = ("-std=c99", "-ffp-contract=off", "-fno-math-errno")


class HostPackage:
    """Run a package that was compiled for this machine.

    Parameters
    ----------
    folder : of the package.
    name : its prefix.
    compiler : `compilers.find()` by default.
    flags : of the optimiser, and more.

    Raises
    ------
    NoCompilerError, CompilerError
        Where there is no compiler, or it refuses the package.
    """

    def __init__(
        self,
        folder: Path,
        name: str,
        *,
        compiler: compilers.Compiler | None = None,
        flags: tuple[str, ...] = ("-O2",),
    ) -> None:
        self.compiler = compiler or compilers.find()
        binding = assets.folder("codegen") / "targets" / "binding.c"
        sources = [binding, *units(folder, name)]
        with compilers.workshop() as shop:
            library = shop / "package.so"
            include = [f"-I{folder}", f"-I{folder / 'test'}"]
            words = [*FLAGS, *flags, "-fPIC", "-shared", *include, "-o", str(library), *map(str, sources), "-lm"]
            compilers.compile_in(shop, self.compiler, words, "the package")
            self._c = compilers.open_library(library)  # stays loaded when the file goes
        self._c.binding_size.restype = ctypes.c_long
        self.state_size, self.params_size, word, *self._widths = (int(self._c.binding_size(i)) for i in range(5))
        self.word = np.dtype(np.uint64 if word == 8 else np.uint32)
        self._params = np.zeros(-(-self.params_size // 8))
        self._state = np.zeros(-(-self.state_size // 8))
        if self._c.binding_init(_pointer(self._params)):
            raise CompilerError("the package's init refused its own defaults")
        self.reset()

    def reset(self) -> None:
        """Forget everything, as before the first sample."""
        self._c.binding_reset(_pointer(self._state))

    def replay(self, inputs: np.ndarray, outputs: int) -> np.ndarray:
        """Run samples (K, inputs) of words from the present state; return (K, outputs) words.

        Raises
        ------
        PackageError
            For other widths than the package has.
        """
        if [*inputs.shape[1:], outputs] != self._widths:
            raise PackageError(
                f"{inputs.shape} words in and {outputs} out a sample were given, the package has {self._widths}"
            )
        given = np.ascontiguousarray(inputs, dtype=self.word)
        found = np.zeros((len(given), outputs), self.word)
        self._c.binding_replay(
            _pointer(self._state), _pointer(self._params), ctypes.c_long(len(given)), _pointer(given), _pointer(found)
        )
        return found

    def counts(self, symbol: str, size: int) -> list[int]:
        """Return so many counts of an array of `unsigned long long` in the package."""
        return list((ctypes.c_ulonglong * size).in_dll(self._c, symbol))


def _pointer(array: np.ndarray) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)
