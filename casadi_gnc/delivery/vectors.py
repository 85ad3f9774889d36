"""The vectors that a package is shipped with: a flight in closed loop with its mission's plant, flown or read.

The plant runs in double precision with the elementary functions of `codegen/runtime`, so the vectors
have the same words wherever they are made.
"""

from __future__ import annotations

import ctypes
import re
from pathlib import Path

import numpy as np

from casadi_gnc.embedded.compare import as_numbers, as_words
from casadi_gnc.embedded.host import HostPackage
from casadi_gnc.embedded.manifest import MOST_STEPS, content
from casadi_gnc.embedded.printer import print_function
from casadi_gnc.errors import PackageError
from casadi_gnc.mathematics.noise import uniform_count, uniforms
from casadi_gnc.missions import tapes
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.scheme import Scheme
from casadi_gnc.system import assets, compilers

#: The bits of a number, by the type of all numbers of a package.
WORDS = {"float64": np.dtype(np.uint64), "float32": np.dtype(np.uint32)}
#: What bad sensors say, in turn: the controller must raise a status and stay finite.
BAD = (np.nan, np.inf, -np.inf, 1e300, -1e300, 5e-324, -0.0)


class CompiledPlant:
    """Measure and move a mission's plant in compiled C."""

    def __init__(self, mission: Mission, scheme: Scheme) -> None:
        built = tapes.tapes_of(mission, scheme)
        names = [name for name in ("sense", "draw", "plant", "settle") if name in built.functions]
        text = ['#include "gnc_math.h"', "typedef double gnc_real;"]
        for name in names:
            ports = [*built.functions[name].name_in(), *built.functions[name].name_out()]
            text.append(print_function(built.functions[name]))
            given = ", ".join(f"gnc_real *{port}" for port in ports)
            text.append(f"void call_{name}({given}); void call_{name}({given}) {{ {name}({', '.join(ports)}); }}")
        self._c = compilers.load("\n".join(text), include=assets.folder("codegen") / "runtime")
        self._mission, self._sizes = mission, {name: built.functions[name].numel_out(0) for name in names}
        self.x = np.array(mission.start, dtype=float)

    def _call(self, name: str, *columns: np.ndarray) -> np.ndarray:
        result = np.zeros(max(self._sizes[name], 1))
        given = [np.ascontiguousarray(column, dtype=float) for column in columns]
        getattr(self._c, f"call_{name}")(*(ctypes.c_void_p(column.ctypes.data) for column in (*given, result)))
        return result[: self._sizes[name]]

    def noise(self, sample: int) -> np.ndarray:
        """Return the standard normal numbers of a sample."""
        count, drawn = self._mission.truth.noise.size, self._mission.noise
        if not count:
            return np.zeros(1)
        return self._call("draw", uniforms(drawn.seed, sample // drawn.every, uniform_count(count)))

    def measure(self, sample: int) -> np.ndarray:
        """Return the time and what the sensors say."""
        t = np.array([sample * self._mission.timing.sample_period])
        return np.concatenate([t, self._call("sense", t, self.x, self.noise(sample))])

    def advance(self, sample: int, actuators: np.ndarray) -> None:
        """Move over one sample period under held actuators."""
        timing, noise = self._mission.timing, self.noise(sample)
        for i in range(timing.substeps):
            at = np.array([sample * timing.sample_period + i * (timing.sample_period / timing.substeps)])
            self.x = self._call("plant", at, self.x, actuators, noise)
        self.x = self._call("settle", self.x)


def fly_package(
    mission: Mission, scheme: Scheme, package: HostPackage, outputs: int, steps: int, spoiled: int = 0
) -> tuple[np.ndarray, np.ndarray]:
    """Return words in (steps, 1 + measured) and out (steps, outputs) of a closed loop from the mission's start.

    Parameters
    ----------
    mission : in sampled mode.
    package : reset; it is stepped.
    outputs : words of an output, the actuators first, the status last.
    spoiled : of the last steps, each has one measured number replaced by a bad one.
    """
    plant, count = CompiledPlant(mission, scheme), mission.truth.inputs.size
    rows_in, rows_out = [], []
    for k in range(steps):
        row = plant.measure(k)
        if k >= steps - spoiled:
            row = _spoil(row, k - (steps - spoiled))
        rows_in.append(as_words(row, package.word))
        rows_out.append(package.replay(rows_in[-1][None, :], outputs)[0])
        plant.advance(k, as_numbers(rows_out[-1][:count]).astype(float))
    return np.array(rows_in), np.array(rows_out)


def _spoil(row: np.ndarray, number: int) -> np.ndarray:
    """Return the row with a bad number; every third stays good, so that recovery is seen too."""
    row = row.copy()
    if number % 3 != 2:
        row[1 + (number * 5) % (len(row) - 1)] = BAD[number % len(BAD)]
    return row


def read_vectors(folder: Path, real: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the words in and out of a package's vectors, one row a sample; raise `PackageError` if they are none."""
    path, word = folder / "test" / "vectors.c", WORDS[real]
    try:
        text = (content(path) or b"").decode()
    except (OSError, UnicodeDecodeError) as error:
        raise PackageError(f"{path} cannot be read: {getattr(error, 'strerror', '') or error}") from None
    entry = rf"0x([0-9a-f]{{1,{2 * word.itemsize}}})u(?:ll)?"
    tables = []
    for table in re.findall(r"\] = \{\n(.*?)\n\};", text, re.DOTALL):
        rows = [re.findall(entry, row) for row in table.splitlines()]
        if len(rows) > MOST_STEPS or len({len(row) for row in rows}) != 1 or not rows[0]:
            break
        tables.append(np.array([[int(number, 16) for number in row] for row in rows], dtype=word))
    if len(tables) != 2 or len(tables[0]) != len(tables[1]):
        raise PackageError(f"{path} does not hold the vectors of a flight; generate the package again")
    return tables[0], tables[1]
