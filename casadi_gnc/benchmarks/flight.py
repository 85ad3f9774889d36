"""The contest of engines on whole closed loops: the same mission flown by each; times are of one sample.

Engines are our C (with our elementary functions and with the C library's), CasADi's virtual machine
sample by sample, and, where the loop is one expression, CasADi's `mapaccum`. A flight is good where its
end is that of the others.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.benchmarks.contest import Accuracy, Family, Judgement, digest
from casadi_gnc.benchmarks.machine import version
from casadi_gnc.errors import BenchmarkError, NoCompilerError, offer
from casadi_gnc.missions import tapes
from casadi_gnc.missions.engines import Carried, CompiledEngine, Engine
from casadi_gnc.missions.flying import begin
from casadi_gnc.missions.machine_engine import VirtualMachineEngine
from casadi_gnc.missions.mission import Mission
from casadi_gnc.problem_files.loading import load
from casadi_gnc.system import compilers

NAME = "flight"
TITLE = "Whole closed loops, time a sample"
SETS = ("huang2020/detumble:observer_pinv", "huang2020/slew:funnel_pinv", "huang2020/detumble:observer_robust")
RESIDUALS = (
    "share of the final state that is no finite number",
    "largest difference of the final state from that of the virtual machine's flight, over its largest value in it",
)
LIMITATIONS = (
    "A flight is the first 200 s of its mission, every sample recorded by the engines; `mapaccum` records states only.",
    "Building and compiling are in the set-up, not in the time of a sample.",
    "Steps per second are a million over the time of a sample [us].",
    "`mapaccum` exists for schemes whose allocation is an expression, without noise.",
)
#: Seconds of a mission that are flown.
DURATION = 200.0
#: Flights are smooth enough that rounding stays far below this.
_NEAR = 1e-6
_ENGINES = ("c", "c_libm", "vm", "mapaccum")


@dataclass(frozen=True, eq=False)
class Loop:
    """Hold a mission to fly, named so that another process can load it, and where its flight ends."""

    problem: str
    scheme: str
    samples: int
    end: np.ndarray
    size: np.ndarray
    has_expression: bool


def contestants(wanted: list[str] | None) -> list[str]:
    """Return the engines wanted, or all that run here; raise `BenchmarkError` for an unknown one."""
    if wanted is None:
        return [name for name in _ENGINES if not name.startswith("c") or compilers.available()]
    unknown = [name for name in wanted if name not in _ENGINES]
    if unknown or not wanted:
        raise BenchmarkError(f"no engine {', '.join(unknown) or 'is named'}; {offer(', '.join(unknown), _ENGINES)}")
    return list(dict.fromkeys(wanted))


def absent() -> list[str]:
    """Return what cannot run here: without a compiler, the C."""
    return [] if compilers.available() else ["c, c_libm: need a C compiler"]


def families(problems: list[str], samples: int | None) -> list[Family]:
    """Return one family a mission, given as MISSION or MISSION:SCHEME."""
    return [_family(problem, samples) for problem in problems]


def _shortened(problem: str, samples: int) -> Mission:
    mission = load(problem)
    return mission.with_timing(duration=(samples - 1) * mission.timing.sample_period)


def _family(problem: str, samples: int | None) -> Family:
    name, _, wanted = problem.partition(":")
    mission = load(name)
    scheme = mission.scheme(wanted or None)
    whole = min(DURATION, mission.timing.duration)
    count = max(min(samples or 10**9, int(whole / mission.timing.sample_period) + 1), 2)
    mission = _shortened(name, count)
    built = tapes.tapes_of(mission, scheme)
    record = np.zeros((count, built.row.size))
    carried = _flown(VirtualMachineEngine(mission, scheme, built), mission, built, record)
    end = carried.x.copy()
    size = np.maximum(np.abs(end), np.abs(np.array(mission.start, dtype=float)))
    size = np.where(size > 0, np.maximum(size, 1e-3 * size.max()), 1.0)
    has_expression = built.symbolic and mission.timing.mode == "sampled" and not mission.truth.noise.size
    data = Loop(name, scheme.name, count, end, size, has_expression)
    title = f"{mission.title}, scheme {scheme.name}; {count} samples"
    return Family(
        f"{mission.name}_{scheme.name}", f"{mission.name}_{scheme.name}", title, 1, data, digest(end, [count])
    )


def _flown(engine: Engine, mission: Mission, built: tapes.Tapes, record: np.ndarray) -> Carried:
    carried = begin(mission, built, engine)
    engine.run(carried, 0, len(record), 1, record)
    return carried


def able(contestant: str, family: Family) -> bool:
    """Return whether an engine can fly a loop: `mapaccum` only one that is an expression."""
    return contestant != "mapaccum" or family.data.has_expression


def versions(contestant: str) -> dict[str, str]:
    """Return CasADi's version."""
    return {"casadi": version("casadi")}


def runner(contestant: str, family: Family, accuracy: Accuracy) -> FlightRunner:
    """Return an engine, built and compiled."""
    return FlightRunner(contestant, family.data)


class FlightRunner:
    """Fly from the start to the end, again and again."""

    def __init__(self, engine: str, loop: Loop) -> None:
        self._loop, self.calls = loop, loop.samples
        mission = _shortened(loop.problem, loop.samples)
        if engine == "mapaccum":
            self._run = _folded(mission, loop)
            return
        scheme = mission.scheme(loop.scheme)
        built = tapes.tapes_of(mission, scheme)
        made: Engine
        if engine == "vm":
            made = VirtualMachineEngine(mission, scheme, built)
        else:
            try:
                made = CompiledEngine(mission, scheme, built, "gnc" if engine == "c" else "libm")
            except NoCompilerError as error:
                raise BenchmarkError(str(error)) from None
        record = np.zeros((loop.samples, built.row.size))
        self._run = lambda: _flown(made, mission, built, record).x

    def run(self, k: int) -> np.ndarray:
        """Return the final state."""
        return self._run()

    def judge(self, k: int, said: np.ndarray) -> Judgement:
        """Return how far it is from where the virtual machine's flight ended."""
        violation = float(np.mean(~np.isfinite(said)))
        apart = np.abs(said - self._loop.end) / self._loop.size
        gap = float(np.max(np.where(np.isfinite(apart), apart, np.inf)))
        return Judgement(True, violation == 0.0 and gap <= _NEAR, violation, gap)


def _folded(mission: Mission, loop: Loop) -> Any:
    """Return the loop folded over all samples by CasADi."""
    step, start = mission.closed_loop(loop.scheme), mission.loop_start(loop.scheme)
    t, *at = step.sx_in()
    moved = step(t, *at)[: len(at)]
    order = ("x", "m", "actuators", "good")
    folded = ca.Function("loop", [ca.vertcat(*at), t], [ca.vertcat(*moved)]).mapaccum(loop.samples)
    first = ca.vertcat(*(start[name] for name in order))
    times = (np.arange(loop.samples) * mission.timing.sample_period)[None, :]
    states = mission.truth.state.size
    return lambda: np.array(folded(first, times))[:states, -1]
