"""Print the on-board allocator alone, for the problem of an allocation file: header, source, and what replays it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from casadi_gnc.allocation.allocator import LARGEST
from casadi_gnc.allocation.online import OnlineSolver
from casadi_gnc.allocation.problem import AllocationProblem
from casadi_gnc.embedded import package
from casadi_gnc.embedded.controller import Options
from casadi_gnc.embedded.dictionary import STATUS, Dictionary, Entry, bits, calls
from casadi_gnc.embedded.manifest import digest
from casadi_gnc.embedded.members import elements
from casadi_gnc.embedded.source import allocation_sizes, allocator_units, problem_tables
from casadi_gnc.signals import Layout, Signal
from casadi_gnc.system import assets
from casadi_gnc.system.templates import template

#: What the status of a step can say.
STATUSES = {
    1: ("INEXACT", "the iteration limit was reached: the forces are inside their bounds and not certified"),
    2: ("COMMAND_REFUSED", "the command is not finite or too large: the forces are the last ones, the rest is zero"),
    4: ("HEALTH_REFUSED", "a health is unknown, or the force of a stuck actuator is not finite: it counts as dead"),
    8: ("NOT_INITIALISED", "parameters or state were not initialised, or are damaged: the forces are zero"),
    16: ("STATE_DAMAGED", "the state was changed between two steps, as its checksum shows: the forces are zero"),
    32: ("NOT_CONFIGURED", "the parameters are the file's, and this build asks for others: the forces are zero"),
}
#: Largest magnitude of a command: the squares of larger ones are no numbers, as in `casadi_gnc.allocation.allocator`.
MOST = {"double": LARGEST, "float": 1e15}
_NOTES = {
    "command": "wanted effort",
    "health": "of each actuator: 0 healthy, 1 dead, 2 stuck",
    "held": "force of stuck actuators",
    "force": "inside the bounds, always",
    "objective": "cost of the forces",
    "gap": "by how much it may exceed the least one",
    "unallocated": "command less the nominal effort",
    "worst_vertex": "of the uncertainty",
    "saturation": "of each actuator",
    "previous": "last forces",
    "ready": "a pattern once it is initialised",
    "lower": "least force",
    "upper": "largest force",
    "max_step": "largest change in one step",
}
#: What an actuator can be.
HEALTHY, DEAD, STUCK = 0.0, 1.0, 2.0


@dataclass(frozen=True, eq=False)
class FlightAllocator:
    """Pack the allocator of a problem.

    Parameters
    ----------
    title : of the file.
    problem : what is allocated, rows scaled where priorities are given.
    row_scale : (R,), factor to put on a command.
    units : of the rows of effort.
    """

    title: str
    problem: AllocationProblem
    row_scale: np.ndarray
    units: tuple[str, ...]
    scheme = ""
    is_exact = True
    machine = "the back end online of casadi-gnc allocate"

    @property
    def given(self) -> int:
        """Command, and health and held force of each actuator."""
        return len(self.row_scale) + 2 * self.problem.count

    @property
    def replayed(self) -> Layout:
        """Forces and certificate."""
        certificate = tuple(Signal(name) for name in ("objective", "gap", "worst_vertex", "iterations"))
        return Layout((Signal("force", self.problem.count), *certificate))

    def files(self, options: Options) -> dict[str, str]:
        """Return the files that fly."""
        about = self.about(options)
        source = template("allocator_source.c.j2").render(**about)
        files = {
            f"{options.name}.h": template("allocator_header.h.j2").render(**about, identity=digest(source)[:16]),
            f"{options.name}.c": source,
            **allocator_units(self.problem, options),
        }
        runtime = assets.folder("codegen") / "runtime"
        maths = ["gnc_mathf.h"] if options.real == "float" else ["gnc_math.h", "gnc_mathf.h"]
        for name in ("gnc_arithmetic.h", *maths, "gnc_allocate.h", "gnc_allocate_internal.h"):
            files[name] = (runtime / name).read_text(encoding="utf-8")
        return {**files, "LICENSE": (assets.folder("codegen") / "LICENSE").read_text(encoding="utf-8")}

    def dictionary(self, options: Options) -> Dictionary:
        """Return what the package says of its numbers."""
        n, r, real = self.problem.count, len(self.row_scale), {"double": "float64", "float": "float32"}[options.real]
        given = [("command", r, "real"), ("health", n, "int32"), ("held", n, "real")]
        answer = [("force", n, "real"), ("objective", 1, "real"), ("gap", 1, "real"), ("unallocated", r, "real")]
        answer += [("worst_vertex", 1, "int32"), ("iterations", 1, "int32"), ("saturation", n, "int32")]
        kept = [("previous", n, "real"), ("ready", 1, "uint32")]
        limits = {"lower": self.problem.lower, "upper": self.problem.upper, "max_step": self.problem.max_step}

        def members(rows: list[Any]) -> list[Entry]:
            return [Entry(name, name, size, kind, note=_NOTES.get(name, "")) for name, size, kind in rows]

        return Dictionary(
            options.name, self.title, "", real, 0.0, calls(options.name, ", &params"), ("state", "params"),
            tuple(members(given)), (*members(answer), STATUS), tuple(members(kept)),
            tuple(
                Entry(name, name, n, note=_NOTES[name], default=tuple(min(float(v), 1e30) for v in values))
                for name, values in limits.items()
            ),
            bits(STATUSES),
        )  # fmt: skip

    def about(self, options: Options) -> dict[str, Any]:
        """Return what header, source and README say."""
        problem = self.problem
        limits = {"lower": problem.lower, "upper": problem.upper, "max_step": np.minimum(problem.max_step, 1e30)}
        return {
            "name": options.name,
            "NAME": options.name.upper(),
            "title": self.title,
            "real": options.real,
            "allocation": allocation_sizes(problem),
            "statuses": [{"value": b, "name": n, "sentence": s} for b, (n, s) in STATUSES.items()],
            "problem": problem_tables(problem, options),
            "limits": {name: [options.constant(float(v)) for v in values] for name, values in limits.items()},
            "scale": [options.constant(float(value)) for value in self.row_scale],
            "units": [unit or "-" for unit in self.units],
            "numbers": {
                "zero": options.constant(0.0),
                "largest": options.constant(1e30),
                "most": options.constant(MOST[options.real]),
            },
        }

    def replay_header(self, options: Options, steps: int) -> str:
        """Return `test/replay.h`."""
        count, rows = self.problem.count, len(self.row_scale)
        health = [f"input->health[{i}]" for i in range(count)]
        outputs = [f"output->force[{i}]" for i in range(count)] + ["output->objective", "output->gap"]
        outputs += [f"({options.name}_real)output->{number}" for number in ("worst_vertex", "iterations")]
        return template("allocator_replay.h.j2").render(
            name=options.name,
            bits=64 if options.real == "double" else 32,
            steps=steps,
            inputs=[*elements("input->command", rows), *health, *elements("input->held", count)],
            casts=dict.fromkeys(health, "(int32_t)"),
            outputs=outputs,
            status="output->status",
        )

    def replay_files(self, options: Options, inputs: np.ndarray, outputs: np.ndarray, spoiled: int) -> dict[str, str]:
        """Return what replays the vectors."""
        header = self.replay_header(options, len(inputs))
        units = [f"{options.name}.c", *allocator_units(self.problem, options)]
        what = "commands and health of the actuators, with the answers"
        what += f", the last {spoiled} with bad commands" if spoiled else ""
        return package.replay_texts(options, units, header, inputs, outputs, what)

    def on_the_machine(self, rows: np.ndarray) -> np.ndarray:
        """Return what the solver gives that Python calls, step by step."""
        problem, count, size = self.problem, self.problem.count, len(self.row_scale)
        solver, previous, found = OnlineSolver(problem), np.clip(np.zeros(count), problem.lower, problem.upper), []
        for row in rows:
            command, health, held = row[:size], row[size : size + count], row[size + count :]
            known = (health == HEALTHY) | (health == DEAD) | ((health == STUCK) & (np.abs(held) <= 1e30))
            lower, upper = problem.box(previous)
            fixed = np.where((health == STUCK) & known, held, 0.0)
            lower, upper = (np.where(health == HEALTHY, bound, fixed) for bound in (lower, upper))
            status = 4 * (not known.all())
            if (np.abs(command * self.row_scale) <= LARGEST).all():
                raw = solver.solve(command * self.row_scale, previous, lower, upper)
                previous, numbers = raw.forces, [raw.objective, raw.gap, raw.worst_vertex, raw.iterations]
                status += 1 if raw.status == 2 else 2 if raw.status > 2 else 0
            else:
                previous, numbers, status = np.clip(previous, lower, upper), [0.0] * 4, status + 2
            found.append([*previous, *numbers, status])
        return np.array(found)
