"""What a package can be made of, and what every kind of it answers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from casadi_gnc.embedded import fault_source, function_faults, function_source, package
from casadi_gnc.embedded.controller import Controller, Options
from casadi_gnc.embedded.dictionary import STATUS, Dictionary, Entry, bits, calls, entries
from casadi_gnc.embedded.flight_function import FlightFunction
from casadi_gnc.embedded.function_machine import FunctionMachine
from casadi_gnc.embedded.machine import Machine
from casadi_gnc.signals import Layout


class Packable(Protocol):
    """Answer what a package is made of and compared with."""

    @property
    def title(self) -> str:
        """What it is, for people."""
        ...

    @property
    def scheme(self) -> str:
        """Name of the mission's scheme, "" where there is no mission."""
        ...

    @property
    def given(self) -> int:
        """Numbers that a sample of the replay is given."""
        ...

    @property
    def replayed(self) -> Layout:
        """What a replay compares besides the status."""
        ...

    def files(self, options: Options) -> dict[str, str]:
        """Return the files that fly: path inside the package -> text."""
        ...

    def dictionary(self, options: Options) -> Dictionary:
        """Return what the package says of its numbers."""
        ...

    def replay_header(self, options: Options, steps: int) -> str:
        """Return `test/replay.h`."""
        ...

    def replay_files(self, options: Options, inputs: np.ndarray, outputs: np.ndarray, spoiled: int) -> dict[str, str]:
        """Return the replay program, its vectors (rows of words) and the files that build it."""
        ...

    def on_the_machine(self, rows: np.ndarray) -> np.ndarray:
        """Return outputs and status (K, replayed + 1) of samples (K, given) by CasADi's virtual machine."""
        ...

    @property
    def is_exact(self) -> bool:
        """Whether that machine computes in the order of the C."""
        ...

    @property
    def machine(self) -> str:
        """What that machine is called."""
        ...


#: The end of the state of a function.
READY = Entry("ready", "ready", 1, "uint32", "", "a pattern once it is initialised")


def _real(options: Options) -> str:
    return {"double": "float64", "float": "float32"}[options.real]


@dataclass(frozen=True, eq=False)
class PackableController:
    """Pack the controller of a mission."""

    own: Controller
    is_exact = True
    machine = "CasADi's machine"

    @property
    def title(self) -> str:
        """Title of the mission."""
        return self.own.title

    @property
    def scheme(self) -> str:
        """Name of the scheme."""
        return self.own.scheme

    @property
    def given(self) -> int:
        """The time, and what is measured."""
        return 1 + self.own.measured.size

    @property
    def replayed(self) -> Layout:
        """Outputs, and what the monitor says."""
        return self.own.replayed

    def files(self, options: Options) -> dict[str, str]:
        """Return the files that fly."""
        return package.flight_files(self.own, options)

    def dictionary(self, options: Options) -> Dictionary:
        """Return what the package says of its numbers."""
        own = self.own
        return Dictionary(
            options.name, own.title, own.scheme, _real(options), own.period, calls(options.name), ("state", "params"),
            (Entry("time", "time", 1, "real", "s", "since the start of the mission"), *entries(own.measured)),
            (*entries(own.outputs), STATUS),
            tuple(fault_source.state(own)),
            tuple(
                Entry(
                    one.name, one.name, len(one.default), "real", one.unit, one.note,
                    one.default, one.minimum, one.above,
                )
                for one in own.tunables
            ),
            bits(own.raised),
        )  # fmt: skip

    def replay_header(self, options: Options, steps: int) -> str:
        """Return `test/replay.h`."""
        return package.replay_header(self.own, options, steps)

    def replay_files(self, options: Options, inputs: np.ndarray, outputs: np.ndarray, spoiled: int) -> dict[str, str]:
        """Return what replays a flight."""
        return package.replay_files(self.own, options, inputs, outputs, spoiled)

    def on_the_machine(self, rows: np.ndarray) -> np.ndarray:
        """Return what CasADi's machine gives."""
        return Machine(self.own).replay(rows)


@dataclass(frozen=True, eq=False)
class PackableFunction:
    """Pack a function."""

    own: FlightFunction
    scheme = ""

    @property
    def title(self) -> str:
        """What it is."""
        return self.own.title

    @property
    def given(self) -> int:
        """The inputs."""
        return self.own.inputs.size

    @property
    def replayed(self) -> Layout:
        """Outputs, and the state after the step."""
        return self.own.replayed

    def files(self, options: Options) -> dict[str, str]:
        """Return the files that fly."""
        return function_source.function_files(self.own, options)

    def dictionary(self, options: Options) -> Dictionary:
        """Return what the package says of its numbers."""
        own, name = self.own, options.name

        def said(layout: Layout, owner: str = "") -> list[Entry]:
            notes = {one: ", ".join(filter(None, (own.shape(one), own.notes.get(one)))) for one in layout.names}
            return [replace(one, note=notes[one.name]) for one in entries(layout, owner)]

        texts = {"init": f"{name}_init(&state)", "reset": "", "step": f"{name}_step(&state, &input, &output)"}
        return Dictionary(
            name, own.title, "", _real(options), own.period, texts, ("state",),
            tuple(said(own.inputs)), (*said(own.outputs), STATUS),
            (*said(own.state, "memory."), *function_faults.added(own), READY),
            (), bits(own.statuses),
        )  # fmt: skip

    def replay_header(self, options: Options, steps: int) -> str:
        """Return `test/replay.h`."""
        return function_source.replay_header(self.own, options, steps)

    def replay_files(self, options: Options, inputs: np.ndarray, outputs: np.ndarray, spoiled: int) -> dict[str, str]:
        """Return what replays the vectors."""
        header = self.replay_header(options, len(inputs))
        what = "inputs and answers of the function"
        what += f", the last {spoiled} with bad inputs" if spoiled else ""
        units = [path for path in self.files(options) if path.endswith(".c")]
        return package.replay_texts(options, units, header, inputs, outputs, what)

    def on_the_machine(self, rows: np.ndarray) -> np.ndarray:
        """Return what CasADi's machine gives."""
        return FunctionMachine(self.own).replay(rows)

    @property
    def machine(self) -> str:
        """What the function is compared with."""
        return "CasADi's machine" + (", whose order is another" if not self.is_exact else "")

    @property
    def is_exact(self) -> bool:
        """Whether the C is the function in scalars and nothing else."""
        return FunctionMachine(self.own).is_exact
