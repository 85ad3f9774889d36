"""Pulses of a satellite's thrusters, a key of [[thruster]], and the rules of their valves: [valves]."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from casadi_gnc.allocation.joint_pulses import JointPulses
from casadi_gnc.allocation.pulses import Pulse, PulseModulation, Valves
from casadi_gnc.errors import AllocationError
from casadi_gnc.mathematics.exact import is_number
from casadi_gnc.tables.part import MisfitError, NonNegative, Part

if TYPE_CHECKING:
    from .part_tables import ThrusterTable


class PulseTable(Part):
    """Pulses of a thruster that knows on and off alone: one a sample, its width from what is asked of it."""

    least_on_s: NonNegative = Field(default=0.0, description="least width of a pulse")
    quantum_s: NonNegative = Field(default=0.0, description="least difference of two widths; 0: any width")
    delay_s: NonNegative = Field(default=0.0, description="from the sample to the pulse, less than a sample period")
    carry: bool = Field(default=True, description="what a pulse lacks is carried over to the next (sigma-delta)")


class ValveTable(Part):
    """Which valves of thrusters that make pulses may be open together, and how their pulses are chosen."""

    never_together: list[Annotated[list[Annotated[int, Field(ge=1)]], Field(min_length=2, max_length=2)]] = Field(
        default=[], max_length=64, description="pairs of thrusters, counted from 1, that never open in the same sample"
    )
    open_at_most: Annotated[int, Field(ge=1)] | None = Field(
        default=None, description="so many valves in one sample, those of the largest impulses due"
    )
    choice: Literal["each", "together"] = Field(
        default="each",
        description="each: what each thruster is asked for is rounded; together: the cheapest pulses make the torque",
    )

    def check(self, thrusters: Sequence[ThrusterTable]) -> None:
        """Raise `MisfitError` where the rules are none for these thrusters."""
        if not any(each.pulse is not None for each in thrusters):
            raise MisfitError("no thruster makes pulses, and the rules are for those; give one a pulse", "valves")
        for first, second in self.never_together:
            if first == second:
                raise MisfitError(f"thruster {first} is paired with itself; give two", "valves", "never_together")
            for number in (first, second):
                if number > len(thrusters) or thrusters[number - 1].pulse is None:
                    why = "makes no pulses" if number <= len(thrusters) else f"is not one of {len(thrusters)}"
                    raise MisfitError(f"thruster {number} {why}; give two that make pulses", "valves", "never_together")


def modulation(
    between: int, tables: Sequence[ThrusterTable], after: int, valves: ValveTable | None = None, torques: Any = None
) -> PulseModulation | None:
    """Return what makes pulses of what is asked of thrusters, between other actuators; None where none makes any.

    Parameters
    ----------
    between, after : how many actuators are told before the thrusters, and after them.
    tables : of the thrusters.
    valves : which may be open together, and how pulses are chosen.
    torques : of each thruster per force, (3, N); looked at where pulses are chosen together.
    """
    if all(table.pulse is None for table in tables):
        return None
    made = [
        None if pulse is None else Pulse(pulse.least_on_s, pulse.quantum_s, pulse.carry)
        for pulse in (table.pulse for table in tables)
    ]
    none = [None] * between, [None] * after
    pulses, most = (*none[0], *made, *none[1]), [*none[0], *(table.max_force_N for table in tables), *none[1]]
    if valves is None:
        return PulseModulation(pulses, most)
    pairs = tuple((i - 1 + between, j - 1 + between) for i, j in valves.never_together)
    rules = Valves(pairs, valves.open_at_most)
    if valves.choice == "each":
        return PulseModulation(pulses, most, rules)
    places = [i for i, table in enumerate(tables) if table.pulse is not None]
    columns, prices = [tuple(torques[:, i].elements()) for i in places], _prices([tables[i] for i in places])
    try:
        return JointPulses(pulses, most, rules, columns=columns, prices=prices)
    except AllocationError as error:
        raise MisfitError(str(error), "valves", "choice") from None


def _prices(tables: Sequence[ThrusterTable]) -> list[Any]:
    """Return the propellant of an impulse of each, 1 for the dearest; 1 for all where some do not say it."""
    known = [table.specific_impulse_s for table in tables if table.specific_impulse_s is not None]
    if len(known) < len(tables):
        return [1.0] * len(tables)
    return [min(known) / each for each in known] if all(map(is_number, known)) else known
