"""What a mission needs of a craft, each asked for once: answers that are none are told with class and method."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.errors import FlightError
from casadi_gnc.mathematics.exact import array, is_number
from casadi_gnc.missions.actuation import Actuation
from casadi_gnc.missions.asking import ask, column
from casadi_gnc.missions.craft import Craft
from casadi_gnc.missions.plant import Plant
from casadi_gnc.navigation import Navigation
from casadi_gnc.signals import Layout
from casadi_gnc.tables.part import MisfitError, plain


class Parts:
    """Ask a craft for its plant, belief, start and actuation, and look at what it answers."""

    def __init__(self, craft: Craft) -> None:
        self.craft = craft
        self._name = type(craft).__name__

    @cached_property
    def plant(self) -> Plant:
        """The truth; what is no plant is a `GncError`."""
        plant = ask(self.craft, "plant")
        if not isinstance(plant, Plant):
            raise FlightError(f"{self._name}.plant returned a {type(plant).__name__}, expected a casadi_gnc.Plant")
        for name in ("state", "measurement", "inputs", "noise", "outputs"):
            layout = getattr(plant, name, None)
            if layout is None:
                raise FlightError(f"{type(plant).__name__} defines no {name}; give it a casadi_gnc.Layout of that name")
            if not isinstance(layout, Layout):
                raise FlightError(
                    f"{type(plant).__name__}.{name} is a {type(layout).__name__}, expected a casadi_gnc.Layout"
                )
        return plant

    @cached_property
    def belief(self) -> Any:
        """What the flight software believes."""
        return ask(self.craft, "belief")

    @cached_property
    def navigation(self) -> Navigation | None:
        """What laws read, where that is not the measurement; what is no navigation is a `FlightError`."""
        found = ask(self.craft, "navigation")
        if found is None:
            return None
        if not isinstance(found, Navigation):
            told = f"{self._name}.navigation returned a {type(found).__name__}"
            raise FlightError(f"{told}, expected a casadi_gnc.navigation.Navigation or None")
        measured, read = self.plant.measurement, found.inputs.signals
        absent = [one.name for one in read if one.name not in measured or measured.signal(one.name).size != one.size]
        if absent:
            told = f"{self._name}.navigation reads {', '.join(absent)}"
            raise FlightError(f"{told}, and the sensors give {', '.join(measured.names)}")
        return found

    @property
    def readable(self) -> Layout:
        """The signals that a law may read."""
        return self.plant.measurement if self.navigation is None else self.navigation.signals

    @cached_property
    def start(self) -> Mapping[str, Sequence[float]]:
        """The state at t = 0 by signal; one that is not the plant's is a `FlightError`."""
        name, start, state = f"{self._name}.start", ask(self.craft, "start"), self.plant.state
        if not isinstance(start, Mapping):
            raise FlightError(
                f"{name} returned a {type(start).__name__}, expected numbers by signal of the plant's state"
            )
        if set(start) != set(state.names):
            told = f"gives {', '.join(start) or 'nothing'}, and the plant's state is {', '.join(state.names)}"
            raise FlightError(f"{name} {told}; give each of them, and nothing else")
        for signal in state.signals:
            try:
                numbers = array(plain(start[signal.name]))
            except (TypeError, ValueError, NotImplementedError):
                raise FlightError(f"{name} gives {start[signal.name]!r} for {signal.name}, expected numbers") from None
            if numbers.numel() != signal.size:
                raise FlightError(f"{name} gives {numbers.numel()} numbers of {signal.name}, expected {signal.size}")
            if is_number(numbers) and not np.isfinite(np.array(numbers)).all():
                raise FlightError(f"{name} gives a number of {signal.name} that is not finite")
        return start

    @cached_property
    def measured(self) -> list[float]:
        """What perfect sensors say of the start, in the plant's order."""
        x = ca.vertcat(*(ca.DM(self.start[name]) for name in self.plant.state.names))
        told = ask(self.plant, "measure", 0.0, x, ca.DM.zeros(self.plant.noise.size))
        seen = column(self.plant, "measure", told, self.plant.measurement)
        return list(np.array(ca.DM(seen)).ravel())

    def incredible(self) -> Iterator[MisfitError]:
        """Yield starts that the sensors could not measure: a controller has no good value before them."""
        layout = self.plant.measurement
        for signal in layout.signals:
            largest = max((abs(value) for value in self.measured[layout.place(signal.name)]), default=0.0)
            if largest > signal.limit:
                message = f"{largest:g} is beyond the largest credible {signal.name}, {signal.limit:g}"
                yield MisfitError(message, *self.craft.key_of(signal.name))

    def actuation(self, keys: Any) -> Actuation:
        """Return how a scheme with these keys makes efforts; what fits no key is a `MisfitError` as it was raised."""
        try:
            made = self.craft.actuation(keys)
        except MisfitError:
            raise
        except Exception:
            made = ask(self.craft, "actuation", keys)  # once more, to be told in one sentence
        if not isinstance(made, Actuation):
            told = f"{self._name}.actuation returned a {type(made).__name__}"
            raise FlightError(f"{told}, expected a casadi_gnc.Actuation")
        return made
