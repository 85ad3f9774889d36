"""A bar for what takes longer than a second, with the time that is left; on a terminal only."""

from __future__ import annotations

import time
from typing import Any


class Progress:
    """Show how far something is, on stderr; entering gives the function (done, all) that is told.

    Parameters
    ----------
    name : of what is done.
    quiet : show nothing.
    """

    def __init__(self, name: str, *, quiet: bool = False) -> None:
        self._name, self._quiet, self._since, self._bar, self._task = name, quiet, time.monotonic(), None, None

    def __enter__(self) -> Any:
        return self._update

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()

    def _update(self, done: int, total: int) -> None:
        if self._quiet or (self._bar is None and time.monotonic() - self._since < 1.0):
            return
        if self._bar is None:
            from rich.console import Console
            from rich.progress import Progress as Bar

            self._bar = Bar(console=Console(stderr=True), transient=True)  # with the time left, by default
            self._bar.start()
            self._task = self._bar.add_task(self._name, total=total)
        self._bar.update(self._task, completed=done)  # type: ignore[arg-type]
