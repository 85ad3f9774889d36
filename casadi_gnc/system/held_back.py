"""Hold back what a library prints on the descriptor of standard error, which no stream of Python sees."""

from __future__ import annotations

import contextlib
import os
import sys
import tempfile
import threading
from collections.abc import Iterator

_STDERR = 2
#: A descriptor belongs to the process: one thread at a time may point it elsewhere.
_ONE = threading.RLock()


class Held:
    """What was printed; it is printed after all unless `drop` is called."""

    dropped = False

    def drop(self) -> None:
        """Let nobody see it."""
        self.dropped = True


@contextlib.contextmanager
def standard_error() -> Iterator[Held]:
    """Point the descriptor of standard error at a temporary file for a while; where there is none, do nothing."""
    held = Held()
    with _ONE, contextlib.ExitStack() as stack:
        try:
            kept = stack.enter_context(tempfile.TemporaryFile())
            before = os.dup(_STDERR)
        except OSError:  # it is closed, or no temporary file can be made
            yield held
            return
        stack.callback(os.close, before)
        if sys.stderr is not None:
            sys.stderr.flush()
        os.dup2(kept.fileno(), _STDERR)
        try:
            yield held
        finally:
            os.dup2(before, _STDERR)
            kept.seek(0)
            if not held.dropped and (told := kept.read()):
                with contextlib.suppress(OSError):
                    os.write(_STDERR, told)
