"""`casadi-gnc generate`: a flight package of a mission's controller or of a function, or a functional mock-up unit."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import typer

from casadi_gnc.cli import completing
from casadi_gnc.cli.manners import print_json
from casadi_gnc.cli.progress import working


class RealChoice(str, Enum):
    """Type of every number."""

    float64 = "float64"
    float32 = "float32"


class FormatChoice(str, Enum):
    """What is written."""

    package = "package"
    fmu = "fmu"
    fmi2 = "fmi2"
    fmi3 = "fmi3"
    basilisk = "basilisk"
    ros2 = "ros2"
    freertos = "freertos"
    timer = "timer"
    simulink = "simulink"
    xtce = "xtce"


def generate(
    problem: Annotated[
        str,
        typer.Argument(
            autocompletion=completing.problems,
            help="A mission or allocation file, or the name of a shipped one; a .casadi file.",
        ),
    ],
    out: Annotated[
        Path | None, typer.Option(help="Folder of the package, or the .fmu; flight/<name> if left out.")
    ] = None,
    scheme: Annotated[
        str | None,
        typer.Option(autocompletion=completing.schemes, help="Which scheme of the mission; the first one if left out."),
    ] = None,
    name: Annotated[str | None, typer.Option(help="Prefix of every C symbol; the file's name if left out.")] = None,
    real: Annotated[RealChoice, typer.Option(help="Type of every number.")] = RealChoice.float64,
    tunable: Annotated[str, typer.Option(help="Gains that stay variables of the C, apart by commas.")] = "",
    target: Annotated[
        str, typer.Option(autocompletion=completing.targets, help="Targets to measure for the README, apart by commas.")
    ] = "",
    at_most_instructions: Annotated[
        int | None, typer.Option(help="Refuse where a step's proved bound on a target is above this.")
    ] = None,
    format: Annotated[
        FormatChoice, typer.Option(help="C package, alone or with a frame for it; an FMI unit (fmu is fmi2).")
    ] = FormatChoice.package,
    steps: Annotated[
        int | None, typer.Option(help="Samples that are shipped as test vectors; 1024 if left out.")
    ] = None,
    state: Annotated[
        list[str] | None, typer.Option(help="Of a function: INPUT:OUTPUT, an input and its next value; once a pair.")
    ] = None,
    ports: Annotated[
        Path | None, typer.Option(help="Of a function: TOML with a table a port: unit, note, initial (of a state).")
    ] = None,
    commands: Annotated[
        Path | None, typer.Option(help="Of an allocation file: CSV of the shipped commands, columns u1, u2, ...")
    ] = None,
    rate: Annotated[float | None, typer.Option(help="Of a function: steps a second.")] = None,
    vectors: Annotated[
        Path | None, typer.Option(help="Of a function: CSV of the inputs of the shipped steps, columns x[0], x[1], ...")
    ] = None,
    fault_handling: Annotated[
        Path | None, typer.Option(help="Of a function: TOML with the keys of a mission's [fault_handling].")
    ] = None,
    force: Annotated[bool, typer.Option(help="Overwrite a package whose files were edited.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Print as JSON, nothing else.")] = False,
) -> None:
    """Write the controller as C that an embedded project takes as it is, with a flight to test it by."""
    from casadi_gnc.delivery import generating
    from casadi_gnc.errors import PackageError
    from casadi_gnc.system.text import shell, terminal

    gains, boards = _words(tunable), _words(target)
    if format in (FormatChoice.fmu, FormatChoice.fmi2, FormatChoice.fmi3):
        from casadi_gnc.delivery.fmu import generate_fmu

        of_others = (state, ports, rate, vectors, commands, fault_handling, at_most_instructions is not None)
        if any(of_others) or Path(problem).suffix == generating.ENDING:
            raise PackageError("a unit is made of a mission; leave out what is for others")
        fmi = 3 if format is FormatChoice.fmi3 else 2
        written = generate_fmu(problem, out, scheme=scheme, name=name, real=real.value, tunable=gains, fmi=fmi)
        if json:
            print_json({"wrote": [str(written)], "manifest": None, "warnings": []})
        else:
            typer.echo(terminal(f"wrote {written}"))
        return
    folder = Path("flight") / (name or Path(problem).stem) if out is None else out
    with working(f"writing {folder}"):
        about = generating.generate(
            problem,
            folder,
            scheme=scheme,
            name=name,
            real=real.value,
            tunable=gains,
            target=boards,
            at_most_instructions=at_most_instructions,
            steps=steps,
            force=force,
            state=_pairs(state) if state else None,
            ports=_ports(ports) if ports else None,
            rate=rate,
            fault_handling=_handling(fault_handling) if fault_handling else None,
            vectors=vectors,
            commands=commands,
            frame="" if format is FormatChoice.package else format.value,
        )
    if json:
        print_json({"wrote": [str(folder)], "manifest": about, "warnings": about.pop("warnings")})
        return
    scheme_of = f", scheme {about['scheme']}" if about["scheme"] else ""
    typer.echo(terminal(f"{about['title']}{scheme_of}, {about['real']}: wrote {folder}"))
    for warning in about["warnings"]:
        typer.echo(terminal(f"warning: {warning}"))
    place = shell(f"./{folder}" if str(folder).startswith("-") else folder)  # else it would be taken for an option
    typer.echo(f"next: make -C {place} test; casadi-gnc verify {place} --target host,cortex-m7")


def _pairs(texts: list[str]) -> dict[str, str]:
    """Return pairs input:output; raise `PackageError` for other texts."""
    from casadi_gnc.errors import PackageError

    pairs: dict[str, str] = {}
    for text in texts:
        before, colon, after = (part.strip() for part in text.partition(":"))
        if not (before and colon and after) or before in pairs:
            told = "is named twice" if before in pairs else "is no pair"
            raise PackageError(f"--state {text!r} {told}; expected INPUT:OUTPUT, once for each state")
        pairs[before] = after
    return pairs


def _ports(path: Path) -> dict[str, Any]:
    """Return what a file says of ports."""
    import tomllib

    from casadi_gnc.errors import PackageError

    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError, RecursionError) as error:
        raise PackageError(f"{path} cannot be read as TOML: {error}; expected a table for each port") from None


def _handling(path: Path) -> Any:
    """Return what a file says of faults."""
    from casadi_gnc.problem_files.document import read
    from casadi_gnc.problem_files.mission_tables import FaultHandlingTable

    return read(path).validated(FaultHandlingTable).handling()


def _words(text: str) -> list[str]:
    return [word.strip() for word in text.split(",") if word.strip()]
