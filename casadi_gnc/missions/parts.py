"""What a mission needs of a craft, asked for in one place: answers that are none are told with class and method."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from casadi_gnc.errors import FlightError
from casadi_gnc.missions.actuation import Actuation
from casadi_gnc.missions.asking import ask
from casadi_gnc.missions.craft import Craft
from casadi_gnc.missions.plant import Plant
from casadi_gnc.signals import Layout


def plant_of(craft: Craft) -> Plant:
    """Return the truth; raise `GncError` for what is no plant."""
    plant = ask(craft, "plant")
    if not isinstance(plant, Plant):
        raise FlightError(f"{_name(craft)}.plant returned a {type(plant).__name__}, expected a casadi_gnc.Plant")
    for column in ("state", "measurement", "inputs", "noise", "outputs"):
        layout = getattr(plant, column, None)
        if layout is None:
            raise FlightError(f"{type(plant).__name__} defines no {column}; give it a casadi_gnc.Layout of that name")
        if not isinstance(layout, Layout):
            raise FlightError(
                f"{type(plant).__name__}.{column} is a {type(layout).__name__}, expected a casadi_gnc.Layout"
            )
    return plant


def start_of(craft: Craft, plant: Plant) -> Mapping[str, Sequence[float]]:
    """Return the state at t = 0 by signal; raise `FlightError` where it is not that of the plant."""
    name, start = _name(craft), ask(craft, "start")
    if not isinstance(start, Mapping):
        raise FlightError(
            f"{name}.start returned a {type(start).__name__}, expected numbers by signal of the plant's state"
        )
    if set(start) != set(plant.state.names):
        told = f"gives {', '.join(start) or 'nothing'}, and the plant's state is {', '.join(plant.state.names)}"
        raise FlightError(f"{name}.start {told}; give each of them, and nothing else")
    for signal in plant.state.signals:
        try:
            numbers = np.asarray(start[signal.name], dtype=float).ravel()
        except (TypeError, ValueError):
            raise FlightError(
                f"{name}.start gives {start[signal.name]!r} for {signal.name}, expected numbers"
            ) from None
        if numbers.size != signal.size:
            raise FlightError(f"{name}.start gives {numbers.size} numbers of {signal.name}, expected {signal.size}")
        if not np.isfinite(numbers).all():
            raise FlightError(f"{name}.start gives a number of {signal.name} that is not finite")
    return start


def belief_of(craft: Craft) -> Any:
    """Return what the flight software believes."""
    return ask(craft, "belief")


def actuation_of(craft: Craft, keys: Any) -> Actuation:
    """Return how a scheme with these keys makes efforts; what fits no key is a `MisfitError` as the craft raised it."""
    from casadi_gnc.tables.part import MisfitError

    try:
        made = craft.actuation(keys)
    except MisfitError:
        raise
    except Exception:
        made = ask(craft, "actuation", keys)  # once more, to be told in one sentence
    if not isinstance(made, Actuation):
        raise FlightError(f"{_name(craft)}.actuation returned a {type(made).__name__}, expected a casadi_gnc.Actuation")
    return made


def _name(craft: Craft) -> str:
    return type(craft).__name__
