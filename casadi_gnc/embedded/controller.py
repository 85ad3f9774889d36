"""What a flight package is made of: a controller's tapes, its named signals and its parameters."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import casadi as ca

from casadi_gnc.allocation.problem import AllocationProblem
from casadi_gnc.embedded.faults import Faults
from casadi_gnc.embedded.monitor import Monitor
from casadi_gnc.embedded.named_nodes import Mark
from casadi_gnc.embedded.names import check_name, check_package, check_parameter
from casadi_gnc.embedded.scalars import Math, Real, c_constant
from casadi_gnc.errors import PackageError
from casadi_gnc.signals import Layout

#: Bits that the C raises where it is called otherwise than it must be, by value: name and sentence.
MISUSE = {
    1 << 27: (
        "TIME_SHIFTED",
        "The time did not advance by the period; the memory was advanced by one period all the same.",
    ),
    1 << 26: ("STATE_DAMAGED", "The state was changed between two steps, as its checksum shows; the outputs are zero."),
    1 << 28: ("NOT_INITIALISED", "Parameters or state were not initialised, or are damaged; the outputs are zero."),
}
#: The bit beside them of packages with parameters, where their defaults are not to fly.
NOT_CONFIGURED = (
    "NOT_CONFIGURED",
    "The parameters are defaults, and this build asks for others; the outputs are zero.",
)


@dataclass(frozen=True)
class Tunable:
    """Describe a parameter that stays a variable of the C.

    Parameters
    ----------
    name, unit, note : as declared by the law.
    default : one number an element.
    minimum, above : closed or open lower bound of every element, or None.
    """

    name: str
    unit: str
    note: str
    default: tuple[float, ...]
    minimum: float | None = None
    above: float | None = None


@dataclass(frozen=True)
class Options:
    """Say how a controller becomes C.

    Parameters
    ----------
    name : prefix of every symbol and file.
    real : type of every number.
    maths : "gnc" (the same words on every target); "libm" serves comparisons with CasADi only.
    frame : what the package is put into besides, of `casadi_gnc.embedded.frames.FRAMES`; "" for nothing.
    """

    name: str
    real: Real = "double"
    maths: Math = "gnc"
    frame: str = ""

    def __post_init__(self) -> None:
        check_package(self.name)

    def constant(self, value: float) -> str:
        """Return a number as C of this type."""
        return c_constant(value, self.real)


@dataclass(frozen=True, eq=False)
class Controller:
    """Hold a sampled controller, ready to be printed.

    The tapes and their ports; `e` holds what was derived from the tunable parameters `p`, `carried`
    what is known before the allocation and used after it:

    ========  ===========================================================================
    derive    p -> derived                                            (with tunables)
    start     t, y, [e] -> m
    before    t, y, good, m, actuators, [e] -> accepted, wanted, limited, lower, upper, flags, carried;
              where changed gains fade in also last, offset, share, changed -> shifted: how far the effort is
              from that of the new gains alone, times `share`
    allocate  limited, actuators, lower, upper, carried, [e] -> allocated   (where it is an expression)
    judge     told, carried, [e] -> verdict
    modulate  told, carried, [e] -> pulses, carry, the last of the memory    (where actuators make pulses)
    after     told, carried, [e] -> memory, the rest of it
    ========  ===========================================================================

    Parameters
    ----------
    title, source : of the problem.
    scheme : the scheme's name.
    period : sample period [s].
    measured, memory, wanted, limited, actuators, report : layouts of the columns.
    lower, upper : bounds of the actuators, one number an element.
    least, most : bounds of the limited effort.
    tapes : the functions above.
    tunables : parameters that stay variables.
    allocation : the problem that the on-board solver solves in each step, or None.
    statuses : bit -> (name, sentence), those that a controller can raise.
    carry : how many numbers of the memory, the last ones, pulses carry over.
    monitor : what the package watches on board, or None.
    faults : what the package does with faults beside telling them, or None.
    notes : tape -> result -> what its elements are, for those who read the C: how many, what.
    marks : tape -> what its law names on the way to them: title, scalars of the tape
        (`casadi_gnc.embedded.named_nodes`).
    """

    title: str
    source: str
    scheme: str
    period: float
    measured: Layout
    memory: Layout
    wanted: Layout
    limited: Layout
    actuators: Layout
    report: Layout
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    least: tuple[float, ...]
    most: tuple[float, ...]
    tapes: dict[str, ca.Function]
    statuses: dict[int, tuple[str, str]]
    tunables: tuple[Tunable, ...] = ()
    allocation: AllocationProblem | None = None
    monitor: Monitor | None = None
    faults: Faults | None = None
    carry: int = 0
    notes: dict[str, dict[str, tuple[tuple[int, str], ...]]] = field(default_factory=dict)
    marks: dict[str, tuple[Mark, ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for layout in (self.measured, self.memory, self.outputs):
            for name in layout.names:
                check_name(name, "signal")
        for tunable in self.tunables:
            check_parameter(tunable.name)
        if "time" in self.measured or "status" in self.outputs:
            raise PackageError("time and status are taken: a signal needs another name")
        for tape in self.tapes.values():
            if any(not math.isfinite(tape.instruction_constant(k)) for k in _constants(tape)):
                raise PackageError(f"the law of scheme {self.scheme} has a constant that is not finite")

    @property
    def raised(self) -> dict[int, tuple[str, str]]:
        """Every bit of the status, as `statuses`: those of the controller, of handled faults, and of misuse."""
        unread = {1 << 25: NOT_CONFIGURED} if self.tunables else {}
        handled = {} if self.faults is None else self.faults.statuses
        return {**self.statuses, **handled, **unread, **MISUSE}

    @property
    def outputs(self) -> Layout:
        """What the step gives besides the status."""
        return self.actuators + self.wanted + self.limited + self.report

    @property
    def replayed(self) -> Layout:
        """What the replay of a package compares besides the status: outputs, and what the monitor says."""
        return self.outputs if self.monitor is None else self.outputs + self.monitor.outputs


def _constants(tape: ca.Function) -> list[int]:
    return [k for k in range(tape.n_instructions()) if tape.instruction_id(k) == ca.OP_CONST]
