"""Fly on CasADi's virtual machine: the same tapes, no compiler needed."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.allocation import Allocate
from casadi_gnc.mathematics.integrators import WEIGHTS
from casadi_gnc.mathematics.noise import uniform_count, uniforms
from casadi_gnc.missions.engines import Carried
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.scheme import Scheme
from casadi_gnc.missions.tapes import Tapes


class _Tape:
    """Call a CasADi function on numpy columns by their names, without the cost of its general call."""

    def __init__(self, function: ca.Function) -> None:
        buffer: Any
        buffer, self._trigger = function.buffer()
        self._buffer = buffer  # the trigger points into it
        self._in = {name: np.zeros(function.numel_in(i)) for i, name in enumerate(function.name_in())}
        self._out = {name: np.zeros(function.numel_out(i)) for i, name in enumerate(function.name_out())}
        for i, column in enumerate(self._in.values()):
            if column.size:
                buffer.set_arg(i, memoryview(column.data))
        for i, column in enumerate(self._out.values()):
            if column.size:
                buffer.set_res(i, memoryview(column.data))

    def __call__(self, **columns: Any) -> dict[str, np.ndarray]:
        for name, own in self._in.items():
            own[:] = columns[name]
        self._trigger()
        return {name: column.copy() for name, column in self._out.items()}

    def one(self, **columns: Any) -> np.ndarray:
        """Return the only result."""
        (result,) = self(**columns).values()
        return result


class VirtualMachineEngine:
    """Fly on CasADi's virtual machine: no compiler needed, some hundred times slower.

    A sample is a dictionary of columns by the names that the tapes' ports have.
    """

    name = "vm"

    def __init__(self, mission: Mission, scheme: Scheme, tapes: Tapes) -> None:
        self._tape = {name: _Tape(function) for name, function in tapes.functions.items()}
        self._timing, self._noise = mission.timing, mission.noise
        self._states, self._normals = mission.truth.state.size, mission.truth.noise.size
        self._drawn = (-1, np.zeros(self._normals))
        self._report = np.zeros(scheme.actuation.allocator.report.size)
        self._solve: Allocate | None = None if tapes.symbolic else scheme.actuation.allocator.start()

    def configure(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return what follows from these parameters alone, and the start."""
        answer = self._tape["configure"](p=values)
        return answer["derived"], answer["x"]

    def first(self, x: np.ndarray, derived: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the first measurement, and the law's memory at it."""
        measured = self._tape["sense"].one(t=0.0, middle=0.0, x=x, noise=self._draw(0), derived=derived)
        return measured, self._tape["start"].one(y=measured, derived=derived)

    def _draw(self, sample: int) -> np.ndarray:
        """Return the normal numbers of a sample, held over `every` sample periods."""
        draw = sample // self._noise.every
        if self._normals and draw != self._drawn[0]:
            uniform = uniforms(self._noise.seed, draw, uniform_count(self._normals))
            self._drawn = (draw, self._tape["draw"].one(uniform=uniform))
        return self._drawn[1]

    def run(self, carried: Carried, first: int, samples: int, decimation: int, record: np.ndarray) -> int:
        """Fly sample by sample, as the loop of `flight.c.j2` does."""
        tape, kept = self._tape, 0
        for k in range(first, first + samples):
            t = k * self._timing.sample_period
            s: dict[str, Any] = {"t": t, "middle": t + self._timing.sample_period / 2, "x": carried.x, "m": carried.m}
            s = self._control(carried, {**s, "noise": self._draw(k)})
            s["flags"] = s["flags"] + s["allocation_flags"]
            carried.good[:] = s["accepted"]
            row = tape["observe"].one(**s)
            carried.tally[:] = tape["tally"].one(row=row, tally=carried.tally)
            if k % decimation == 0:
                record[kept] = row
                kept += 1
            self._advance(carried, s)
            carried.x[:] = tape["settle"].one(x=carried.x)
            carried.actuators[:] = s.get("asked", s["told"])
        return samples

    def _control(self, carried: Carried, s: dict[str, Any]) -> dict[str, Any]:
        """Return the columns of a sample completed by what the controller computes."""
        tape = self._tape
        s = {**s, "good": carried.good, "actuators": carried.actuators, "report": self._report, "allocation_flags": 0.0}
        s["derived"] = carried.derived
        if "stage" in tape:
            return {**s, **tape["stage"](**s)}
        s["y"] = tape["sense"].one(**s)
        s |= tape["before"](**s)
        if self._solve is None:
            s |= tape["allocate"](**s)
        else:
            told, noted, report = self._solve(s["limited"], carried.actuators.copy(), s["lower"], s["upper"])
            s |= {"told": told, "report": report, "allocation_flags": float(noted)}
        if "modulate" in tape:
            s["asked"] = s["told"]
            s["told"], s["memory"] = tape["modulate"](**s).values()
        return s

    def _slope(self, s: dict[str, Any]) -> np.ndarray:
        """Return the rates of plant and memory at a point of the integrator."""
        return s["slope"] if "slope" in s else self._tape["flow"].one(**s)

    def _advance(self, carried: Carried, s: dict[str, Any]) -> None:
        tape, h, n, t = self._tape, self._timing.sample_period, self._states, s["t"]
        if self._timing.mode == "sampled":
            carried.m[:] = tape["after"].one(**s)
            step = h / self._timing.substeps
            for i in range(self._timing.substeps):
                carried.x[:] = tape["plant"].one(**{**s, "t": t + i * step, "x": carried.x})
            return
        state = np.concatenate([carried.x, s["memory"]])
        slope = total = self._slope(s)
        for length, weight in zip((h / 2, h / 2, h), WEIGHTS[1:], strict=True):
            moved = tape["point"].one(state=state, slope=slope, length=length)
            at = {"t": t + length, "x": moved[:n], "m": moved[n:], "derived": carried.derived}
            at |= {name: s[name] for name in ("middle", "noise")}
            slope = self._slope(self._control(carried, at))
            total = tape["weigh"].one(total=total, slope=slope, weight=weight)
        joined = tape["join"].one(state=state, total=total)
        carried.x[:], carried.m[:] = joined[:n], joined[n:]
