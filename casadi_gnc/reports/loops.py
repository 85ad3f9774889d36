"""What a mission says of itself before it flies, for pages: loops with poles and margins, what actuators can make.

It is plain data, kept as `loops.json` beside the records, so that a page that is made later needs no mission.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.allocation.attainable_plots import outline
from casadi_gnc.allocation.attainable_sets import SetKind, attainable_sets
from casadi_gnc.allocation.problem import AllocationProblem
from casadi_gnc.checking.broken_loops import SchemeMargins, scheme_margins
from casadi_gnc.checking.linear import LinearLoop, loop_at
from casadi_gnc.checking.margins import BrokenLoop, Margins
from casadi_gnc.checking.sampling import settled
from casadi_gnc.errors import AllocationError, FlightError
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.scheme import Scheme
from casadi_gnc.reports.told import ShownCurve, ShownLoop, ShownLoops, ShownSlice
from casadi_gnc.system.files import write_beside

FILE = "loops.json"
#: Digits of a number that is drawn; of each curve so many-th point.
_DIGITS = 5
_EVERY = 6
_NAMES = ("x", "y", "z")


def loops_of(mission: Mission, schemes: Sequence[str]) -> ShownLoops:
    """Return loops of schemes, and the slices of their attainable sets; schemes with the same actuators have one."""
    chosen = [mission.scheme(name) for name in schemes]
    return ShownLoops(loops=[loop_of(mission, one) for one in chosen], slices=_slices(chosen))


def save(folder: Path, loops: ShownLoops) -> Path:
    """Write them as `loops.json`; return its path."""
    target, text = folder / FILE, loops.model_dump_json(indent=1) + "\n"
    write_beside(target, lambda path: path.write_text(text, encoding="utf-8"))
    return target


def loop_of(mission: Mission, scheme: Scheme) -> ShownLoop:
    """Return poles and margins of a scheme's loop, linearised at its target when funnels have stopped narrowing."""
    title, loop = scheme.title or scheme.name, loop_at(mission, scheme, settled(mission))
    if not loop.matrix.size or not loop.exists:
        told = "The loop has no slope at its target, so it has neither poles nor margins."
        return ShownLoop(scheme=title, told=told)
    poles = np.linalg.eigvals(loop.moving) if loop.moving.size else np.zeros(0, dtype=complex)
    known: dict[str, Any] = {"scheme": title, "sampled": loop.sampled}
    known["poles"] = [(_short(pole.real), _short(pole.imag)) for pole in poles.tolist()]
    try:
        found = scheme_margins(mission, scheme)
    except FlightError as error:
        return ShownLoop(**known, told=f"{str(error)[:1].upper()}{str(error)[1:]}.")
    names = list(found.channels)[: found.loop.channels]
    return ShownLoop(
        **known,
        told=_told(loop, found),
        curves=[_curve(name, found.loop.channel(i)) for i, name in enumerate(names)],
        margins=[_margin_row(channel, one) for channel, one in found.channels.items()],
    )


def _told(loop: LinearLoop, found: SchemeMargins) -> str:
    ends = f"{found.effort_low:.3g} and {found.effort_high:.3g}" if math.isfinite(found.effort_high) else ""
    together = (
        f"between {ends}"
        if ends
        else f"above {found.effort_low:.3g}"
        if found.effort_low
        else "whatever that factor is"
    )
    return (
        f"Linearised at its target at {loop.t:g} s, with actuators that are not at their limits; each row is the loop "
        "cut at that effort or measurement, the others closed. With one factor between the true and the commanded "
        f"effort on every axis it is stable {together}."
    )


def _margin_row(channel: str, one: Margins) -> list[str]:
    def shown(value: float, unit: str = "") -> str:
        return f"{value:.4g}{unit}" if math.isfinite(value) else "none"

    def decibel(value: float) -> str:
        return f"{value:.4g} ({20 * math.log10(value):+.1f} dB)" if math.isfinite(value) and value > 0 else "none"

    return [
        channel,
        decibel(one.gain_low),
        decibel(one.gain_high),
        "none" if math.isnan(one.phase_at) else shown(math.degrees(one.phase), "°"),
        shown(one.phase_at, " rad/s"),
        shown(one.delay, " s"),
        shown(one.modulus),
        shown(one.disk),
    ]


