"""The C of a flight with derivatives: its tapes linearised, and the loops over them forward and in reverse."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import casadi as ca

from casadi_gnc.allocation import OnlineInFlight
from casadi_gnc.embedded.printer import print_function
from casadi_gnc.errors import FlightError
from casadi_gnc.mathematics.linearised import Linearised, linearised
from casadi_gnc.missions.engines import flight_facts
from casadi_gnc.missions.parameters import Varied
from casadi_gnc.system.templates import template

#: Columns that do not depend on parameters, or of which no derivative is asked.
STILL = ("t", "middle", "noise", "uniform", "flags", "length", "weight", "way")
#: Sizes of the columns as the C names them.
_SIZES = {
    **dict.fromkeys(("x", "settled"), "STATES"),
    **dict.fromkeys(("m", "memory"), "MEMORY"),
    **dict.fromkeys(("actuators", "lower", "upper", "told"), "ACTUATORS"),
    **dict.fromkeys(("y", "good", "accepted"), "MEASUREMENTS"),
    **dict.fromkeys(("wanted", "limited"), "EFFORTS"),
    "derived": "DERIVED",
    "p": "PARAMETERS",
    "slope": "STATES + MEMORY",
    "asked": "ASKED",
}
#: Where columns lie that are neither of a sample nor named at the call.
_PLACES = {"middle": "&middle", "derived": "flight->derived", "uniform": "uniform"}
_OF_A_SAMPLE = ("y", "accepted", "memory", "wanted", "limited", "lower", "upper", "flags", "told", "slope")


def asked_tape(varied: Varied, quantities: ca.Function) -> ca.Function:
    """Return the tape from a sample's columns to quantities of its row, ports that they do not need left out.

    Parameters
    ----------
    varied : the mission.
    quantities : row -> quantities, (Q,).

    Raises
    ------
    FlightError
        For quantities of the allocator's report, which has no derivative.
    """
    observe = varied.tapes.observe
    names = observe.name_in()
    columns = [ca.SX.sym(name, observe.numel_in(i)) for i, name in enumerate(names)]
    (row,) = observe.call(columns)
    (asked,) = ca.cse([ca.densify(quantities.call([row])[0])])
    used = [i for i, column in enumerate(columns) if column.numel() and ca.depends_on(asked, column)]
    if "report" in (names[i] for i in used):
        raise FlightError("what is asked depends on the allocator's report of itself, which has no derivative")
    return ca.Function("ask", [columns[i] for i in used], [asked], [names[i] for i in used], ["asked"])


def sensitivities_source(varied: Varied, asked: ca.Function) -> str:
    """Return the C of whole flights with derivatives of some quantities of every sample.

    Raises
    ------
    FlightError
        For an allocation called from Python, and for pulses.
    """
    mission, scheme, tapes = varied.mission, varied.scheme, varied.tapes
    allocator = scheme.actuation.allocator
    online = isinstance(allocator, OnlineInFlight)
    if not tapes.symbolic and not online:
        raise FlightError(
            f"scheme {scheme.name!r} allocates by {type(allocator).__name__}, which is called from Python and has no "
            'derivatives; take allocation by "pinv", or by "robust" with the on-board solver'
        )
    if "modulate" in tapes.functions:
        raise FlightError(
            f"scheme {scheme.name!r} makes pulses, which begin and end at once: a derivative says nothing of them; "
            "take thrusters without pulses, or differences of flights"
        )
    functions = {**tapes.functions, "ask": asked}
    control = ["stage"] if "stage" in functions else ["sense", "before", "allocate"]
    control += ["flow"] if "flow" in functions else []
    whole = [*(name for name in control if name in functions), "ask", "settle", "configure", "sense", "start"]
    whole += ["after", "rate"] if mission.timing.mode == "sampled" else []
    whole = list(dict.fromkeys(whole))
    made = {name: linearised(functions[name], STILL) for name in whole}
    plain = [*(name for name in whole if name not in ("configure", "start")), "point", "weigh", "join"]
    plain += ["draw"] if "draw" in functions else []
    if "stage" in functions:
        plain.remove("sense")
    texts = [print_function(functions[name]) for name in plain]
    for each in made.values():
        texts.append(print_function(each.values))
        texts.append(print_function(each.forward, shared=("partials",)))
        texts.append(print_function(each.reverse))
    return template("sensitivities.c.j2").render(
        **flight_facts(mission, scheme),
        online=online,
        parameters=varied.parameters.size,
        derived=functions["configure"].numel_out("derived"),
        asked=asked.numel_out(0),
        control=control,
        tapes=texts,
        partials={name: each.partials for name, each in made.items()},
        call=_Calls(functions, made),
        moving=lambda name: made[name].moving,
        size=lambda port: _SIZES[port],
    )


class _Calls:
    """Write down calls of tapes, each column where it lies."""

    def __init__(self, functions: Mapping[str, ca.Function], made: Mapping[str, Linearised]) -> None:
        self._tapes = dict(functions)
        for name, each in made.items():
            self._tapes |= {f"{name}_values": each.values, f"{name}_forward": each.forward}
            self._tapes[f"{name}_reverse"] = each.reverse

    def __call__(self, name: str, own: str = "", bars: str = "s->", **places: Any) -> str:
        tape = self._tapes[name]
        inputs, outputs = tape.name_in(), tape.name_out()
        if own:
            found = {port: f"{bars}{port}" for port in inputs} | places | {port: f"{own}{port}" for port in outputs}
        else:
            found = {port: port for port in (*inputs, *outputs)} | {port: f"{bars}{port}" for port in _OF_A_SAMPLE}
            found |= _PLACES | places
        return f"{name}({', '.join(found[port] for port in (*inputs, *outputs))})"
