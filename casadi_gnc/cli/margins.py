"""`casadi-gnc margins`: how much gain, phase and delay the loops of a mission bear."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any

import typer

from casadi_gnc.cli import completing
from casadi_gnc.cli.manners import Ending, Figures, Format, print_json
from casadi_gnc.cli.progress import Progress

if TYPE_CHECKING:
    from casadi_gnc.checking.broken_loops import SchemeMargins
    from casadi_gnc.checking.structured_disk import StructuredDisk


def margins(
    problem: Annotated[
        str, typer.Argument(autocompletion=completing.problems, help="A mission file, or the name of a shipped one.")
    ],
    scheme: Annotated[
        list[str] | None, typer.Option(autocompletion=completing.schemes, help="Only this scheme; may be repeated.")
    ] = None,
    structured: Annotated[
        bool, typer.Option("--structured", help="Also bounds on mu: the disk that all efforts bear at once.")
    ] = False,
    figures: Figures = None,
    ending: Format = Ending.png,
    json: Annotated[bool, typer.Option("--json", help="Print as JSON, nothing else.")] = False,
) -> None:
    """Show gain, phase, delay, modulus and disk margins of each effort and measurement, sampled as it flies.

    Then how far the true mass and inertia may be from the believed ones, and the centre of mass from the known one.
    """
    from casadi_gnc.checking.broken_loops import scheme_margins
    from casadi_gnc.errors import FlightError
    from casadi_gnc.problem_files.loading import load
    from casadi_gnc.system.files import prepare_folder

    mission = load(problem)
    found, lacking = [], []
    asked = [mission.scheme(name) for name in scheme] if scheme else mission.schemes
    with Progress("margins") as told:
        for done, one in enumerate(asked, 1):
            try:
                found.append(scheme_margins(mission, one, mass_centre=True))
            except FlightError as error:
                lacking.append(str(error))
            told(done, len(asked))
    if not found:
        raise FlightError("; ".join(lacking))
    drawn = None
    if figures is not None:
        from casadi_gnc.reports.margins_picture import draw

        drawn = draw(mission.title or mission.name, found, prepare_folder(figures) / f"margins.{ending.value}")
    disks = {}
    if structured:
        from casadi_gnc.checking.structured_disk import structured_disk

        disks = {one.scheme: structured_disk(one.loop) for one in found}
    if json:
        _print_json(mission.title, found, lacking, disks)
        return
    _print(mission.title or mission.name, found, disks)
    for sentence in lacking:
        typer.echo(f"note: {sentence}")
    if drawn is not None:
        typer.echo(f"wrote {drawn}")


def _print(title: str, found: list[SchemeMargins], disks: dict[str, StructuredDisk]) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table(title=escape(title), title_justify="left")
    for name in ("loop cut at", "gain from", "to", "phase [deg]", "at [rad/s]", "delay [s]", "modulus", "disk"):
        table.add_column(escape(name), justify="left" if name == "loop cut at" else "right", no_wrap=True)
    for one in found:
        table.add_section()
        table.add_row(f"[bold]{escape(one.scheme)}[/]")
        for name, m in one.channels.items():
            phase = "none" if math.isnan(m.phase_at) else f"{math.degrees(m.phase):.1f}"
            at = "" if math.isnan(m.phase_at) else f"{m.phase_at:.3g}"
            table.add_row(
                escape(name), f"{m.gain_low:.3g}", _or_any(m.gain_high), phase, at, _or_any(m.delay),
                f"{m.modulus:.3f}", f"{m.disk:.3f}",
            )  # fmt: skip
    # Nothing is cut, however narrow the terminal: a line that is too long runs on.
    console = Console(soft_wrap=True)
    console.width = max(console.width, Console(width=1000).measure(table).maximum)
    console.print(table, soft_wrap=False, crop=False)
    for one in found:
        high = f"up to {one.effort_high:.3g}" if math.isfinite(one.effort_high) else "without an upper end"
        low = f"from {one.effort_low:.3g}" if one.effort_low else "from 0"
        console.print(
            f"{one.scheme}: stable for (true effort)/(commanded effort), all alike, {low} {high}; "
            f"every effort by a factor of its own within the disk {one.disk_of_efforts:.3g}",
            markup=False,
            highlight=False,
        )
        console.print(_of_mass_centre(one), markup=False, highlight=False)
        if one.scheme in disks:
            console.print(f"{one.scheme}: {_of_disk(disks[one.scheme])}", markup=False, highlight=False)


def _of_disk(found: StructuredDisk) -> str:
    proved = (
        f"mu proves a disk of {found.proved:.4g} for all efforts at once where it is least, at {found.at:.3g} rad/s"
    )
    if not found.factors:
        return f"{proved}; no factors that break it were found"
    told = ", ".join(
        f"{gain:.3g} at {math.degrees(turn):.3g} deg" for gain, turn in zip(found.gains, found.phases, strict=True)
    )
    return f"{proved}; with {found.broken:.4g} these factors break it: {told}"


def _of_mass_centre(one: SchemeMargins) -> str:
    found = one.mass_centre
    assert found is not None
    if found.why:
        return f"{one.scheme}: no bound of the mass centre: {found.why}"

    def end(value: float) -> str:
        return f"{value:+.3g}" if math.isfinite(value) else "any"

    axes = "; ".join(
        f"axis {i}: {end(low)} to {end(high)}"
        for i, (low, high) in enumerate(zip(found.low, found.high, strict=True), 1)
    )
    told = f"{one.scheme}: stable for a mass centre off the known one, along one axis, [m], {axes}"
    if not math.isfinite(found.nearest):
        return told
    towards = ", ".join(f"{each:.2f}" for each in found.towards)
    return f"{told}; nearest bound found: {found.nearest:.3g} m towards ({towards})"


def _or_any(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else "any"


def _print_json(title: str, found: list[SchemeMargins], lacking: list[str], disks: dict[str, StructuredDisk]) -> None:
    import dataclasses

    def number(value: float) -> float | None:
        return value if math.isfinite(value) else None

    def centre(one: SchemeMargins) -> dict[str, Any]:
        found = one.mass_centre
        assert found is not None
        return {
            "key": found.key,
            "low_m": list(map(number, found.low)),
            "high_m": list(map(number, found.high)),
            "nearest_m": number(found.nearest),
            "towards": list(found.towards) if math.isfinite(found.nearest) else None,
            "why_none": found.why,
        }

    def disk(one: StructuredDisk | None) -> dict[str, Any] | None:
        if one is None:
            return None
        return {
            "proved": one.proved,
            "broken": number(one.broken),
            "at_rad_per_s": one.at,
            "gains": list(one.gains),
            "phases_rad": list(one.phases),
        }

    def data(one: SchemeMargins) -> dict[str, Any]:
        channels = {
            name: {key: number(value) for key, value in dataclasses.asdict(m).items()}
            for name, m in one.channels.items()
        }
        return {
            "scheme": one.scheme,
            "linearised_at_s": one.at_s,
            "channels": channels,
            "effort_low": one.effort_low,
            "effort_high": number(one.effort_high),
            "disk_of_efforts": one.disk_of_efforts,
            "mass_centre": centre(one),
            "structured_disk": disk(disks.get(one.scheme)),
        }

    content = {"problem": title, "schemes": [data(one) for one in found], "notes": lacking}
    print_json(content)
