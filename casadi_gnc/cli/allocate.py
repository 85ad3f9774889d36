"""`casadi-gnc allocate`: commands in, certified forces out; from a table or line by line."""

from __future__ import annotations

import io
import sys
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from casadi_gnc.cli import completing
from casadi_gnc.cli.progress import is_silenced

if TYPE_CHECKING:
    from casadi_gnc.problem_files.allocating import CaseAllocator, Tally


class AccuracyChoice(str, Enum):
    """To which gap an answer counts as certified."""

    low = "low"
    mid = "mid"
    high = "high"


def allocate(
    problem: Annotated[
        str,
        typer.Argument(autocompletion=completing.problems, help="An allocation file, or the name of a shipped one."),
    ],
    commands: Annotated[Path | None, typer.Option(help="CSV with columns u1, u2, ...: one command a row.")] = None,
    backend: Annotated[str, typer.Option(help="online, clarabel, sdp, ipopt, scs, pinv, ...")] = "online",
    out: Annotated[Path | None, typer.Option(help="CSV of the answers; standard output if left out.")] = None,
    accuracy: Annotated[AccuracyChoice, typer.Option(help="Gap at which an answer is certified.")] = AccuracyChoice.mid,
    stream: Annotated[bool, typer.Option("--stream", help="One command a line in, one answer a line out.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Summary (with --stream: every answer) as JSON.")] = False,
) -> None:
    """Allocate commands to actuators, each answer with its certificate."""
    from casadi_gnc.errors import AllocationError
    from casadi_gnc.problem_files import allocating
    from casadi_gnc.problem_files.allocation_file import load_allocation

    case = load_allocation(problem)
    if stream == (commands is not None):
        raise AllocationError("give either --commands FILE or --stream")
    for warning in case.warnings:
        typer.echo(f"warning: {warning}", err=True)
    allocator = allocating.CaseAllocator(case, backend, accuracy.value)
    tally = allocating.Tally()
    if stream:
        _stream(allocator, tally, json=json)
        return
    assert commands is not None
    _table(allocator, commands, out, tally)
    _print_summary(tally, as_json=json, to_stderr=out is None)


def _table(allocator: CaseAllocator, commands: Path, out: Path | None, tally: Tally) -> None:
    import csv

    from casadi_gnc.problem_files import allocating
    from casadi_gnc.system.files import prepare_folder, write_beside

    rows, count = len(allocator.case.row_scale), allocator.case.problem.count
    wanted = allocating.read_commands(commands, rows)
    if out is not None:
        prepare_folder(out.parent)
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    linear = allocator.case.least_propellant
    writer.writerow(allocating.header(count, rows, 0 if linear is None else linear.level_count))
    for answer in allocating.allocate_all(allocator, wanted, tally):
        writer.writerow(allocating.row_of(answer))
    if out is None:
        typer.echo(text.getvalue(), nl=False)
    else:
        write_beside(out, lambda path: path.write_text(text.getvalue(), encoding="utf-8"))


def _stream(allocator: CaseAllocator, tally: Tally, *, json: bool) -> None:
    """Answer line by line, each flushed; a bad line gets an error line and the stream goes on."""
    import json as encoder

    from casadi_gnc.problem_files import allocating

    allocator.load_all()
    rows = len(allocator.case.row_scale)
    names = ",".join(f"u{i}" for i in range(1, rows + 1))

    for stream in (sys.stdin, sys.stdout):  # a byte that is no text must not end the stream
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(encoding="utf-8", errors="replace")

    def say(line: str) -> None:
        sys.stdout.write(line + "\n")
        sys.stdout.flush()

    try:
        for number, line in enumerate(sys.stdin, 1):
            if not line.strip() or (number == 1 and line.strip().lstrip("\ufeff") == names):
                continue
            try:
                command = allocating.parse_line(line, rows)
            except ValueError as error:
                tally.malformed += 1
                told = f"line {number}: {error}"
                say(encoder.dumps({"error": told}) if json else f"error,{told}")
                continue
            answer = allocator.solve(command)
            tally.add(answer)
            if json:
                say(encoder.dumps(allocating.as_data(answer)))
            else:
                say(",".join(str(entry) for entry in allocating.row_of(answer)))
    finally:
        _print_summary(tally, as_json=json, to_stderr=True)


def _print_summary(tally: Tally, *, as_json: bool, to_stderr: bool) -> None:
    import json as encoder

    found: dict[str, Any] = tally.summary()
    if as_json:
        typer.echo(encoder.dumps(found), err=to_stderr)
        return
    if is_silenced():
        return
    statuses = ", ".join(f"{count} {name}" for name, count in found["statuses"].items()) or "no answers"
    latency = ", ".join(f"{name.removesuffix('_us')} {value:g}" for name, value in found["latency"].items())
    malformed = f"; {tally.malformed} malformed lines" if tally.malformed else ""
    gap = "" if tally.worst_gap is None else f"; largest relative gap {tally.worst_gap:.2g}"
    typer.echo(f"{statuses}{malformed}{gap}", err=to_stderr)
    if latency:
        typer.echo(f"latency [us]: {latency}", err=to_stderr)
