"""Named computations that answer claims which no flight answers: numbers from numbers.

A module of this room is a paper, or the flights of one; its public functions take plain data and return a float. A
computation's name in a claims file is `module.function`.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from importlib import import_module

__all__ = ["COMPUTATIONS"]

_MODULES = ("huang2019", "huang2020", "shi2020", "shi2020_docking", "sun2018", "tao2019")


def _collect() -> dict[str, Callable[..., float]]:
    found: dict[str, Callable[..., float]] = {}
    for origin in _MODULES:
        module = import_module(f"{__name__}.{origin}")
        for name, function in inspect.getmembers(module, inspect.isfunction):
            if not name.startswith("_") and function.__module__ == module.__name__:
                found[f"{origin}.{name}"] = function
    return found


#: Computations by their name in a claims file.
COMPUTATIONS = _collect()
