"""The command line: one file a command, errors as one sentence and exit code 2."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Callable
from functools import wraps
from typing import Any

import typer

from casadi_gnc.cli import (
    allocate,
    attainable,
    bench,
    campaign,
    catalogue,
    check,
    demo,
    doctor,
    falsify,
    fly,
    generate,
    margins,
    new,
    problems,
    report,
    reproduce,
    schema,
    synthesize,
    tune,
    verify,
)
from casadi_gnc.errors import GncError

# Matrices here are small: threads of the linear algebra wait for each other longer than they work, a hundredfold on a
# machine that has other work, and add in another order with their number. Read when NumPy is first imported.
for _variable in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")


def _about_its_file(command: Callable[..., None]) -> Callable[..., None]:
    """Return a command that names its problem file in whatever is wrong."""

    @wraps(command)
    def named(*arguments: Any, **options: Any) -> None:
        from casadi_gnc.problem_files.boundary import about

        with about(options["problem"]):
            command(*arguments, **options)

    return named


app = typer.Typer(
    name="casadi-gnc",
    help="Spacecraft guidance, navigation and control: from a problem file to flight C, with proof.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
app.command("demo")(demo.demo)
app.command("fly")(_about_its_file(fly.fly))
app.command("campaign")(campaign.campaign)
app.command("falsify")(_about_its_file(falsify.falsify))
app.command("check")(check.check)
app.command("margins")(_about_its_file(margins.margins))
app.command("tune")(_about_its_file(tune.tune))
app.command("allocate")(_about_its_file(allocate.allocate))
app.command("attainable")(_about_its_file(attainable.attainable))
app.command("synthesize")(synthesize.synthesize)
app.command("generate")(_about_its_file(generate.generate))
app.command("verify")(verify.verify)
app.command("report")(report.report)
app.add_typer(bench.app, name="bench")
app.add_typer(problems.app, name="problems")
app.command("reproduce")(reproduce.reproduce)
app.command("new")(new.new)
app.command("laws")(catalogue.laws)
app.command("crafts")(catalogue.crafts)
app.command("schema")(schema.schema)
app.command("doctor")(doctor.doctor)


def main() -> None:
    """Run the command line; turn what a user can put right into one sentence on stderr."""
    # A terminal that lacks a letter gets its number, not a traceback.
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    _say_what_code_runs()
    try:
        app()
        sys.stdout.flush()
    except GncError as error:
        _end(f"casadi-gnc: {error}", 2)
    except SystemExit as ended:
        if not isinstance(ended.__context__, BrokenPipeError):
            raise
        _silence()  # whoever read the answers has enough of them
        sys.exit(0)
    except KeyboardInterrupt:
        _end("casadi-gnc: interrupted; files already complete were kept", 130)
    except BrokenPipeError:
        _silence()
        sys.exit(0)
    except OSError as error:
        _silence()
        what = f"the output {error.filename!r}" if error.filename else "the output"
        _end(f"casadi-gnc: cannot write {what}: {error.strerror or error}", 2)


def _say_what_code_runs() -> None:
    """Print on stderr which file of the user's own code is run, before it is."""
    import logging

    handler = logging.StreamHandler()
    handler.setFormatter(logging.Formatter("casadi-gnc: %(message)s"))
    logger = logging.getLogger("casadi_gnc")
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)


def _end(sentence: str, code: int) -> None:
    from casadi_gnc.system.text import terminal
    from casadi_gnc.tables.wording import LONGEST, cut

    lines = (cut(line, LONGEST) for line in terminal(sentence).split("\n"))
    print("\n".join(lines), file=sys.stderr)  # noqa: T201
    sys.exit(code)


def _silence() -> None:
    """Point stdout elsewhere, so that the interpreter's last flush of a lost reader is quiet."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


if __name__ == "__main__":
    main()
