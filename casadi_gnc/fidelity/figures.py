"""Draw the flights that a paper's claims ask for, so that a reader sees what the numbers are taken from."""

from __future__ import annotations

from pathlib import Path

import casadi_gnc
from casadi_gnc.errors import GncError
from casadi_gnc.fidelity.report import PaperReport
from casadi_gnc.missions.timing import Mode
from casadi_gnc.reports import flight_pictures as plots

#: Samples kept of a flight for its picture.
_POINTS = 4000


def draw(report: PaperReport, folder: Path) -> list[Path]:
    """Draw every unchanged flight of a report once; a flight that fails has no picture, its claim says why."""
    asked: set[tuple[str, str, Mode | None]] = {
        (claim.flight.problem, claim.flight.scheme, claim.flight.mode)
        for claim in report.file.claim
        if claim.flight is not None and not claim.flight.changes
    }
    drawn = []
    for problem, scheme, mode in sorted(asked, key=str):
        try:
            mission = casadi_gnc.load(problem)
            kept = max(1, mission.timing.samples // _POINTS)
            flight = casadi_gnc.fly(mission, scheme, mode=mode or mission.timing.mode, decimation=kept)
        except GncError:
            continue
        picture = plots.plot_flight(mission, flight, folder)
        name = "-".join(part for part in (Path(problem).name, scheme, mode) if part)
        drawn.append(picture.rename(folder / f"{report.name}-{name}.png"))
    return drawn