def _curve(name: str, loop: BrokenLoop) -> ShownCurve:
    """Return gain and phase of a loop, few enough points, the phase nearest to -180 degrees where the gain is one."""
    grid = loop.frequencies()
    response = loop.at(grid)[:, 0, 0]
    size = 20 * np.log10(np.maximum(np.abs(response), 1e-30))
    phase = np.degrees(np.unwrap(np.angle(response)))
    middle = phase[np.argmin(np.abs(size))]
    phase = phase - 360.0 * round((middle + 180.0) / 360.0)
    some = np.flatnonzero(np.isfinite(size) & np.isfinite(phase))[::_EVERY]
    columns = [[_short(value) for value in column[some].tolist()] for column in (grid, size, phase)]
    return ShownCurve(name=name, frequency=columns[0], gain=columns[1], phase=columns[2])


def _slices(schemes: Sequence[Scheme]) -> list[ShownSlice]:
    """Return the slices through zero of what the actuators of schemes can make, along the planes of the first axes."""
    found: dict[tuple[Any, ...], tuple[Scheme, AllocationProblem, list[str]]] = {}
    for scheme in schemes:
        problem = _problem(scheme)
        if problem is not None and len(problem.effectiveness) > 1:
            parts = (problem.effectiveness, problem.lower, problem.upper, *problem.vertices)
            key = tuple(np.asarray(part).tobytes() for part in parts)
            found.setdefault(key, (scheme, problem, []))[2].append(scheme.title or scheme.name)
    made = []
    for scheme, problem, titles in found.values():
        try:
            sets = attainable_sets(problem)
        except AllocationError:  # too many faces to list
            continue
        distinct = sets if len(problem.vertices) > 1 else sets[:1]
        rows = [(one, k) for one in scheme.actuation.effort.signals for k in range(one.size)]
        for i, j in combinations(range(min(3, len(problem.effectiveness))), 2):
            outlines = {_SETS[one.kind]: _corners(outline(one, i, j)) for one in distinct}
            most = (scheme.actuation.limit_above[i], scheme.actuation.limit_above[j])
            limit = most if all(map(math.isfinite, most)) else None
            made.append(
                ShownSlice(schemes=titles, across=_axis(*rows[i]), up=_axis(*rows[j]), outlines=outlines, limit=limit)
            )
    return made


_SETS = {
    SetKind.NOMINAL: "nominal geometry",
    SetKind.EACH_VERTEX: "each error, forces of its own",
    SetKind.COMMON_FORCES: "one set of forces for all errors",
}


def _problem(scheme: Scheme) -> AllocationProblem | None:
    """Return what a scheme allocates; None where its effectiveness moves, or a bound has no end."""
    actuation = scheme.actuation
    known = getattr(actuation.allocator, "problem", None)
    if isinstance(known, AllocationProblem):
        return known
    matrix: Any = actuation.effectiveness
    if callable(matrix) or not np.isfinite([*actuation.lower, *actuation.upper]).all():
        return None
    try:
        return AllocationProblem(np.array(matrix, dtype=float), actuation.lower, actuation.upper)
    except (AllocationError, TypeError, RuntimeError):  # symbols: a build that flies with any geometry
        return None


def _axis(signal: Any, element: int) -> str:
    name = signal.name.replace("_", " ")
    which = "" if signal.size == 1 else f" {_NAMES[element] if signal.size == 3 else element + 1}"
    return f"{name}{which} [{signal.unit or '-'}]"


def _corners(polygon: np.ndarray) -> list[tuple[float, float]]:
    return [(_short(x), _short(y)) for x, y in polygon.tolist()]


def _short(value: float) -> float:
    return float(f"{value:.{_DIGITS}g}")
