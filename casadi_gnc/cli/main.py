"""The command line: one file a command, errors as one sentence and exit code 2."""

from __future__ import annotations

import sys

import typer

from casadi_gnc.cli import doctor, fly, problems, schema
from casadi_gnc.errors import GncError

app = typer.Typer(
    name="casadi-gnc",
    help="Spacecraft guidance, navigation and control: from a problem file to flight C, with proof.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
app.command("fly")(fly.fly)
app.add_typer(problems.app, name="problems")
app.command("schema")(schema.schema)
app.command("doctor")(doctor.doctor)


def main() -> None:
    """Run the command line; turn what a user can put right into one sentence on stderr."""
    try:
        app()
    except GncError as error:
        print(f"casadi-gnc: {error}", file=sys.stderr)  # noqa: T201
        sys.exit(2)
    except KeyboardInterrupt:
        print("casadi-gnc: interrupted; files already complete were kept", file=sys.stderr)  # noqa: T201
        sys.exit(130)
    except BrokenPipeError:
        # The reader went away; point stdout elsewhere so that the interpreter's last flush is quiet.
        sys.stdout = None
        sys.exit(0)


if __name__ == "__main__":
    main()
