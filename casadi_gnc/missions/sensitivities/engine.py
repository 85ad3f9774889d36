"""Fly with derivatives in compiled C: forward in directions side by side, and in reverse from what was kept."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

import casadi as ca
import numpy as np

from casadi_gnc.allocation import OnlineInFlight
from casadi_gnc.missions.engines import build_options
from casadi_gnc.missions.parameters import Varied
from casadi_gnc.missions.sensitivities.text import asked_tape, sensitivities_source
from casadi_gnc.system import assets, compilers

#: Samples whose states are kept at once for the way back; a longer flight is flown once more, part by part.
PART = 20_000
#: Directions side by side.
_LANES = 4
_FLAGS = ("-O2", "-ftree-vectorize", "-fopenmp-simd", "-fno-math-errno", "-fno-trapping-math", f"-DLANES={_LANES}")


class _Case(ctypes.Structure):
    _fields_ = [(name, ctypes.c_void_p) for name in ("derived", "seeds", "allocation_data", "allocation_work")]


@dataclass(frozen=True, eq=False)
class Flown:
    """Hold what is asked of every sample, (K, Q), the plant's state at the end, and where each part begins."""

    asked: np.ndarray
    last: np.ndarray
    begins: list[np.ndarray]
    #: Of the last part, what the way back needs.
    kept: np.ndarray


class DerivativeEngine:
    """Fly one point of a mission's parameters with derivatives.

    Parameters
    ----------
    varied : the mission and its parameters.
    quantities : row of a record -> what is asked of every sample, (Q,).

    Raises
    ------
    FlightError, CompilerError
        For an allocation or a quantity without derivatives; where there is no compiler.
    """

    def __init__(self, varied: Varied, quantities: ca.Function, compiler: compilers.Compiler | None = None) -> None:
        tape = asked_tape(varied, quantities)
        self.source = sensitivities_source(varied, tape)
        include, allocator = assets.folder("codegen") / "runtime", varied.scheme.actuation.allocator
        flags, units, self._data, self._workspace = _FLAGS, (), np.zeros(0), 0
        if isinstance(allocator, OnlineInFlight):
            (flags, units), found = build_options(varied.scheme, "gnc"), allocator.solver(compiler)
            self._data, self._workspace = found.contents
            flags = (*flags, *_FLAGS[1:])
        self._c = compilers.load(self.source, include=include, flags=flags, units=units, compiler=compiler)
        self._c.gnc_sizes.restype = ctypes.c_long
        self._carried, self._tangent, self._adjoint, self._kept = (int(self._c.gnc_sizes(i)) for i in range(4))
        self._samples, self._asked = varied.mission.timing.samples, tape.numel_out(0)
        self._states = varied.mission.truth.state.size
        self._parameters = varied.parameters.size
        self._derived = varied.tapes.configure.numel_out("derived")
        self._parts = [(a, min(PART, self._samples - a)) for a in range(0, self._samples, PART)]

    def values(self, p: np.ndarray, seed: int) -> Flown:
        """Fly, and return what is asked of every sample."""
        case = _Point(self, p, seed)
        asked, begins, kept = np.zeros((self._samples, self._asked)), [], np.zeros((0, self._kept))
        for first, count in self._parts:
            begins.append(case.state.copy())
            kept = self._fly(case, first, count, asked[first : first + count], keep=first + count == self._samples)
        return Flown(asked, case.carried[: self._states].copy(), begins, kept)

    def _fly(self, case: _Point, first: int, count: int, asked: np.ndarray, keep: bool) -> np.ndarray:
        kept = np.zeros((count, self._kept)) if keep else np.zeros((0, self._kept))
        self._c.gnc_values(
            ctypes.byref(case.c), at(case.carried), ctypes.c_long(first), ctypes.c_long(count), at(asked),
            at(kept) if keep else None,
        )  # fmt: skip
        return kept

    def tangents(self, p: np.ndarray, seed: int, weights: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Return derivatives of the weighed sum of what is asked, (D,).

        Parameters
        ----------
        weights : (K, Q).
        directions : (D, P), of the parameters.
        """
        case, count = _Point(self, p, seed), len(directions)
        blocks = -(-count // _LANES)
        seeds = np.zeros((blocks, self._parameters, _LANES))
        for i, direction in enumerate(directions):
            seeds[i // _LANES, :, i % _LANES] = direction
        tangents, gradient = np.zeros((blocks, self._tangent)), np.zeros((blocks, _LANES))
        for block in range(blocks):
            self._c.gnc_begin_tangents(at(case.p), at(case.seeds), at(seeds[block]), at(tangents[block]))
        self._c.gnc_tangents(
            ctypes.byref(case.c), at(case.carried), at(tangents), ctypes.c_long(blocks), ctypes.c_long(0),
            ctypes.c_long(self._samples), at(np.ascontiguousarray(weights)), at(gradient),
        )  # fmt: skip
        return gradient.ravel()[:count]

    def adjoint(self, p: np.ndarray, seed: int, weights: np.ndarray, flown: Flown) -> np.ndarray:
        """Return the gradient of the weighed sum of what is asked by the parameters, (P,)."""
        case, adjoint = _Point(self, p, seed), np.zeros(self._adjoint)
        weights = np.ascontiguousarray(weights)
        for (first, count), begin in zip(reversed(self._parts), reversed(flown.begins), strict=True):
            kept = flown.kept
            if first + count < self._samples:
                case.state[:] = begin
                kept = self._fly(case, first, count, np.zeros((count, self._asked)), keep=True)
            self._c.gnc_adjoint(
                ctypes.byref(case.c), at(kept), ctypes.c_long(first), ctypes.c_long(count), at(weights[first:]),
                at(adjoint),
            )  # fmt: skip
        gradient = np.zeros(max(1, self._parameters))
        self._c.gnc_begin_adjoint(at(case.p), at(case.seeds), at(adjoint), at(gradient))
        return gradient[: self._parameters]


class _Point:
    """A point of the parameters, and what is carried at its start."""

    def __init__(self, engine: DerivativeEngine, p: np.ndarray, seed: int) -> None:
        self.p = np.ascontiguousarray(p, dtype=float)
        self.seeds = np.array([seed], dtype=np.uint64)
        self.derived = np.zeros(max(1, engine._derived))
        #: What goes from sample to sample: what the C carries, and the workspace of the on-board solver.
        self.state = np.zeros(engine._carried + engine._workspace)
        self.carried, work = np.split(self.state, [engine._carried])
        engine._c.gnc_begin(at(self.p), at(self.seeds), at(self.derived), at(self.carried))
        self.c = _Case(self.derived.ctypes.data, self.seeds.ctypes.data, engine._data.ctypes.data, work.ctypes.data)


def at(array: np.ndarray) -> ctypes.c_void_p:
    """Return where an array lies."""
    return ctypes.c_void_p(array.ctypes.data)
