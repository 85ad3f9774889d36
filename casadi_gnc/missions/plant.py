"""What every plant is: a named state, what is measured of it, and how it moves.

Noise is an argument, not a call: an engine draws standard normal numbers for every sample (see
`casadi_gnc.mathematics.noise`) and holds them over it, so that a plant stays a pure function and every engine
sees the same numbers.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from casadi_gnc.signals import Layout
from casadi_gnc.status import StepStatus


class Plant:
    """Base of all plants; a subclass is a frozen dataclass of its physical data.

    It names its columns (`state`, `measurement`, `inputs`, `noise`, `outputs`) and gives pure functions of
    CasADi symbols. `rate` must be given; the others have defaults: perfect sensors, no noise. They take t, the time
    [s]; x, the state; actuators, what those are told, a column of `inputs`; noise, the numbers of `noise`.
    """

    #: What the plant remembers, a `Layout`; an attribute, or a property where it depends on the data. Must be given.
    state: Any
    #: What the sensors give, a `Layout`; `limit` of a signal is the largest magnitude that can be true. Must be given.
    measurement: Any
    #: What the actuators are told, a `Layout`. Must be given.
    inputs: Any
    #: Standard normal numbers, drawn afresh and held, that `measure` and `rate` scale.
    noise: Any = Layout()
    #: True signals that are recorded besides the state.
    outputs: Any = Layout()

    def timed(self, hold: float, step: float) -> Plant:
        """Return the plant as sampled every `hold` seconds and integrated by `step`; both 0 in continuous flight.

        Sensors and pulses may need them.
        """
        return self

    def averaged(self) -> Plant:
        """Return the plant as linear analysis takes it, with the same state: a command acts at once, by its mean."""
        return self

    def inertias(self) -> Mapping[str, Any]:
        """Return the inertias, (3, 3), [kg m^2], of the bodies that the plant moves, by what each is of."""
        return {}

    def measure(self, t: Any, x: Any, noise: Any) -> Any:
        """Return what the sensors say at time t [s], a column of `measurement`: the state itself."""
        return x

    def rate(self, t: Any, x: Any, actuators: Any, noise: Any) -> Any:
        """Return x', a column of `state`."""
        raise TypeError(f"{type(self).__name__} defines no rate")

    def settle(self, x: Any) -> Any:
        """Return the same physical state in the representation kept between steps."""
        return x

    def show(self, t: Any, x: Any, actuators: Any) -> dict[str, Any]:
        """Return the signals of `outputs`."""
        return {}

    def status(self, t: Any, x: Any, actuators: Any) -> dict[StepStatus, Any]:
        """Return flags (0 or 1 expressions) by status bit: what truly happened, seen from outside."""
        return {}
