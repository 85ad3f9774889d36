"""`casadi-gnc verify`: a package against CasADi's machine, other compilers and targets, word by word."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from casadi_gnc.cli import completing
from casadi_gnc.cli.manners import Report, page, print_json
from casadi_gnc.cli.progress import working


def verify(
    package: Annotated[Path, typer.Argument(help="Folder that `casadi-gnc generate` wrote.")],
    target: Annotated[
        str,
        typer.Option(
            autocompletion=completing.targets, help="host and names of targets, apart by commas; all: every target."
        ),
    ] = "host",
    json: Annotated[bool, typer.Option("--json", help="Print as JSON, nothing else.")] = False,
    report: Report = None,
) -> None:
    """Compare a package's words here and on targets, and measure it there; exit code 1 if a word or file differs.

    Runs the package's code, its C and the Python that it keeps, with your rights.
    """
    from casadi_gnc.delivery.verifying import verify as run
    from casadi_gnc.embedded import boards

    report = page(report, package)
    wanted = [word.strip() for word in target.split(",") if word.strip()] or ["host"]
    if "all" in wanted:
        wanted = ["host", *boards.names()]
    with working(f"comparing words on {', '.join(wanted)}"):
        found = run(package, wanted)
    if report is not None:
        from casadi_gnc.reports.package_page import of_verification

        of_verification(found, report)
    if json:
        print_json(found)
    else:
        _print(found)
        if report is not None:
            typer.echo(f"wrote {report}")
    if not found["is_sound"]:
        raise typer.Exit(1)


def _print(found: dict[str, Any]) -> None:
    scheme = f", scheme {found['scheme']}" if found["scheme"] else ""
    _say(f"{found['title']}{scheme}, {found['real']}, {found['steps']} samples")
    for one in found["comparisons"]:
        verdict = f"{one['words']} of {one['of']} words differ"
        _say(f"  {one['what']}: {verdict}{'' if one['exact'] else ' (as they may)'}")
        for signal in one["signals"]:
            if signal["words"]:
                _say(
                    f"    {signal['signal']}: {signal['words']} words, at most {signal['absolute']:.3g} "
                    f"{signal['unit']}".rstrip()
                    + f", {signal['relative']:.2g} of the largest, {signal['ulp']:.3g} ulp"
                )
    for row in found["targets"]:
        _say(
            f"  {row['target']}: {row['instructions_median']} instructions a step (worst {row['instructions_worst']}), "
            f"{row['text_bytes']} B code, {row['data_bytes'] + row['bss_bytes']} B static data, "
            f"{row['stack_step_bytes']} B stack"
        )
        bound = row["instructions_bound"]
        proved = f"none takes more than {bound}" if bound else f"no bound: {row['instructions_bound_missing']}"
        sought, dearest = row["instructions_climbed_steps"], row["instructions_climbed"]
        _say(f"    {proved}; the dearest of {sought} sought takes {dearest}")
    for name, tools in found["not_installed"].items():
        _say(f"  {name}: not installed here ({', '.join(tools)}); make targets installs it")
    for warning in found["warnings"]:
        _say(f"  warning: {warning}")
    for what, names in (
        ("edited since it was generated", "edited"),
        ("this version writes otherwise", "not_regenerated"),
    ):
        if found[names]:
            _say(f"  {what}: {', '.join(found[names])}")


def _say(text: str) -> None:
    """Print what may hold texts of a package that somebody else made."""
    from casadi_gnc.system.text import terminal

    typer.echo(terminal(text))
