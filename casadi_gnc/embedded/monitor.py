"""The monitor of a package: what it watches on board.

A monitor is one tape, a few delay lines (ring buffers) and registers: `casadi_gnc.missions.requirements.monitor`. It is
a unit of its own beside the controller, called after each step with what the step was given and gave; whoever does not
want it leaves it out of the build.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from casadi_gnc.embedded.names import check_name
from casadi_gnc.errors import PackageError
from casadi_gnc.signals import Layout, Signal

#: Requirements of one monitor: a bit each in its answer, and constants of enumerations are no larger than an int.
MOST = 31


@dataclass(frozen=True)
class Watched:
    """Describe one requirement of a monitor.

    Parameters
    ----------
    id, asked : the requirement, and what it asks.
    unit : of its robustness.
    delay : seconds after which an instant can be judged.
    """

    id: str
    asked: str
    unit: str
    delay: float

    @property
    def name(self) -> str:
        """The id as a member of a C struct."""
        return self.id.lower().replace(".", "_").replace("-", "_")


@dataclass(frozen=True, eq=False)
class Monitor:
    """Hold what a package watches.

    Parameters
    ----------
    watched : the requirements, in order.
    left_out : id of each that cannot be watched on board, and why.
    tape : (t, y, wanted, limited, actuators, report, status, age, after, past, kept) -> (pushed, later, robustness,
        verdict).
    lines : length of each delay line, in samples.
    initial : the registers before the first sample.
    horizon : number of a sample from which on all are alike.
    finish : steps after the last sample until all is known.

    Raises
    ------
    PackageError
        For an id that is no name in C, two that become one, and more requirements than a word has bits.
    """

    watched: tuple[Watched, ...]
    left_out: tuple[tuple[str, str], ...]
    tape: ca.Function
    lines: tuple[int, ...]
    initial: tuple[float, ...]
    horizon: int
    finish: int

    def __post_init__(self) -> None:
        names = [one.name for one in self.watched]
        for one in self.watched:
            check_name(one.name, "requirement")
            if names.count(one.name) > 1:
                raise PackageError(f"the requirement {one.id!r} and another are both {one.name!r} in C; rename one")
        if len(self.watched) > MOST:
            raise PackageError(f"{len(self.watched)} requirements are watched on board, expected at most {MOST}")

    @property
    def outputs(self) -> Layout:
        """What the monitor gives: robustness and verdict of each requirement."""
        signals = [
            signal
            for one in self.watched
            for signal in (Signal(f"{one.name}_robustness", 1, one.unit), Signal(f"{one.name}_verdict"))
        ]
        return Layout(tuple(signals))
