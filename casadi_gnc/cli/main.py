"""The command line: one file a command, errors as one sentence and exit code 2."""

from __future__ import annotations

import gc
import io
import os
import sys

from casadi_gnc.cli.commands import app
from casadi_gnc.errors import GncError

# Matrices here are small: threads of the linear algebra wait for each other longer than they work, a hundredfold on a
# machine that has other work, and add in another order with their number. Read when NumPy is first imported.
for _variable in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

# Modules and expressions are built by the ten thousand and stay: looking through them for garbage every 700 objects, as
# Python does, is a twentieth of a short command.
gc.set_threshold(50_000, 20, 50)


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
