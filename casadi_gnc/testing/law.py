"""What every law keeps, whoever wrote it."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np

from casadi_gnc.laws import Law, advance, gains_of
from casadi_gnc.missions.loop import Loop
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.recording import observed
from casadi_gnc.missions.wrapped import Wrapped
from casadi_gnc.testing.asserting import must, numbers

#: A hold so short that what a law does over it is its rate, [s].
_SHORT = 1e-6


def check_law(mission: Mission, scheme: str | None = None) -> None:
    """Test the law of a mission's scheme, at what is measured at the start.

    Tested: columns of the declared sizes, numbers that are finite; a memory that advances by its rate over a short
    hold; expressions that every gain can be differentiated by; gains and errata that say what they are; checks
    with a consequence, a remedy and a source; the effort of the craft.

    Raises
    ------
    ContractError, LawError
        Saying what is not kept.
    """
    chosen = mission.scheme(scheme)
    loop, law = Loop(mission, chosen), chosen.law
    measured = ca.DM(loop.seen(mission.first_measurement()))
    y = measured
    if isinstance(loop.law, Wrapped):
        y = ca.DM(loop.law.read(0.0, measured, loop.started(0.0, mission.first_measurement())))
    _check_declarations(type(law))
    held = mission.timing.sample_period
    for hold in (held,) if chosen.navigation is not None and chosen.navigation.memory.size else (0.0, held):
        _check_sizes(loop, replace(law, hold=hold), measured)
    _check_short_hold(replace(law, hold=_SHORT), y)
    _check_gradients(law, y)
    for each in law.checks():
        told = f"the check {each.name} of {type(law).__name__}"
        must(np.isfinite(each.limit), f"{told} has the limit {each.limit}, expected a number")
        must(each.consequence and each.remedy and each.source, f"{told} lacks a consequence, a remedy or a source")


def _check_declarations(law: type[Law]) -> None:
    name = law.__name__
    must(law.__doc__, f"{name} has no docstring: catalogues and schema show its first line")
    for gain, declared in gains_of(law).items():
        about = declared.metadata
        must(about["unit"] or "choices" in about, f"the gain {gain} of {name} has no unit; write '-' for none")
        must(about["note"], f"the gain {gain} of {name} does not say what it is")
    for erratum, sentence in law.errata.items():
        must(len(sentence) > 20, f"the erratum {erratum} of {name} does not say what it is")


def _check_sizes(loop: Loop, law: Law, y: ca.DM) -> None:
    """Compose every slice that has the law in it: sizes are looked at there."""
    held = Loop(loop.mission, replace(loop.scheme, law=law))
    m = numbers(held.started(0.0, loop.mission.first_measurement())) if held.law.memory.size else np.zeros(0)
    must(np.isfinite(m).all(), f"{type(law).__name__}.start is not finite at the mission's start")
    memory, wanted = held.commanded(0.0, y, ca.DM(m))
    must(np.isfinite(numbers(wanted)).all(), f"{type(law).__name__}.command is not finite at the mission's start")
    s = held.symbols()
    held.before(s.t, s.y, s.good, s.m, s.actuators)
    held.advanced(0.0, y, memory, wanted, wanted)
    observed(held, s, s.actuators, ca.SX.sym("flags"), loop.actuation.allocator.report.symbol("report"))


def _check_short_hold(law: Law, y: ca.DM) -> None:
    """Over a hold of a microsecond the quotient is the rate, to what the second derivative leaves."""
    if not law.memory.size:
        return
    generator = np.random.default_rng(1)
    m = numbers(law.start(0.0, y)) * (1 + 1e-3 * generator.uniform(-1, 1, law.memory.size))
    wanted = law.command(0.0, y, ca.DM(m))
    achieved = 0.5 * wanted
    quotient = (numbers(advance(law, 0.0, y, ca.DM(m), wanted, achieved)) - m) / _SHORT
    rate = numbers(law.rate(0.0, y, ca.DM(m), wanted, achieved))
    rounding = 1e-15 * np.abs(m).max() / _SHORT  # of memory that is large beside its rate
    near = np.isclose(quotient, rate, rtol=1e-3, atol=1e-5 * np.abs(rate).max(initial=0.0) + rounding)
    told = f"{type(law).__name__}.rate is not what the memory does over a hold of {_SHORT:g} s"
    must(near.all(), f"{told}: element {int(np.argmin(near)) + 1} of the memory")


def _check_gradients(law: Law, y: ca.DM) -> None:
    """Every gain may be a symbol, and everything has a finite slope by it."""
    given = {
        key: ca.DM(getattr(law, key))
        for key, declared in gains_of(type(law)).items()
        if "choices" not in declared.metadata and getattr(law, key) is not None
    }
    symbols = {key: ca.SX.sym(key, *value.shape) for key, value in given.items()}
    if not symbols:
        return
    tuned = replace(law, hold=law.hold or 0.01, **symbols)
    seen, m = ca.SX.sym("y", tuned.inputs.size), tuned.memory.symbol("m")
    wanted = tuned.command(0.0, seen, m)
    everything = ca.vertcat(wanted, advance(tuned, 0.0, seen, m, wanted, wanted / 2))
    gains = ca.vertcat(*(ca.vec(symbol) for symbol in symbols.values()))
    evaluate = ca.Function("gradient", [seen, m, *symbols.values()], [ca.jacobian(everything, gains)])
    slope = np.array(ca.DM(evaluate(y, ca.DM(numbers(law.start(0.0, y))), *given.values())))
    must(np.isfinite(slope).all(), f"{type(law).__name__}: a gradient by a gain is not finite at the mission's start")
