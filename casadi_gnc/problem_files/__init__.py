"""Problem files: find, check, build, change, sweep; missions, allocations and syntheses.

Names are imported when they are first used: who reads a mission waits for no solver of matrix inequalities.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from casadi_gnc.problem_files.allocation_file import load_allocation
    from casadi_gnc.problem_files.by_name import check, fly, fly_all, mission_of
    from casadi_gnc.problem_files.checking import check_file
    from casadi_gnc.problem_files.document import Document, read, shipped
    from casadi_gnc.problem_files.loading import load, load_document
    from casadi_gnc.problem_files.sweeping import load_sweeps
    from casadi_gnc.problem_files.synthesis_file import load_synthesis, synthesize
    from casadi_gnc.problem_files.synthesis_recipes import Recipe

#: Where each name lives.
_HOMES = {
    "Document": "document",
    "Recipe": "synthesis_recipes",
    "check": "by_name",
    "check_file": "checking",
    "fly": "by_name",
    "fly_all": "by_name",
    "load": "loading",
    "load_allocation": "allocation_file",
    "load_document": "loading",
    "load_sweeps": "sweeping",
    "load_synthesis": "synthesis_file",
    "mission_of": "by_name",
    "read": "document",
    "shipped": "document",
    "synthesize": "synthesis_file",
}

__all__ = [
    "Document",
    "Recipe",
    "check",
    "check_file",
    "fly",
    "fly_all",
    "load",
    "load_allocation",
    "load_document",
    "load_sweeps",
    "load_synthesis",
    "mission_of",
    "read",
    "shipped",
    "synthesize",
]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = found
    return found
