"""Fly a mission again and again with other numbers, from one build."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from casadi_gnc.embedded.printer import Math
from casadi_gnc.errors import FlightError, offer
from casadi_gnc.mathematics.arrays import real_array
from casadi_gnc.missions.engines import CompiledEngine
from casadi_gnc.missions.flight import Flight
from casadi_gnc.missions.flying import EngineName, Progress, begin, engine_of, flown
from casadi_gnc.missions.judging import judges_of
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.parameters import Varied
from casadi_gnc.missions.paths import entries_of
from casadi_gnc.missions.requirements import Judge

#: Samples of which every one is looked at at once.
_CHUNK = 50_000


class OneBuild:
    """Hold a mission of one scheme in which some numbers are columns, and the engine that flies it.

    Made by `casadi_gnc.vary`. A flight takes the time of a flight, whatever its numbers are: nothing is compiled again.
    At the nominal numbers it agrees with that of `fly` to rounding, for the C of that one has folded constants.

    Parameters
    ----------
    varied : from `casadi_gnc.missions.parameters.vary`.
    engine, maths : as for `casadi_gnc.missions.flying.fly`.
    """

    def __init__(self, varied: Varied, *, engine: EngineName = "c", maths: Math = "gnc") -> None:
        self.varied, self._engine = varied, engine
        self._maths: Math = maths
        self._made: CompiledEngine | None = None
        self._notes: tuple[str, ...] = ()

    @property
    def keys(self) -> tuple[str, ...]:
        """The whole path of each number that can be given."""
        return self.varied.parameters.keys

    def __repr__(self) -> str:
        return f"OneBuild({self.varied!r})"

    def fly(self, values: Mapping[str, Any] | None = None, *, seed: int | None = None, **options: Any) -> Flight:
        """Fly with other numbers.

        Parameters
        ----------
        values : by key: a number, or as many as the key stands for; numbers that are not given are those of the file.
        seed : of the noise; the mission's own by default.
        options : decimation and progress, as for `casadi_gnc.missions.flying.fly`.

        Raises
        ------
        FlightError
            For a key that is no column, and numbers that no such craft or law can have.
        """
        row = self.row(values or {})
        refused = self.varied.refusals(row[None, :])[0]
        if refused:
            raise FlightError(refused)
        nominal = self.varied.nominal
        known = self.varied.at(row) if values else nominal
        return self.fly_row(row, nominal.noise.seed if seed is None else seed, told_of=known, **options)

    def row(self, values: Mapping[str, Any]) -> np.ndarray:
        """Return the number of every column, (P,); arguments and errors as for `fly`."""
        row = self.varied.parameters.nominal.copy()
        for key, value in values.items():
            entries = self._entries(key)
            places = list(dict.fromkeys(entries))
            if not places:
                raise FlightError(f"{key!r} is no column of this build; {offer(key, self.keys)}")
            numbers = real_array(key, value, FlightError).ravel()
            if numbers.size == len(entries):  # a whole symmetric matrix among them
                row[entries] = numbers
                if (row[entries] != numbers).any():
                    raise FlightError(f"{key!r} is a symmetric matrix; expected equal numbers in mirror entries")
            elif numbers.size in (1, len(places)):
                row[places] = numbers
            else:
                raise FlightError(f"{key!r} stands for {len(places)} numbers, and {numbers.size} are given")
        return row

    def _entries(self, key: str) -> list[int]:
        """Return the column of each number that a key stands for, of mirror entries of a symmetric matrix the same."""
        below = [i for i, known in enumerate(self.keys) if known == key or known.startswith(f"{key}.")]
        try:
            entries = entries_of(self.varied.nominal, key)
        except FlightError:  # a table, whose columns alone are meant
            return below
        return [self.keys.index(one) for one in entries if one in self.keys]

    def fly_row(
        self,
        row: Sequence[float] | np.ndarray,
        seed: int,
        *,
        decimation: int | None = None,
        progress: Progress | None = None,
        told_of: Mission | None = None,
    ) -> Flight:
        """Fly with a number for every column, which are not looked at again.

        Parameters
        ----------
        row : (P,).
        seed : of the noise.
        decimation, progress : as for `casadi_gnc.missions.flying.fly`.
        told_of : mission in numbers whose name, digest and cautions the flight is told with; the nominal one.
        """
        varied = self.varied
        mission = replace(
            varied.mission, noise=replace(varied.mission.noise, seed=seed), parts=varied.mission.parts_asked
        )
        runner = self._runner(mission, seed)
        carried = begin(mission, varied.tapes, runner, np.array(row, dtype=float))
        every = mission.timing.record_every if decimation is None else decimation
        known = told_of or varied.nominal
        return flown(
            mission, mission.schemes[0], varied.tapes, runner, carried, every, self._maths, self._notes, progress, known
        )

    def judge(self, row: Sequence[float] | np.ndarray, seed: int) -> tuple[np.ndarray, dict[str, float]]:
        """Return the tally of a flight, and the robustness of each requirement that it cannot carry, by id.

        No record is kept, and nothing else is told. Arguments as for `fly_row`.
        """
        mission, tapes = self.varied.mission, self.varied.tapes
        runner = self._runner(mission, seed)
        carried = begin(mission, tapes, runner, np.array(row, dtype=float))
        total, done = mission.timing.samples, 0
        for judge in self._judges:
            judge.forget()
        while done < total:
            every = np.zeros((min(_CHUNK, total - done), tapes.row.size))
            done += runner.run(carried, done, len(every), 1, every)
            for judge in self._judges:
                judge.take(every)
        return carried.tally, {judge.requirement.id: judge.verdict().robustness for judge in self._judges}

    @cached_property
    def _judges(self) -> list[Judge]:
        return judges_of(self.varied.mission, self.varied.tapes)

    def _runner(self, mission: Mission, seed: int) -> Any:
        """Return the engine: the compiled one is made once, and given the seed of each flight."""
        if self._made is None:
            made, self._notes = engine_of(mission, mission.schemes[0], self.varied.tapes, self._engine, self._maths)
            if not isinstance(made, CompiledEngine):
                return made
            self._made = made
        self._made.reseed(seed)
        return self._made


def fly_case(
    varied: Varied,
    values: Sequence[float] | np.ndarray,
    seed: int,
    *,
    engine: EngineName = "c",
    maths: Math = "gnc",
    decimation: int | None = None,
    progress: Progress | None = None,
) -> Flight:
    """Fly a mission whose parameters are columns with some values of them, noise drawn from `seed`.

    The text that flies is that of every other case: the words are those of a batch. Other arguments as for
    `casadi_gnc.missions.flying.fly`.
    """
    return OneBuild(varied, engine=engine, maths=maths).fly_row(values, seed, decimation=decimation, progress=progress)
