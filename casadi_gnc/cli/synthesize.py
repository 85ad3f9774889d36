"""`casadi-gnc synthesize`: gains from linear matrix inequalities, certified from the data."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from casadi_gnc.cli import completing
from casadi_gnc.cli.manners import print_json, tell

if TYPE_CHECKING:
    from casadi_gnc.problem_files.synthesis_file import SynthesisCase
    from casadi_gnc.problem_files.synthesis_into import Target

#: Seconds that a synthesis may take unless more is asked for.
TIME_LIMIT = 60.0


def synthesize(
    problem: Annotated[
        str, typer.Argument(autocompletion=completing.problems, help="A synthesis file, or the name of a shipped one.")
    ],
    backend: Annotated[
        str | None,
        typer.Option(help="clarabel, scs, barrier or ./file.py:NAME, instead of the file's; by size if none is named."),
    ] = None,
    time_limit: Annotated[
        float, typer.Option(min=0.0, help="Seconds after which the search ends without an answer; 0: none.")
    ] = TIME_LIMIT,
    into: Annotated[
        Path | None, typer.Option(help="A mission file whose law gets the gains, by their symbols; comments stay.")
    ] = None,
    scheme: Annotated[str | None, typer.Option(help="Of that file; needed where it has several.")] = None,
    json: Annotated[bool, typer.Option("--json", help="Print as JSON.")] = False,
) -> None:
    """Find gains by a recipe and certify them; exit code 1 where there are none that can be used."""
    from casadi_gnc.errors import ProblemError
    from casadi_gnc.problem_files.synthesis_file import answer_of, load_synthesis, out_of_time
    from casadi_gnc.synthesis import backends
    from casadi_gnc.system.processes import within

    if backend is not None:
        backends.module(backend)
    case = load_synthesis(problem)
    target = None
    if into is not None:
        from casadi_gnc.problem_files.synthesis_into import target_of

        target = target_of(into, scheme)
    elif scheme is not None:
        raise ProblemError("--scheme names one of the file that --into names; give --into too")
    try:
        found = within(time_limit, answer_of, problem, backend, told=lambda: _tell(case, backend, time_limit))
    except TimeoutError:
        found = out_of_time(case, backend, time_limit)
    written = "" if target is None or not found["certified"] else _written(target, case, found)
    if json:
        print_json(found)
    else:
        _print(case.title or case.name, found)
        if backend is None and case.backend is None and found["backend"] == "barrier":
            typer.echo("solved by barrier, the faster back end for so many unknowns; --backend takes another")
        if written:
            typer.echo(written)
    if not found["certified"]:
        raise typer.Exit(1)


def _written(target: Target, case: SynthesisCase, found: dict[str, Any]) -> str:
    """Write the gains, note so in what was found, and return what is said of that, with what `check` then finds."""
    from casadi_gnc.checking import check

    mission, paths = target.write(case, found["gains"])
    found["written"] = {"file": str(target.document.path), "keys": paths}
    bad = [each for each in check(mission, target.scheme) if each.verdict in ("warn", "fail")]
    found["written"]["checks"] = {each.name: each.verdict for each in bad}
    told = ", ".join(f"{each.name} ({each.verdict})" for each in bad)
    return f"wrote {', '.join(paths)} into {target.document.path}" + (f"; check finds {told}" if told else "")


def _tell(case: SynthesisCase, backend: str | None, seconds: float) -> None:
    """Say on standard error what takes long."""
    A = getattr(case.recipe, "A", None)
    size = "" if A is None else f" for {len(A)} states"
    given = getattr(case.recipe, "gamma", None) is not None
    verb = "solving with the bound that is given" if given else "looking for gains"
    until = f"; ends after {seconds:g} s (--time-limit)" if seconds else ""
    asked = backend or case.backend
    tell(f"{case.name}: {verb}{size}{'' if asked is None else f' by {asked}'}{until}")


def _print(title: str, found: dict[str, Any]) -> None:
    typer.echo(title)
    typer.echo(f"{found['status']}: {found['sentence']}")
    for name, gain in found["gains"].items():
        if isinstance(gain, float):
            typer.echo(f"{name} = {gain:.6g}")
            continue
        typer.echo(f"{name} =")
        for row in gain:
            typer.echo("  [" + ", ".join(f"{value:.6g}" for value in row) + "]")
    if found.get("norm"):
        typer.echo(f"H-infinity norm: certified {found['promised_norm']:.4g}, true {found['norm']['upper']:.4g}")
    if found.get("h2_norm"):
        typer.echo(f"H2 norm: certified {found['h2_norm']['promised']:.4g}, true {found['h2_norm']['upper']:.4g}")
    if found.get("peak"):
        limit = found["peak"]["limit"]
        asked = "no limit given" if limit is None else f"limit {limit:.4g}"
        bound = found["peak"]["bound"]
        most = "no bound is known" if bound is None else f"at most {bound:.4g}"
        typer.echo(f"peak command from the worst start: {most}, {asked}")
    if found.get("saturation"):
        over = found["saturation"]["command_over_limit"]
        bound = "whatever the commands" if over is None else f"with commands up to {over:.4g} times their limits"
        typer.echo(f"saturation: stable {bound}")
    if found.get("stable_ratios"):
        low, high = found["stable_ratios"]
        typer.echo(f"stable for (assumed mass)/(true mass) {_range(low, high)}")
    if found.get("poles_rad_s"):
        slowest = max(pole[0] for pole in found["poles_rad_s"])
        typer.echo(f"slowest pole: {slowest:.4g} rad/s")
    for name, depth in found.get("pole_depths_rad_s", {}).items():
        typer.echo(f"region of poles {name!r}: kept by {depth:.3g} rad/s")
    for one in found["constraints"]:
        typer.echo(f"  {one['name']}: smallest eigenvalue {one['smallest']:.3g}, asked for {one['margin']:.3g}")


def _range(low: float | None, high: float | None) -> str:
    upper = "without an upper end" if high is None else f"below {high:.4g}"
    return upper if low is None else f"above {low:.4g}, {upper}"
