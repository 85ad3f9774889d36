"""`casadi-gnc generate`: a flight package or a functional mock-up unit of a mission's controller."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer


class RealChoice(str, Enum):
    """Type of every number."""

    float64 = "float64"
    float32 = "float32"


class FormatChoice(str, Enum):
    """What is written."""

    package = "package"
    fmu = "fmu"


def generate(
    problem: Annotated[str, typer.Argument(help="A mission file, or the name of a shipped one.")],
    out: Annotated[
        Path | None, typer.Option(help="Folder of the package, or the .fmu; flight/<name> if left out.")
    ] = None,
    scheme: Annotated[str | None, typer.Option(help="Which scheme of the mission; the first one if left out.")] = None,
    name: Annotated[str | None, typer.Option(help="Prefix of every C symbol; the file's name if left out.")] = None,
    real: Annotated[RealChoice, typer.Option(help="Type of every number.")] = RealChoice.float64,
    tunable: Annotated[str, typer.Option(help="Gains that stay variables of the C, apart by commas.")] = "",
    target: Annotated[str, typer.Option(help="Targets to measure for the README, apart by commas.")] = "",
    format: Annotated[FormatChoice, typer.Option(help="C package, or FMI 2.0 co-simulation.")] = FormatChoice.package,
    steps: Annotated[int, typer.Option(help="Samples of the flight that is shipped as test vectors.")] = 1024,
    force: Annotated[bool, typer.Option(help="Overwrite a package whose files were edited.")] = False,
) -> None:
    """Write the controller as C that an embedded project takes as it is, with a flight to test it by."""
    from casadi_gnc.delivery import packaging
    from casadi_gnc.system.text import shell, terminal

    gains, boards = _words(tunable), _words(target)
    if format is FormatChoice.fmu:
        from casadi_gnc.delivery.fmu import generate_fmu

        written = generate_fmu(problem, out, scheme=scheme, name=name, real=real.value, tunable=gains)
        typer.echo(terminal(f"wrote {written}"))
        return
    folder = Path("flight") / (name or Path(problem).stem) if out is None else out
    about = packaging.generate(
        problem,
        folder,
        scheme=scheme,
        name=name,
        real=real.value,
        tunable=gains,
        target=boards,
        steps=steps,
        force=force,
    )
    typer.echo(terminal(f"{about['title']}, scheme {about['scheme']}, {about['real']}: wrote {folder}"))
    for warning in about["warnings"]:
        typer.echo(terminal(f"warning: {warning}"))
    place = shell(f"./{folder}" if str(folder).startswith("-") else folder)  # else it would be taken for an option
    typer.echo(f"next: make -C {place} test; casadi-gnc verify {place} --target host,cortex-m7")


def _words(text: str) -> list[str]:
    return [word.strip() for word in text.split(",") if word.strip()]
