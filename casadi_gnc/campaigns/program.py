"""What flies many cases, as data: the C of a flight, how it is built, the sizes of its columns.

A program knows nothing of CasADi or of the mission's objects, so it can be sent to another process or machine and
be built and flown there.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, fields
from importlib import metadata
from typing import TypeVar

import numpy as np

from casadi_gnc.allocation import OnlineInFlight
from casadi_gnc.embedded.printer import Math
from casadi_gnc.errors import CampaignError
from casadi_gnc.missions import metrics
from casadi_gnc.missions.engines import build_options, flight_source
from casadi_gnc.missions.parameters import Varied
from casadi_gnc.missions.tapes import Tapes
from casadi_gnc.missions.timing import Timing

#: Called with the number of flights flown since the last call.
Told = Callable[[int], None]
T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Flown:
    """Hold what many flights came to, a row each: the tally, and what they carried after the last sample."""

    tally: np.ndarray
    x: np.ndarray
    m: np.ndarray
    actuators: np.ndarray
    good: np.ndarray

    @property
    def words(self) -> np.ndarray:
        """All of it as words of 64 bits, (cases, columns)."""
        columns = (getattr(self, each.name) for each in fields(self))
        return np.hstack([np.ascontiguousarray(column).view(np.uint64) for column in columns])

    def rows(self, first: int, last: int) -> Flown:
        """Return some of the flights."""
        return Flown(*(getattr(self, each.name)[first:last] for each in fields(self)))


@dataclass(frozen=True, eq=False)
class Program:
    """Hold what an engine needs to fly cases.

    Parameters
    ----------
    source : C of a flight at a time, with `flags` and `units` (`casadi_gnc.system.compilers.compiled`).
    lanes : C of LANES flights side by side; "" where flights go one at a time.
    operations : of all tapes in a sample.
    widths : of the columns of `Flown`.
    parameters, derived : numbers of a case, and numbers that follow from them.
    samples : of a flight.
    fresh : (widths["tally"],), the tally before the first sample.
    data, workspace : of the on-board solver after its set-up, and the words of its workspace; empty and 0 without.
    version : of casadi-gnc, whose C headers belong to the text.
    """

    source: str
    lanes: str
    flags: tuple[str, ...]
    units: tuple[str, ...]
    operations: int
    widths: dict[str, int]
    parameters: int
    derived: int
    samples: int
    fresh: np.ndarray
    data: np.ndarray
    workspace: int
    version: str


def program_of(varied: Varied, maths: Math = "gnc") -> Program:
    """Return what flies a mission whose numbers differ from case to case.

    Parameters
    ----------
    varied : the mission and what differs from case to case.
    maths : elementary functions: "gnc", the same words everywhere, or "libm", one flight at a time.

    Raises
    ------
    CampaignError
        For an allocation by a solver outside the C, which calls back into Python at every sample.
    """
    mission, scheme, tapes = varied.mission, varied.scheme, varied.tapes
    allocator, plant = scheme.actuation.allocator, mission.truth
    iterates = isinstance(allocator, OnlineInFlight)
    if not tapes.symbolic and not iterates:
        raise CampaignError(
            f"scheme {scheme.name!r} allocates by {type(allocator).__name__}, which is called from Python at every "
            'sample; take allocation by "pinv", or by "robust" with the on-board solver'
        )
    flags, units = build_options(scheme, maths)
    data, workspace = allocator.solver().contents if iterates else (np.zeros(0), 0)
    return Program(
        source=flight_source(mission, scheme, tapes, maths),
        lanes="" if iterates or maths == "libm" else flight_source(mission, scheme, tapes, maths, side_by_side=True),
        flags=flags,
        units=units,
        operations=_operations(tapes, mission.timing),
        widths={
            "tally": tapes.tally.size,
            "x": plant.state.size,
            "m": scheme.flown.memory.size,
            "actuators": plant.inputs.size,
            "good": plant.measurement.size,
        },
        parameters=varied.parameters.size,
        derived=tapes.functions["configure"].numel_out("derived"),
        samples=mission.timing.samples,
        fresh=metrics.fresh(tuple(mission.metrics), tapes.tally, tapes.watches),
        data=data,
        workspace=workspace,
        version=metadata.version("casadi-gnc"),
    )


def _operations(tapes: Tapes, timing: Timing) -> int:
    """Return how many operations of the tapes a sample takes."""
    sampled, fused = timing.mode == "sampled", "stage" in tapes.functions
    steps = timing.substeps if sampled else 1
    often = {"start": 0, "configure": 0, "plant": 0, "rate": 4 * steps, "point": 3 * steps, "weigh": 3 * steps}
    often["join"] = steps
    if not sampled:
        of_a_stage = 0 if fused else 4
        often |= {"stage": 4, "flow": 4, **dict.fromkeys(("sense", "before", "allocate"), of_a_stage)}
    return sum(often.get(name, 1) * tape.n_instructions() for name, tape in tapes.functions.items())


class BatchEngine(ABC):
    """Fly many cases of one program; the words of a case depend on its parameters and its seed alone."""

    name: str
    #: Cases in one call that make good use of it; any number is right.
    at_once: int = 1

    @abstractmethod
    def fly(self, values: np.ndarray, seeds: np.ndarray, told: Told | None = None) -> Flown:
        """Fly cases to their end.

        Parameters
        ----------
        values : (cases, P), the parameters of each.
        seeds : (cases,), of the noise of each.
        told : called from the calling thread as cases end.
        """

    def fly_all(
        self, parts: Iterable[tuple[T, np.ndarray, np.ndarray]], told: Told | None = None
    ) -> Iterator[tuple[T, Flown]]:
        """Fly parts (name, values, seeds), and yield each name with what its cases came to, in any order."""
        for name, values, seeds in parts:
            yield name, self.fly(values, seeds, told)

    def close(self) -> None:  # noqa: B027  (most engines hold nothing)
        """Give back what it holds."""
