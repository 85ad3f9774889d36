"""The on-board allocator of `codegen/runtime`, compiled for a problem's sizes and called from Python.

The C owns no memory: constant data and workspace are byte buffers of this module. The same C files
fly, so what is measured and tested here is what flies.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

import numpy as np

from casadi_gnc.allocation.problem import AllocationProblem
from casadi_gnc.errors import AllocationError
from casadi_gnc.mathematics.arrays import real_array
from casadi_gnc.system import assets, compilers

#: Flags with which gcc vectorises it; the words stay the same.
FAST = ("-O3", "-fno-math-errno", "-fno-trapping-math")
#: For a handful of solves: compiling counts, not their time. The words are the same.
BRIEF = ("-O0",)
#: Largest sizes it is written for: actuators, rows of effort, rows of coupling, vertices.
LARGEST = (64, 6, 8, 64)


def sizes(problem: AllocationProblem) -> tuple[int, int, int, int]:
    """Return N, R, P, V of a problem; raise `AllocationError` where the C is not written for them."""
    rows, count = problem.effectiveness.shape
    found = (count, rows, len(problem.coupling), len(problem.errors))
    if any(size > largest for size, largest in zip(found, LARGEST, strict=True)):
        names = ("actuators", "rows of effort", "rows of coupling", "vertices")
        text = ", ".join(
            f"{size} {name} (at most {most})" for size, name, most in zip(found, names, LARGEST, strict=True)
        )
        raise AllocationError(f"too large for the on-board solver: {text}")
    # No coupling means no uncertainty, whatever number of vertices was given.
    return (count, rows, 0, 1) if not found[2] else found


def units() -> tuple[str, ...]:
    """Return the C files of the allocator, in `codegen/runtime`."""
    return tuple(sorted(path.name for path in (assets.folder("codegen") / "runtime").glob("gnc_allocate*.c")))


def flags(problem: AllocationProblem, prefix: str = "gnc_alloc") -> tuple[str, ...]:
    """Return the compiler's definitions of the sizes."""
    names = ("N", "R", "P", "V")
    return (
        *(f"-DGNC_ALLOC_{name}={size}" for name, size in zip(names, sizes(problem), strict=True)),
        f"-DGNC_ALLOC_PREFIX={prefix}",
    )


@dataclass(frozen=True, eq=False)
class Raw:
    """Hold one answer as the C returns it."""

    forces: np.ndarray
    weights: np.ndarray
    objective: float
    gap: float
    worst_vertex: int
    iterations: int
    path: int
    status: int


class OnlineSolver:
    """Run the on-board solver; each instance has its own memory.

    Parameters
    ----------
    problem : what stays the same.
    tolerance : relative duality gap at which an iteration ends; 0 means 1e-8.
    interior_point_only : use the base method alone.
    compiler : the one found first by default.
    optimise : the compiler's flags.

    Raises
    ------
    AllocationError, NoCompilerError
        For sizes or numbers that the C refuses; where there is no compiler.
    """

    def __init__(
        self,
        problem: AllocationProblem,
        *,
        tolerance: float = 0.0,
        interior_point_only: bool = False,
        compiler: compilers.Compiler | None = None,
        optimise: tuple[str, ...] = FAST,
    ) -> None:
        self._sizes, self._method = sizes(problem), int(interior_point_only)
        codegen = assets.folder("codegen")
        source = (codegen / "templates" / "allocator.c.j2").read_text(encoding="utf-8")
        c = compilers.load(
            source,
            include=codegen / "runtime",
            flags=(*optimise, *flags(problem)),
            units=units(),
            compiler=compiler,
        )
        for name in ("allocator_data_size", "allocator_workspace_size", "allocator_sequence"):
            getattr(c, name).restype = ctypes.c_long
        self._c = c
        self._data = _aligned(c.allocator_data_size())
        self._work = _aligned(c.allocator_workspace_size())
        self._tolerance = tolerance
        self._set_up(problem, tolerance)
        self.reset()

    def _set_up(self, problem: AllocationProblem, tolerance: float) -> None:
        arrays = [problem.effectiveness, problem.coupling, problem.errors]
        arrays += [problem.effort_weight, problem.change_weight, problem.preferred]
        columns = [np.ascontiguousarray(array, dtype=float) for array in arrays]
        numbers = (ctypes.c_double(problem.accuracy_weight), ctypes.c_double(tolerance))
        if self._c.allocator_setup(_pointer(self._data), *(_pointer(column) for column in columns), *numbers):
            raise AllocationError("the on-board solver refused the problem: weights, h or a number that is not finite")

    def update(self, problem: AllocationProblem) -> bool:
        """Take other data and keep the last answer as a start; False where the sizes differ."""
        if sizes(problem) != self._sizes:
            return False
        self._set_up(problem, self._tolerance)
        return True

    @property
    def memory(self) -> tuple[int, int]:
        """Addresses of the constant data and of the workspace; valid as long as this object lives."""
        return self._data.ctypes.data, self._work.ctypes.data

    @property
    def contents(self) -> tuple[np.ndarray, int]:
        """The constant data, as words, and the size of a workspace in words; several workspaces may share the data."""
        return self._data, len(self._work)

    def reset(self) -> None:
        """Forget the previous answer; the next solve is cold."""
        self._c.allocator_reset(_pointer(self._work))

    def solve(self, command: np.ndarray, previous: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> Raw:
        """Return the answer of the C to one sample."""
        count, _, _, vertices = self._sizes
        forces, weights, numbers = np.zeros(count), np.zeros(vertices), np.zeros(6)
        rows = self._sizes[1]
        inputs = [_shaped(command, (rows,)), *(_shaped(column, (count,)) for column in (previous, lower, upper))]
        self._c.allocator_solve(
            _pointer(self._work),
            _pointer(self._data),
            *(_pointer(column) for column in inputs),
            ctypes.c_int(self._method),
            _pointer(forces),
            _pointer(weights),
            _pointer(numbers),
        )
        integers = (int(number) for number in numbers[2:])
        return Raw(forces, weights, float(numbers[0]), float(numbers[1]), *integers)

    def sequence(
        self, commands: np.ndarray, lower: np.ndarray, upper: np.ndarray, *, cold: bool = False
    ) -> tuple[np.ndarray, np.ndarray]:
        """Allocate commands (K, R) in one C call, each from the forces before; return forces and numbers.

        The numbers (K, 6) are objective, gap, worst vertex, iterations, path (1 active set, 2 interior
        point) and status of each.
        """
        count, rows, _, _ = self._sizes
        inputs = [_shaped(commands, (len(commands), rows)), _shaped(lower, (count,)), _shaped(upper, (count,))]
        forces, numbers = np.zeros((len(commands), self._sizes[0])), np.zeros((len(commands), 6))
        self._c.allocator_sequence(
            _pointer(self._work),
            _pointer(self._data),
            ctypes.c_long(len(commands)),
            *(_pointer(column) for column in inputs),
            ctypes.c_int(self._method),
            ctypes.c_int(cold),
            _pointer(forces),
            _pointer(numbers),
        )
        return forces, numbers


def _shaped(array: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Return an array that C may read; raise `AllocationError` where it would read past the end."""
    column = np.ascontiguousarray(real_array("an array", array, AllocationError))
    if column.shape != shape:
        raise AllocationError(f"an array has shape {column.shape}, expected {shape}")
    return column


def _aligned(size: int) -> np.ndarray:
    """Return zeroed memory of at least `size` bytes, aligned for doubles."""
    return np.zeros(-(-size // 8))


def _pointer(array: np.ndarray) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)
