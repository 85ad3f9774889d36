"""What a package can watch: requirements over the signals that exist on board.

There a measured signal is what the sensors say and the controller accepted; in a flight the same name is the truth.
What a law shows is there where it follows from time and measurement alone: its memory has moved on after the step.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import casadi as ca

from casadi_gnc.embedded.monitor import Monitor, Watched
from casadi_gnc.errors import RequirementError
from casadi_gnc.missions import asking, tapes
from casadi_gnc.missions.loop import Loop
from casadi_gnc.missions.recording import funnel_signals, watched
from casadi_gnc.missions.requirements import monitor_tape
from casadi_gnc.signals import Layout, Signal

if TYPE_CHECKING:
    from casadi_gnc.missions.mission import Mission


def monitor_of(mission: Mission, loop: Loop, tunables: ca.SX) -> Monitor | None:
    """Return what a package of a scheme watches; None where the mission has no formula.

    Parameters
    ----------
    mission : sampled.
    loop : of the scheme.
    tunables : symbols of the gains that stay variables.
    """
    asked = [one for one in mission.requirements if one.formula]
    if not asked:
        return None
    layout, row, ports = _on_board(loop, tunables)
    period, able, left_out = mission.timing.sample_period, [], []
    for one in asked:
        try:
            monitor_tape([one], layout, period)
            able.append(one)
        except RequirementError as error:
            left_out.append((one.id, str(error)))
    if not able:
        return Monitor((), tuple(left_out), ca.Function("watch", [], []), (), (), 0, 0)
    made = monitor_tape(able, layout, period)
    kept = {
        "age": ca.SX.sym("age"),
        "after": ca.SX.sym("after"),
        "past": ca.SX.sym("past", len(made.lines)),
        "kept": ca.SX.sym("kept", len(made.initial)),
    }
    read = ca.vertcat(*(row[layout.place(name)] for name in made.layout.names))
    results = made.step.call([read, *kept.values()])
    tape = tapes.function("watch", {**ports, **kept}, dict(zip(made.step.name_out(), results, strict=True)))
    seen = [
        Watched(one.id, one.asked, unit, delay * period)
        for one, unit, delay in zip(able, made.units, made.delays, strict=True)
    ]
    return Monitor(tuple(seen), tuple(left_out), tape, made.lines, made.initial, made.horizon, made.finish)


def _on_board(loop: Loop, tunables: ca.SX) -> tuple[Layout, ca.SX, dict[str, ca.SX]]:
    """Return the signals that exist on board, an expression of each, and the symbols that these are made of."""
    s, plant, law, actuation = loop.symbols(), loop.plant, loop.law, loop.actuation
    report, status = actuation.allocator.report.symbol("report"), ca.SX.sym("status")
    ports = {**s.ports("t", "y", "wanted", "limited", "actuators"), "report": report, "status": status}
    signals: dict[str, tuple[Signal, Any]] = {
        "time": (Signal("time", 1, "s"), s.t),
        "status": (Signal("status"), status),
    }

    def add(layout: Layout, column: Any) -> None:
        for signal in layout.signals:
            signals.setdefault(signal.name, (signal, column[layout.place(signal.name)]))

    add(plant.measurement, s.y)
    add(actuation.named("wanted"), s.wanted)
    add(actuation.named("limited"), s.limited)
    add(actuation.named("achieved"), loop.made(s.y, s.actuators))
    add(plant.inputs, s.actuators)
    add(actuation.allocator.report, report)
    shown, _ = watched(loop, s.t, s.y)
    shown = {**asking.shown(law, asking.ask(law, "show", s.t, loop.seen(s.y), s.m), law.outputs), **shown}
    funnels = [signal for each in loop.mission.funnels for signal in funnel_signals(loop.mission, each).signals]
    for signal in (*law.outputs.signals, *funnels):
        value = ca.vec(ca.SX(shown[signal.name]))
        if not ca.depends_on(value, ca.vertcat(s.m, tunables)):
            signals.setdefault(signal.name, (signal, value))
    layout = Layout(tuple(signal for signal, _ in signals.values()))
    return layout, ca.vertcat(*(ca.vec(ca.SX(value)) for _, value in signals.values())), ports
