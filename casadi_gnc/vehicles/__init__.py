"""The craft that are shipped: a folder each, with plant, tables, craft and checks; copyable outside as a template.

A craft's folder has

* `plant.py`: the truth, a `casadi_gnc.Plant`;
* `tables.py`: the tables of a file that no other craft has;
* `craft.py`: the `casadi_gnc.Craft`, made of its tables;
* `checks.py`, where there is more to say before it flies than for every craft.
"""

from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from casadi_gnc.vehicles import (
        combined_spacecraft,
        docking_pair,
        drag_free_pair,
        proximity_pair,
        satellite,
        wheel_spacecraft,
    )

__all__ = ["combined_spacecraft", "docking_pair", "drag_free_pair", "proximity_pair", "satellite", "wheel_spacecraft"]


def __getattr__(name: str) -> ModuleType:
    """Import a craft when it is first asked for: who flies one does not wait for the others."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return import_module(f"{__name__}.{name}")
