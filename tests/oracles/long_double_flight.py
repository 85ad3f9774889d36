"""Whole flights in long double, of which differences are true to many digits: the C of a flight with other types.

The text is that of a flight with the C library's functions; <tgmath.h> picks those of long double. Constants stay what
they are, so that the flight is the same function in a finer arithmetic. On x86 and ARM64; not with the on-board solver,
which is written for double.
"""

import ctypes
import re

import numpy as np

from casadi_gnc.missions.engines import flight_source
from casadi_gnc.missions.parameters import Varied
from casadi_gnc.system import assets, compilers

#: Whether long double is finer than double here.
FINER = np.finfo(np.longdouble).eps < 1e-3 * np.finfo(float).eps


class _Flight(ctypes.Structure):
    _fields_ = [(name, ctypes.c_void_p) for name in ("x", "m", "actuators", "good", "tally", "record")]
    _fields_ += [(name, ctypes.c_long) for name in ("first", "samples", "decimation")]
    _fields_ += [(name, ctypes.c_void_p) for name in ("allocator", "data", "work", "seeds", "derived")]


def text_of(varied: Varied) -> str:
    """Return the C of flights in long double."""
    text = flight_source(varied.mission, varied.scheme, varied.tapes, "libm")
    text = text.replace("#include <math.h>", "#include <tgmath.h>").replace('#include "gnc_arithmetic.h"\n', "")
    text = text.replace("typedef double gnc_real", "typedef long double gnc_real")
    drawn = r"    double uniform\[(.*?)\];\n(.*?), uniform\);"
    copied = (
        r"    double drawn[\1];\n    gnc_real uniform[\1];\n    int u;\n\2, drawn);\n"
        r"    for (u = 0; u < \1; u++) uniform[u] = drawn[u];"
    )
    return re.sub(drawn, copied, text, flags=re.DOTALL)


class LongDoubleFlights:
    """Fly points of a mission's parameters, and return the record of every sample."""

    def __init__(self, varied: Varied) -> None:
        include = assets.folder("codegen") / "runtime"
        self._c = compilers.load(text_of(varied), include=include, flags=("-O1",))
        self._varied, self._tapes = varied, varied.tapes

    def record(self, p: np.ndarray, seed: int) -> np.ndarray:
        """Return the rows, (K, columns), in long double."""
        mission, tapes = self._varied.mission, self._tapes
        sizes = {
            "x": mission.truth.state.size,
            "m": self._varied.scheme.flown.memory.size,
            "actuators": mission.truth.inputs.size,
            "good": mission.truth.measurement.size,
            "tally": tapes.tally.size,
            "derived": tapes.configure.numel_out("derived"),
        }
        columns = {name: np.zeros(max(1, size), np.longdouble) for name, size in sizes.items()}
        samples = mission.timing.samples
        record, seeds = np.zeros((samples, tapes.row.size), np.longdouble), np.array([seed], np.uint64)
        p = np.ascontiguousarray(p, np.longdouble)
        at = {name: ctypes.c_void_p(column.ctypes.data) for name, column in columns.items()}
        self._c.gnc_configure(ctypes.c_void_p(p.ctypes.data), at["derived"], at["x"])
        start = (at["x"], ctypes.c_void_p(seeds.ctypes.data), at["m"], at["good"], at["derived"])
        self._c.gnc_start(*start)
        carried = [columns[name].ctypes.data for name in ("x", "m", "actuators", "good", "tally")]
        flight = _Flight(
            *carried,
            record.ctypes.data,
            0,
            samples,
            1,
            None,
            None,
            None,
            seeds.ctypes.data,
            columns["derived"].ctypes.data,
        )
        self._c.gnc_fly(ctypes.byref(flight))
        return record
