"""What the package of a function does with faults: what it adds to the state, and what its C says.

The C is that of missions (`codegen/templates/fault_handling.j2`). A step that is refused holds all outputs, so there is
one age for them together; safe mode tells numbers as outputs, and the function's state goes on beneath.
"""

from __future__ import annotations

from typing import Any

from casadi_gnc.embedded import fault_source
from casadi_gnc.embedded.controller import Options
from casadi_gnc.embedded.dictionary import Entry, entries
from casadi_gnc.embedded.flight_function import HELD, TAKEN, FlightFunction
from casadi_gnc.embedded.members import access


def added(own: FlightFunction) -> list[Entry]:
    """Return what the options add to the state."""
    if own.faults is None:
        return []
    refused = ("refused", "of them that were refused")
    return list(fault_source.added(own.faults, _counted(own), refused))


def _counted(own: FlightFunction) -> list[str]:
    """Return the names of the bits that are counted: those of steps of an initialised state, and of old outputs."""
    return [name for bit, (name, _) in own.statuses.items() if bit & TAKEN or name == "MEASUREMENT_STALE"]


def header(own: FlightFunction, options: Options) -> dict[str, Any]:
    """Return what header and source say of the options."""
    if own.faults is None:
        return {"groups": {}, "faults": None, "image": None}
    image = None
    if own.faults.image:
        state = [*entries(own.state, "memory."), *entries(own.outputs, "last."), *added(own)]
        state.append(Entry("ready", "ready", 1, "uint32", "", ""))
        about = [own.title, own.function.name(), str(own.period), options.real]
        image = fault_source.image_of(state, about, options.real)
    places = access(own.outputs, "output->")
    faults = {
        "own": own.faults,
        "held": [{"name": name, "most": most, "same": ["taken"]} for name, most in own.faults.ages],
        "looked_at": "gnc_flag taken",
        "counted": _counted(own),
        "lost": {"member": "refused", "bits": f"{HELD}u"},
        "iterations": False,
        "timed": False,
        "actuators": 0,
        "told": f"{options.name}_output *output",
        "lines": [
            f"{place} = {options.constant(value)};" for place, value in zip(places, own.faults.safe or (), strict=False)
        ],
        "refusals": f"{HELD}u",
        "image": image,
    }
    return {"groups": fault_source.groups(added(own)), "faults": faults, "image": image}
