"""Status words of a controller step. Each member carries the sentence its reader sees."""

from __future__ import annotations

from enum import IntFlag

_SENTENCES = {
    1: "A measurement was not finite or out of range; the last good one was used.",
    2: "The law asked for more than the virtual-control limit; the command was clipped.",
    4: "The tracked signal left its funnel; the law can no longer promise its performance.",
    8: "The actuators could not make the limited command; more than 5 % of the limit was missing.",
    16: "The allocation could not be certified to its tolerance; the best feasible forces were used.",
    32: "The allocation found no usable answer; the previous forces were kept inside the box.",
    64: "The simulated state is no longer finite or credible; the flight's metrics mean nothing.",
    128: "The law's memory was no longer finite or credible; it was started afresh.",
    256: "The law's command was not finite; none was given on that axis.",
    512: "The craft was inside the keep-out sphere of its target.",
    1024: "The actuators' map was nearly singular; some effort takes very large commands or was given up.",
    2048: "The craft were too close for the actuator's far-field model; its efforts cannot be trusted.",
    4096: "The craft closed in faster than the approach-speed limit.",
    8192: "A wheel was at its speed limit; it can brake but no longer accelerate.",
}


class StepStatus(IntFlag):
    """Bits raised by one controller step; ``0`` means that nothing unusual happened.

    Examples
    --------
    >>> (StepStatus.COMMAND_LIMITED | StepStatus.FUNNEL_LEFT).sentences[0]
    'The law asked for more than the virtual-control limit; the command was clipped.'
    """

    MEASUREMENT_REPLACED = 1
    COMMAND_LIMITED = 2
    FUNNEL_LEFT = 4
    EFFORT_SHORT = 8
    ALLOCATION_INEXACT = 16
    ALLOCATION_FAILED = 32
    DIVERGED = 64
    MEMORY_RESET = 128
    COMMAND_REPLACED = 256
    KEEP_OUT_ENTERED = 512
    ALLOCATION_SINGULAR = 1024
    NEAR_FIELD = 2048
    APPROACH_TOO_FAST = 4096
    WHEEL_SATURATED = 8192

    @property
    def sentences(self) -> list[str]:
        """One sentence for each bit that is set, in the order of the bits."""
        return [_SENTENCES[bit.value] for bit in type(self) if bit in self]
