"""The contest of ways to run one controller step: from the measurement to the actuators and the memory.

All run the same expression, of a scheme whose allocation is an expression too, on inputs from a flight.
An answer is good where it is near that of CasADi's machine.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np

from casadi_gnc.benchmarks.contest import Accuracy, Family, Judgement, digest
from casadi_gnc.benchmarks.engines_of_a_step import Way, buffer_way, c_way, call_way, casadi_c_way, python_way
from casadi_gnc.benchmarks.machine import version
from casadi_gnc.errors import BenchmarkError, FlightError, offer
from casadi_gnc.problem_files.loading import load
from casadi_gnc.system import compilers

NAME = "step"
TITLE = "One controller step"
SETS = ("huang2020/detumble", "huang2020/slew")
RESIDUALS = (
    "share of outputs that are no finite numbers",
    "largest difference from CasADi's machine, over the largest value of its output in the flight",
)
LIMITATIONS = (
    "`empty_call` computes nothing: it is what a call of C from Python costs, and is part of `c` and `c_float`; "
    "`c_loop` and `c_float_loop` make a thousand steps in one call, so that nothing of it is left.",
    "A step in a loop finds caches and branch predictors warm; on board it may not.",
    "`numpy` and `python` are the step's tape as a Python program with numpy's numbers or Python's own, one assignment "
    "an operation; nobody would write it so, and numpy is not made for single numbers.",
    "Schemes that allocate by an iterative solver have no single expression and take no part here.",
)
#: Steps in one call of the loops.
TIMES = 1000
#: Largest difference that is good: double against double, and float against double.
_NEAR, _NEAR_FLOAT = 1e-9, 1e-3
_WAYS: dict[str, Callable[[ca.Function], Way]] = {
    "numpy": lambda function: python_way(function, "np"),
    "python": python_way,
    "casadi_call": call_way,
    "casadi_buffer": buffer_way,
    "casadi_c": casadi_c_way,
    "c_libm": lambda function: c_way(function, "double", "libm"),
    "c": lambda function: c_way(function, "double", "gnc"),
    "c_float": lambda function: c_way(function, "float", "gnc"),
    "c_loop": lambda function: c_way(function, "double", "gnc", TIMES),
    "c_libm_loop": lambda function: c_way(function, "double", "libm", TIMES),
    "c_float_loop": lambda function: c_way(function, "float", "gnc", TIMES),
    "empty_call": lambda function: c_way(function, "double", "gnc", entry="nothing"),
}
_NEED_NO_COMPILER = ("numpy", "python", "casadi_call", "casadi_buffer")


@dataclass(frozen=True, eq=False)
class Steps:
    """Hold a step and inputs to it.

    Parameters
    ----------
    problem, scheme : the mission and which of its schemes.
    function : serialized CasADi function.
    inputs : (K, columns of all inputs).
    outputs : (K, columns of all outputs), of CasADi's machine.
    """

    problem: str
    scheme: str
    function: str
    inputs: np.ndarray
    outputs: np.ndarray


def contestants(wanted: list[str] | None) -> list[str]:
    """Return the ways wanted, or all that run here; raise `BenchmarkError` for an unknown one."""
    if wanted is None:
        return [name for name in _WAYS if name in _NEED_NO_COMPILER or compilers.available()]
    unknown = [name for name in wanted if name not in _WAYS]
    if unknown or not wanted:
        raise BenchmarkError(
            f"no way {', '.join(unknown) or 'is named'} to run a step; {offer(', '.join(unknown), _WAYS)}"
        )
    return list(dict.fromkeys(wanted))


def absent() -> list[str]:
    """Return what cannot run here: without a compiler, all C."""
    return [] if compilers.available() else ["c, c_float, casadi_c, their loops, empty_call: need a C compiler"]


def families(problems: list[str], samples: int | None) -> list[Family]:
    """Return one family a mission: its first scheme whose allocation is an expression, or MISSION:SCHEME."""
    return [_family(problem, samples or 20) for problem in problems]


def _family(problem: str, count: int) -> Family:
    name, _, scheme = problem.partition(":")
    mission = load(name)
    if mission.timing.mode != "sampled":
        mission = mission.with_timing(mode="sampled")
    able = [one for one in mission.schemes if one.actuation.is_symbolic and scheme in ("", one.name)]
    if not able:
        raise BenchmarkError(f"{problem} has no such scheme whose allocation is an expression; take MISSION:SCHEME")
    chosen = able[-1]  # the last is the richest law of the shipped missions
    try:
        function = mission.step(chosen.name)
    except FlightError as error:
        raise BenchmarkError(f"{problem}: {error}") from None
    inputs = _flown(mission, chosen.name, count)
    outputs = np.array([call_way(function)(row) for row in inputs])
    title = f"{mission.title}, scheme {chosen.name}; {function.n_instructions()} instructions"
    data = Steps(name, chosen.name, function.serialize(), inputs, outputs)
    return Family(f"{mission.name}_{chosen.name}", "steps", title, count, data, digest(inputs, outputs))


def _flown(mission: object, scheme: str, count: int) -> np.ndarray:
    """Return inputs of the step from its own closed loop, every tenth sample."""
    from casadi_gnc.missions.mission import Mission

    assert isinstance(mission, Mission)
    loop, at, rows = mission.closed_loop(scheme), dict(mission.loop_start(scheme)), []
    measure = ca.DM.zeros(mission.truth.noise.size)
    for k in range(10 * count):
        t = k * mission.timing.sample_period
        if k % 10 == 0:
            y = ca.DM(mission.truth.measure(t, at["x"], measure))
            columns = (ca.DM(t), y, at["good"], at["m"], at["actuators"])
            rows.append(np.concatenate([np.array(column).ravel(order="F") for column in columns]))
        moved = loop(t=t, **at)
        at = {name: moved[f"{name}_next"] for name in at}
    return np.array(rows)


def appendix(families: list[Family]) -> str:
    """Return the instruction counts on targets, in Markdown."""
    from casadi_gnc.benchmarks.step_on_targets import table

    return table(families)


def able(contestant: str, family: Family) -> bool:
    """Return True: every way runs every step."""
    return True


def versions(contestant: str) -> dict[str, str]:
    """Return CasADi's version."""
    return {"casadi": version("casadi")}


def runner(contestant: str, family: Family, accuracy: Accuracy) -> StepRunner:
    """Return a way to run the family's step, compiled where it needs to be."""
    return StepRunner(contestant, family.data)


class StepRunner:
    """Run one step, or a thousand of them."""

    def __init__(self, way: str, steps: Steps) -> None:
        self._way, self._steps = way, steps
        self.calls = TIMES if way.endswith("_loop") else 1
        self._run = _WAYS[way](ca.Function.deserialize(steps.function))

    def run(self, k: int) -> np.ndarray:
        """Return the outputs of sample k."""
        return self._run(self._steps.inputs[k])

    def judge(self, k: int, said: np.ndarray) -> Judgement:
        """Return how far they are from those of CasADi's machine."""
        if self._way == "empty_call":
            return Judgement(True, True, 0.0, 0.0)
        expected, size = self._steps.outputs[k], np.abs(self._steps.outputs).max(axis=0)
        violation = float(np.mean(~np.isfinite(said)))
        apart = np.abs(said - expected) / np.where(size > 0, size, 1.0)
        gap = float(np.max(np.where(np.isfinite(apart), apart, np.inf)))
        near = _NEAR_FLOAT if "float" in self._way else _NEAR
        return Judgement(True, violation == 0.0 and gap <= near, violation, gap)
