"""Fly with derivatives in compiled C: forward in directions side by side, and in reverse from what was kept."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
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
#: Directions side by side, at most: four cost what one does in a build for four, one less in a build for one.
_LANES = 4
_FLAGS = ("-O2", "-ftree-vectorize", "-fopenmp-simd", "-fno-math-errno", "-fno-trapping-math")
#: Numbers that derivatives of all samples may take before they are summed up part by part.
_ROOM = 8_000_000


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


@dataclass(frozen=True, eq=False)
class Along:
    """Hold what is asked of every sample, (K, Q), the plant's state at the end, and derivatives of what is asked.

    Parameters
    ----------
    asked : (K, Q). last : of the plant's state.
    slopes : (K, D, Q), by direction.
    """

    asked: np.ndarray
    last: np.ndarray
    slopes: np.ndarray

    def gradient(self, weights: np.ndarray) -> np.ndarray:
        """Return derivatives of the sum of what is asked by weights, (K, Q) -> (D,)."""
        return np.einsum("kq,kdq->d", weights, self.slopes)


class DerivativeEngine:
    """Fly one point of a mission's parameters with derivatives.

    Parameters
    ----------
    varied : the mission and its parameters.
    quantities : row of a record -> what is asked of every sample, (Q,).
    lanes : directions side by side; by default as many as parameters, but 1, 2 or 4.

    Raises
    ------
    FlightError, CompilerError
        For an allocation or a quantity without derivatives; where there is no compiler.
    """

    def __init__(
        self, varied: Varied, quantities: ca.Function, compiler: compilers.Compiler | None = None, lanes: int = 0
    ) -> None:
        self._lanes = lanes or min(2 ** max(varied.parameters.size - 1, 0).bit_length(), _LANES)
        tape = asked_tape(varied, quantities)
        self.source = sensitivities_source(varied, tape)
        include, allocator = assets.folder("codegen") / "runtime", varied.scheme.actuation.allocator
        own = (*_FLAGS, f"-DLANES={self._lanes}")
        flags, units, self._data, self._workspace = own, (), np.zeros(0), 0
        if isinstance(allocator, OnlineInFlight):
            (flags, units), found = build_options(varied.scheme, "gnc"), allocator.solver(compiler)
            self._data, self._workspace = found.contents
            flags = (*flags, *own[1:])
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
        part = max(1, _ROOM // max(1, self._asked * len(directions)))
        gradient = np.zeros(len(directions))
        for first, found in self._along(p, seed, directions, part):
            gradient += found.gradient(weights[first : first + len(found.asked)])
        return gradient

    def along(self, p: np.ndarray, seed: int, directions: np.ndarray) -> Along | None:
        """Fly once, derivatives of all that is asked along with it; None where they would take too much memory.

        Parameters
        ----------
        directions : (D, P), of the parameters.
        """
        if self._samples * self._asked * len(directions) > _ROOM:
            return None
        ((_, found),) = self._along(p, seed, directions, self._samples)
        return found

    def _along(self, p: np.ndarray, seed: int, directions: np.ndarray, part: int) -> Iterator[tuple[int, Along]]:
        """Yield the first sample of each part, and what was found in it."""
        case, count = _Point(self, p, seed), len(directions)
        blocks = -(-count // self._lanes)
        seeds = np.zeros((blocks, self._parameters, self._lanes))
        for i, direction in enumerate(directions):
            seeds[i // self._lanes, :, i % self._lanes] = direction
        tangents = np.zeros((blocks, self._tangent))
        for block in range(blocks):
            self._c.gnc_begin_tangents(at(case.p), at(case.seeds), at(seeds[block]), at(tangents[block]))
        for first in range(0, self._samples, part):
            samples = min(part, self._samples - first)
            asked = np.zeros((samples, self._asked))
            slopes = np.zeros((samples, blocks, self._asked, self._lanes))
            self._c.gnc_tangents(
                ctypes.byref(case.c), at(case.carried), at(tangents), ctypes.c_long(blocks), ctypes.c_long(first),
                ctypes.c_long(samples), at(asked), at(slopes),
            )  # fmt: skip
            by_direction = slopes.transpose(0, 1, 3, 2).reshape(samples, blocks * self._lanes, self._asked)[:, :count]
            yield first, Along(asked, case.carried[: self._states].copy(), by_direction)

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
