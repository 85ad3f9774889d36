"""Where a tuning is, as its journal has it: enough to go on from there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from casadi_gnc.errors import TuningError
from casadi_gnc.tuning.descent import Iterate
from casadi_gnc.tuning.gain_flights import Case


@dataclass(frozen=True, eq=False)
class State:
    """Hold where a tuning is: the cases, the searches for worse ones that were made, the iterate, all costs so far."""

    cases: list[Case]
    searches: int
    at: Iterate
    course: list[tuple[float, str]]

    def data(self) -> dict[str, Any]:
        """Return it as plain data."""
        cases = [{"values": one.values.tolist(), "seed": one.seed, "name": one.name} for one in self.cases]
        return {"cases": cases, "searches": self.searches, "course": self.course, "at": self.at.data()}


def resumed(lines: list[dict[str, Any]]) -> State | None:
    """Return the state after the last line of a journal, None where there is none.

    Raises
    ------
    TuningError
        For a line that tells none.
    """
    if not lines:
        return None
    last = lines[-1]
    try:
        cases = [Case(np.array(one["values"], dtype=float), one["seed"], one["name"]) for one in last["cases"]]
        course = [(float(value), str(how)) for value, how in last["course"]]
        return State(cases, int(last["searches"]), Iterate.of_data(last["at"]), course)
    except (KeyError, TypeError, ValueError) as error:
        raise TuningError(
            f"the last iterate of the journal cannot be read ({error!r}); move the journal away to begin anew"
        ) from error
