"""Fly a scheme before its flight: from several starts, without metrics, built once and while others are looked at.

Built with less optimisation than a flight: for a run that is short, compiling counts. The words are the same.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache, lru_cache

import numpy as np

from casadi_gnc.errors import NoCompilerError
from casadi_gnc.missions import flying, metrics, tapes
from casadi_gnc.missions.engines import CompiledEngine, Engine
from casadi_gnc.missions.machine_engine import VirtualMachineEngine
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.scheme import Scheme
from casadi_gnc.signals import Layout
from casadi_gnc.status import StepStatus

#: Longest rehearsal [samples]; what takes longer is flown, not checked.
LONGEST = 1_000_000
#: Flights up to this many samples are built with the least that keeps numbers in registers: half the compiler's time,
#: half as slow again.
_SHORT = 300_000
#: Rows that are kept of a rehearsal at most.
_ROWS = 200_000
#: Rehearsals that are kept.
_KEPT = 16


@lru_cache(maxsize=_KEPT)
def rehearsal(mission: Mission, scheme: Scheme) -> Rehearsal:
    """Return a scheme ready to be flown; asked again, the same. Its C may still be being compiled."""
    return Rehearsal(mission, scheme)


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(thread_name_prefix="rehearsal")


class Rehearsal:
    """Hold what flies one scheme of a mission."""

    def __init__(self, mission: Mission, scheme: Scheme) -> None:
        self._mission = replace(mission, metrics=())
        self._tapes = tapes.tapes_of(self._mission, scheme)
        self._engine: Engine
        optimise = "-Og" if mission.timing.samples <= _SHORT else "-O1"
        try:
            self._engine = CompiledEngine(self._mission, scheme, self._tapes, optimise=optimise, pool=_pool())
        except NoCompilerError:
            self._engine = VirtualMachineEngine(self._mission, scheme, self._tapes)

    @property
    def row(self) -> Layout:
        """What stands in a row of a record."""
        return self._tapes.row

    def record(
        self, start: Mapping[str, Sequence[float]] | None = None, duration: float | None = None
    ) -> np.ndarray | None:
        """Return the rows of a flight, (K, columns); None where it diverges.

        Parameters
        ----------
        start : states that begin otherwise than the mission says, by signal.
        duration : [s]; the mission's own if left out, and `LONGEST` samples at most.
        """
        mission = self._mission
        if start is not None:
            mission = replace(mission, start_from={**mission.start_from, **start})
        timing = mission.timing
        samples = min(LONGEST, timing.samples if duration is None else round(duration / timing.sample_period) + 1)
        every = -(-samples // _ROWS)
        record = np.zeros((-(-samples // every), self.row.size))
        carried = flying.begin(mission, self._tapes, self._engine)
        self._engine.run(carried, 0, samples, every, record)
        return None if StepStatus.DIVERGED in metrics.statuses(self._tapes.tally, carried.tally) else record
