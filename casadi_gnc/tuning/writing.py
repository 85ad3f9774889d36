"""Write the gains of a tuning into a problem file, and hold what the file says against what was promised."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from casadi_gnc.errors import OutputError, ProblemError, TuningError
from casadi_gnc.missions import flying
from casadi_gnc.problem_files.document import Document, of_text
from casadi_gnc.problem_files.loading import load, load_document
from casadi_gnc.problem_files.rewriting import rewritten
from casadi_gnc.system.files import prepare_folder, write_beside
from casadi_gnc.tuning.conditions import new_troubles, verdicts_of
from casadi_gnc.tuning.costs import Cost, from_record
from casadi_gnc.tuning.gain_flights import Case, Flights
from casadi_gnc.tuning.outcome import Tuned

if TYPE_CHECKING:
    from casadi_gnc.missions.mission import Mission

#: By how much the cost of a flight from the file may differ from the promised one: the promised one has gains as
#: columns, the file's has them as constants, which round otherwise, and switches may then come a sample apart.
AGREEMENT = 1e-3


def refuse_target(mission: Mission, out: str | Path | None) -> Path | None:
    """Return where the result is to be written; raise what is wrong with that before anything is flown."""
    if out is None:
        return None
    target, origin = Path(out), mission.origin
    if origin is None or origin.changes:
        raise TuningError(
            f"{mission.name} was made from objects or changed after it was read, so there is no file to write gains "
            "into; leave out= away and use the gains that are returned"
        )
    if target.suffix != ".toml":
        raise OutputError(f"the result is to be {str(target)!r}; expected a name that ends in .toml")
    if (origin.folder / origin.name).resolve() == target.resolve():
        raise OutputError(f"{str(target)!r} is the problem file itself; write beside it")
    prepare_folder(target.parent)
    try:
        load_document(_document(mission, target), strict=False)
    except ProblemError as error:
        raise OutputError(
            f"what the file names does not lie beside {str(target)!r} ({error}); write into {str(origin.folder)!r}"
        ) from error
    return target


def _document(mission: Mission, target: Path) -> Document:
    assert mission.origin is not None
    return of_text(target, mission.origin.text)


def write(found: Tuned, flights: Flights, mission: Mission, target: Path, maths: Any = "libm") -> Tuned:
    """Write the file, then check and fly it as anyone would, and return the result with what that says.

    The flights are those of single C with the gains as constants and the host's libm; the cost is summed by NumPy from
    the record of every sample.

    Raises
    ------
    TuningError
        Where the file has a new failure or warning, or a flight from it costs something else than was promised; then
        there is no file.
    """
    text = rewritten(_document(mission, target), found.values, type(mission.craft))
    write_beside(target, lambda place: place.write_text(text, encoding="utf-8"))
    try:
        return replace(found, disagreement=_confirmed(found, flights, target, maths), file=str(target))
    except BaseException:
        target.unlink()
        raise


def _confirmed(found: Tuned, flights: Flights, target: Path, maths: Any) -> float:
    """Return by what share the cost of flights from the file differs at most; raise as `write`."""
    troubles = new_troubles(found.checks_before, verdicts_of(load(target, strict=False), found.scheme))
    if troubles:
        raise TuningError(
            f"the gains as they are written, {', '.join(f'{v:g}' for v in found.values.values())}, fail or warn "
            f"where the gains before did not: {', '.join(troubles)}; ask for more digits"
        )
    apart = max(_disagreement(found, flights, target, case, maths) for case in _flown_again(found, flights))
    if not apart <= AGREEMENT:
        raise TuningError(
            f"flights of {target.name} cost otherwise than was promised, by a share of {apart:.2g}: the mission "
            "answers to rounding, and no gain can be relied on; take a longer or smoother cost"
        )
    return apart


def _flown_again(found: Tuned, flights: Flights) -> list[Case]:
    """Return the cases that fly from the file: the nominal one, and the worst one."""
    values = np.array([[one.after for one in found.gains]])
    costs = flights.cost.total(flights.terms(values, found.cases), flights.scales)[0]
    worst = found.cases[int(np.argmax(costs))]
    return [flights.nominal] if worst is found.cases[0] else [flights.nominal, worst]


def _disagreement(found: Tuned, flights: Flights, target: Path, case: Case, maths: Any) -> float:
    """Return the relative difference of the cost of one case, flown from the file."""
    nominal = case is flights.nominal
    changes = {} if nominal else dict(zip(flights.keys, map(float, case.values), strict=True))
    mission = load(target, changes, strict=False)
    if mission.noise.seed != case.seed:  # a case's own has 64 bits, one more than a file's
        mission = replace(mission, noise=replace(mission.noise, seed=case.seed), parts=mission.parts_asked)
    flight = flying.fly(mission, found.scheme, maths=maths, decimation=1)
    values = np.array([[one.after for one in found.gains]])
    promised = flights.terms(values, [case])[0, 0]
    own = np.array([_term(flights.cost, i, flight) for i in range(len(promised))])
    ours, theirs = (float(flights.cost.total(each[None, :], flights.scales)[0]) for each in (own, promised))
    return abs(ours - theirs) / max(abs(theirs), 1e-300)


def _term(cost: Cost, number: int, flight: Any) -> float:
    term = cost.terms[number]
    if term.metric is None:
        return -flight.verdicts[term.column.removeprefix("requirement.")].robustness
    return from_record(term, flight.time, flight.block(term.metric.signal), cost.duration)
