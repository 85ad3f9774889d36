"""A bar for what takes longer than a second, with the time that is left; on a terminal only."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Iterator
from contextvars import ContextVar
from typing import Any

_SILENCED: ContextVar[bool] = ContextVar("silenced", default=False)


def is_silenced() -> bool:
    """Return whether nothing is to be told that is not a warning."""
    return _SILENCED.get()


@contextlib.contextmanager
def silenced() -> Iterator[None]:
    """Show no bars inside."""
    token = _SILENCED.set(True)
    try:
        yield
    finally:
        _SILENCED.reset(token)


class Progress:
    """Show how far something is, on stderr; entering gives the function (done, all, what is done now) that is told.

    Parameters
    ----------
    name : of what is done.
    quiet : show nothing.
    """

    def __init__(self, name: str, *, quiet: bool = False) -> None:
        self._name, self._quiet = name, quiet or is_silenced()
        self._since, self._bar, self._task = time.monotonic(), None, None

    def __enter__(self) -> Any:
        return self._update

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()

    def _update(self, done: int, total: int, what: str | None = None) -> None:
        if self._quiet or (self._bar is None and time.monotonic() - self._since < 1.0):
            return
        if self._bar is None:
            from rich.console import Console
            from rich.progress import Progress as Bar

            console = Console(stderr=True)
            if not console.is_terminal:
                self._quiet = True
                return
            self._bar = Bar(console=console, transient=True)  # with the time left, by default
            self._bar.start()
            self._task = self._bar.add_task(self._name, total=total)
        self._bar.update(self._task, completed=done, description=what or self._name)  # type: ignore[arg-type]


@contextlib.contextmanager
def working(what: str) -> Iterator[None]:
    """Show on a terminal that something runs, and for how long it has, where nobody knows how long it will."""
    if is_silenced():
        yield
        return
    shown: list[Any] = []
    is_over = threading.Event()

    def show() -> None:
        if is_over.wait(1.0):
            return
        from rich.console import Console
        from rich.progress import Progress as Bar
        from rich.progress import SpinnerColumn, TextColumn, TimeElapsedColumn

        console = Console(stderr=True)
        if console.is_terminal:
            bar = Bar(
                SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn(), console=console, transient=True
            )
            bar.add_task(what)
            bar.start()
            shown.append(bar)

    teller = threading.Thread(target=show, daemon=True)
    teller.start()
    try:
        yield
    finally:
        is_over.set()
        teller.join()
        for bar in shown:
            bar.stop()
