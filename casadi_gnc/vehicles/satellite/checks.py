"""What can be said of a satellite before it flies: its modes and valves against the sampling, its wheels, its field."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from casadi_gnc.checking.broken_loops import cuts
from casadi_gnc.checking.linear import HELD, held
from casadi_gnc.checking.sampling import settled
from casadi_gnc.checks import Check
from casadi_gnc.errors import FlightError
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.scheme import Scheme

from . import budgets, pointing_checks, standing_checks, turn_checks

if TYPE_CHECKING:
    from .craft import SatelliteCraft

#: Steps of the integrator that a period of the fastest motion needs to be followed to about 1e-4 of its amplitude.
_STEPS = 20
#: Largest step, in units of the time constant, at which the classic Runge-Kutta method is stable.
_STABLE = 2.785


def checks(craft: SatelliteCraft, mission: Mission, scheme: Scheme) -> Iterator[Check]:
    """Yield momentum, slews and coils, and whether modes and liquids are slow enough for sampling and integrator."""
    yield from budgets.checks(craft, mission)
    yield from turn_checks.checks(craft)
    if (limit := pointing_checks.wanted(mission)) is not None:
        yield from pointing_checks.checks(craft, mission, scheme, limit)
        yield from standing_checks.checks(craft, mission, scheme, limit)
    timing = mission.timing
    step = timing.sample_period / timing.substeps
    rising = [each.rise_time_s for each in craft.thruster if each.rise_time_s > 0]
    if rising:
        yield Check(
            "numbers.thruster_rise",
            step / min(rising),
            _STABLE,
            "-",
            "fail",
            "The integrator's steps are too long for the force of a thruster that rises so fast: it grows without end.",
            "Raise timing.plant_substeps, or leave rise_time_s out.",
            "largest step of the classic Runge-Kutta method for x' = -x",
        )
    pulses = [each.pulse for each in craft.thruster if each.pulse is not None]
    if pulses and timing.mode == "sampled":
        yield Check(
            "sampling.pulse_width",
            max(max(each.least_on_s, each.quantum_s) for each in pulses),
            timing.sample_period,
            "s",
            "fail",
            "A least width or quantum of pulses is longer than the sample period: no pulse of it can be made.",
            "Shorten least_on_s and quantum_s, or sample slower.",
            "one pulse a sample",
        )
    kinds = {"flexible_mode": craft.flexible_mode, "slosh": craft.slosh, "hinged_panel": craft.hinged_panel}
    swings = [(kind, i, each.frequency_Hz) for kind, tables in kinds.items() for i, each in enumerate(tables, 1)]
    if not swings:
        return
    yield from _bandwidth(mission, scheme, *min(swings, key=lambda each: each[2]))
    kind, number, fastest = max(swings, key=lambda each: each[2])
    named = f"{kind} {number}"
    if timing.mode == "sampled":
        yield Check(
            "sampling.mode_frequency",
            fastest,
            0.5 / timing.sample_period,
            "Hz",
            "fail",
            f"{named} swings faster than half the sampling frequency: the law sees it at another frequency.",
            "Sample faster, or leave the mode out.",
            "Nyquist's frequency",
        )
    yield Check(
        "numbers.mode_steps",
        2 * math.pi * fastest * step,
        2 * math.pi / _STEPS,
        "rad",
        "note",
        f"The integrator takes fewer than {_STEPS} steps for a period of {named}: its swing is not followed well.",
        "Raise timing.plant_substeps.",
        f"a period of the fastest motion has {_STEPS} steps",
    )


def _bandwidth(mission: Mission, scheme: Scheme, kind: str, number: int, slowest: float) -> Iterator[Check]:
    """Yield whether the loop, cut at an effort, has gains above one only below the slowest swing."""
    still, own = held(mission, scheme)
    if not still.target:
        return
    try:
        loop, _ = cuts(still, own, settled(still))
    except FlightError:
        return  # a law without slope: said by others
    last = 0.0
    for i in range(loop.channels):
        cut = loop.channel(i)
        grid = cut.frequencies()
        last = max(last, float(grid[np.abs(cut.at(grid)[:, 0, 0]) >= 1].max(initial=0.0)))
    yield Check(
        "sampling.bandwidth",
        last / (2 * math.pi),
        slowest,
        "Hz",
        "note",
        f"The loop has gain at the frequency of {kind} {number} or above: whether it damps or drives it is up to its "
        "phase, and to every delay.",
        "Look at `casadi-gnc margins`, lower the gains, or filter what the law reads.",
        "largest frequency at which the loop, cut at one effort, has gain one, against the lowest clamped frequency"
        + (f"; {HELD}" if still is not mission else ""),
    )
