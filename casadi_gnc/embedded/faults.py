"""What a package does with faults beside telling them: options, of which each adds nothing where it is off.

==============  ===================================================================================================
count           steps, replaced measurements, most iterations; for each bit of the status, steps in a row with it
latch           time, step and status of the first failure, until it is acknowledged
ages            steps for which a measurement may be held; a bit where it is held for longer
safe            what the actuators are told after failures in a row, or where a measurement is too old
fade            steps in which the effort moves from that of the old gains to that of the new ones
image           the state as octets, to be stored, sent and taken back
==============  ===================================================================================================

A failure is a step whose status has one of the bits `failures`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

STALE, SAFE_MODE, LATCHED, FADING = 1 << 20, 1 << 21, 1 << 22, 1 << 23
_BITS = {
    STALE: ("MEASUREMENT_STALE", "A measurement was held for longer than its age limit."),
    SAFE_MODE: ("SAFE_MODE", "The actuators were told the safe output, as near as their bounds allow."),
    LATCHED: ("FAILURE_LATCHED", "There was a failure since the reset or the last acknowledgement; the first is kept."),
    FADING: ("GAINS_FADING", "Gains were changed: the effort still moves from that of the old ones."),
}


@dataclass(frozen=True)
class Faults:
    """Say what a package does with faults.

    Parameters
    ----------
    failures : bits of the status that make a failure.
    count, latch, image : whether there are counters, a latch of the first failure, a state as octets.
    ages : measured signals that may be held so many steps and no longer.
    safe : what the actuators are told in safe mode, one number each; () for what they were told last; None for no
        such mode.
    safe_after : failures in a row that begin it, 0 where only old measurements do.
    release_after : steps without failure that end it, 0 where only an acknowledgement does.
    fade : steps in which new gains take over, 0 for at once.
    """

    failures: int = 0
    count: bool = False
    latch: bool = False
    ages: tuple[tuple[str, int], ...] = ()
    safe: tuple[float, ...] | None = None
    safe_after: int = 0
    release_after: int = 0
    fade: int = 0
    image: bool = False

    @classmethod
    def from_data(cls, data: dict[str, Any]) -> Faults:
        """Return the options of plain data, as `dataclasses.asdict` gives them and JSON keeps them."""
        ages = tuple((str(name), int(most)) for name, most in data["ages"])
        safe = None if data["safe"] is None else tuple(float(value) for value in data["safe"])
        return cls(**{**data, "ages": ages, "safe": safe})

    @property
    def statuses(self) -> dict[int, tuple[str, str]]:
        """The bits that these options raise."""
        on = {STALE: self.ages, SAFE_MODE: self.safe is not None, LATCHED: self.latch, FADING: self.fade}
        return {bit: told for bit, told in _BITS.items() if on[bit]}

    @property
    def is_acknowledged(self) -> bool:
        """Whether there is something that an acknowledgement ends."""
        return self.latch or self.safe is not None
