"""What of a satellite does not fit the times of a flight: field, sensors, what swings, tables of references."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from casadi_gnc.errors import FlightError
from casadi_gnc.mechanics.sensor import Sensor
from casadi_gnc.missions.timing import Timing
from casadi_gnc.tables.part import MisfitError

from .budgets import tables_of

if TYPE_CHECKING:
    from .craft import SatelliteCraft


def misfits(craft: SatelliteCraft, sensors: Sequence[Sensor], timing: Timing, *, strict: bool) -> Iterator[MisfitError]:
    """Yield a field at a time that it is not known for, and sensors that do not fit the sample period, or have none.

    If strict, also modes and liquids above the sampling frequency, and tables of a reference that end early.
    """
    if craft.field is not None and craft.orbit is not None and craft.orbit.when() is not None:
        try:
            craft.magnetic_field()
        except MisfitError as error:
            yield error
    for i, sensor in enumerate(sensors):
        if timing.mode != "sampled":
            yield MisfitError(f"{sensor.name} is a sensor that is sampled; fly in mode sampled", "sensor", i, "kind")
            continue
        try:
            replace(sensor, hold=timing.sample_period)
        except FlightError as error:
            yield MisfitError(str(error), "sensor", i, "period_s")
    if not strict:
        return
    swings = {"flexible_mode": craft.flexible_mode, "slosh": craft.slosh}
    for kind, i, each in ((kind, i, each) for kind, tables in swings.items() for i, each in enumerate(tables)):
        if timing.mode == "sampled" and each.frequency_Hz * timing.sample_period > 1:
            told = f"{each.frequency_Hz:g} Hz is above the sampling frequency, {1 / timing.sample_period:g} Hz"
            yield MisfitError(f"{told}; sample faster, or leave it out", kind, i, "frequency_Hz")
    for i, (last, needed) in tables_of(craft, timing.duration).items():
        if last < needed:
            told = f"the table ends at {last:g} s and is needed until {needed:g} s"
            yield MisfitError(f"{told}; give later rows, or another [[reference]] from then on", "reference", i)
