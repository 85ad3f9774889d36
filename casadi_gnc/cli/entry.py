"""Where `casadi-gnc` begins: Ctrl-C is one sentence from here on, also while the command is still being imported.

An interrupt inside an import may surface as another error: of an extension module that could not be set up, or of a
library that wraps whatever goes wrong. So it is remembered, and what comes after it counts as its consequence.
"""

from __future__ import annotations

import signal
import sys
from typing import Any, NoReturn

#: Exit code of what Ctrl-C ended.
INTERRUPTED = 130


def main() -> None:
    """Run the command line."""
    interrupts: list[int] = []

    def interrupted(number: int, _: Any) -> NoReturn:
        interrupts.append(number)
        raise KeyboardInterrupt

    # Who starts it in the background has SIGINT ignored, which stays so.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, interrupted)
    try:
        from casadi_gnc.cli.main import main as run

        run()
    except BaseException as error:
        # A command that ends in its own way after an interrupt, a server that is told to stop, keeps its exit code.
        if not interrupts or (isinstance(error, SystemExit) and error.code != INTERRUPTED):
            raise
        sys.stderr.write("casadi-gnc: interrupted; files already complete were kept\n")
        raise SystemExit(INTERRUPTED) from None
