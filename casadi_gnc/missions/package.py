"""Describe the controller of a mission's scheme, so that `casadi_gnc.embedded` can make C of it.

    before -> allocate -> judge -> after

What flies is built from the same expressions as the tapes of a simulated flight. Gains named as
tunable become symbols; all that depends on them alone is taken out of the step (`extract_parametric`)
and computed once, when they change.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.allocation import OnlineInFlight
from casadi_gnc.embedded.controller import Controller, Tunable
from casadi_gnc.errors import PackageError
from casadi_gnc.laws import advance, gains_of
from casadi_gnc.missions import tapes
from casadi_gnc.missions.mission import Mission, Scheme
from casadi_gnc.status import StepStatus


def describe(mission: Mission, scheme: str | None = None, tunable: Sequence[str] = ()) -> Controller:
    """Return the sampled controller of a scheme.

    Parameters
    ----------
    mission : a continuous one is taken at its sample period.
    scheme : its name; the first one by default.
    tunable : gains of the law that stay variables of the C.

    Raises
    ------
    PackageError
        For a scheme whose allocation cannot fly, or a tunable that is no gain of the law.
    """
    if mission.timing.mode != "sampled":
        mission = mission.with_timing(mode="sampled")
    chosen = mission.scheme(scheme)
    allocator = chosen.actuation.allocator
    if not chosen.actuation.is_symbolic and not isinstance(allocator, OnlineInFlight):
        raise PackageError(
            f"scheme {chosen.name!r} allocates by a solver that does not fly; "
            'take backend = "online", or an allocation that is an expression ("pinv")'
        )
    parameters = [_parameter(chosen, name) for name in dict.fromkeys(tunable)]
    symbols = [ca.SX.sym(one.name, len(one.default)) for one in parameters]
    if parameters:
        values = {one.name: symbol for one, symbol in zip(parameters, symbols, strict=True)}
        mission = mission.with_scheme(chosen.name, **values)
        chosen = mission.scheme(chosen.name)
    actuation, truth = chosen.actuation, mission.truth
    return Controller(
        title=mission.title or mission.name,
        source=mission.source,
        scheme=chosen.name,
        period=mission.timing.sample_period,
        measured=truth.measurement,
        memory=chosen.law.memory,
        wanted=actuation.named("wanted"),
        limited=actuation.named("limited"),
        actuators=truth.inputs,
        report=allocator.report,
        lower=tuple(float(value) for value in actuation.lower),
        upper=tuple(float(value) for value in actuation.upper),
        least=tuple(float(value) for value in actuation.limit_below),
        most=tuple(float(value) for value in actuation.limit_above),
        tapes=_tapes(mission, chosen, symbols),
        statuses={bit.value: (str(bit.name), bit.sentences[0]) for bit in StepStatus if bit is not StepStatus.DIVERGED},
        tunables=tuple(parameters),
        allocation=allocator.problem if isinstance(allocator, OnlineInFlight) else None,
    )


def _parameter(scheme: Scheme, name: str) -> Tunable:
    """Return the description of a gain, with the file's value as default."""
    declared = {key: field for key, field in gains_of(type(scheme.law)).items() if "choices" not in field.metadata}
    if name not in declared:
        raise PackageError(f"{name!r} is no gain of scheme {scheme.name!r}; there is {', '.join(declared) or 'none'}")
    value, about = getattr(scheme.law, name), declared[name].metadata
    if value is None:
        raise PackageError(f"{name!r} is not given in scheme {scheme.name!r}; give it a value to make it tunable")
    numbers = np.array(ca.DM(value)).ravel(order="F")
    if ca.DM(value).shape[1] > 1:
        raise PackageError(f"{name!r} is a matrix; only numbers and lists can be tunable")
    return Tunable(
        name, about["unit"], about["note"], tuple(float(n) for n in numbers), about["minimum"], about["above"]
    )


def _tapes(mission: Mission, scheme: Scheme, parameters: list[ca.SX]) -> dict[str, ca.Function]:
    """Return the tapes of the controller; all derived parameters of all tapes are found together."""
    s, law = tapes.Symbols(mission, scheme), scheme.law
    seen = tapes.law_inputs(mission, scheme, s.y)
    made = {
        "start": ({"t": s.t, "y": s.y}, {"m": law.start(s.t, seen)}),
        "before": (
            {"t": s.t, "y": s.y, "good": s.good, "m": s.m, "actuators": s.actuators},
            tapes.before(mission, scheme, s),
        ),
        "judge": (
            {"y": s.y, "limited": s.limited, "actuators": s.actuators},
            {"verdict": tapes.judge(mission, scheme, s.y, s.limited, s.actuators)},
        ),
        "after": (
            {"t": s.t, "y": s.y, "m": s.m, "wanted": s.wanted, "limited": s.limited, "actuators": s.actuators},
            {"memory": _advanced(mission, scheme, s, seen)},
        ),
    }
    if scheme.actuation.is_symbolic:
        made["allocate"] = (
            {"y": s.y, "limited": s.limited, "actuators": s.actuators, "lower": s.lower, "upper": s.upper},
            {"allocated": tapes.allocated(mission, scheme, s.y, s.limited, s.actuators, s.lower, s.upper)},
        )
    if not parameters:
        return {name: tapes.function(name, ports, outputs) for name, (ports, outputs) in made.items()}
    return _with_parameters(made, ca.vertcat(*parameters))


def _advanced(mission: Mission, scheme: Scheme, s: Any, seen: Any) -> Any:
    told = tapes.achieved(mission, scheme, s.y, s.limited, s.actuators)
    return advance(scheme.law, s.t, seen, s.m, s.wanted, told)


def _with_parameters(made: dict[str, tuple[dict, dict]], p: ca.SX) -> dict[str, ca.Function]:
    """Return the tapes with a further port `e`, and `derive`, which computes it from the parameters."""
    results = [ca.densify(ca.SX(value)) for _, outputs in made.values() for value in outputs.values()]
    rest, symbols, derived = ca.extract_parametric(ca.cse(results), p, {"extract_trivial": True})
    if not derived:
        raise PackageError("the controller does not depend on the tunable parameters")
    e, replaced = ca.vertcat(*symbols), iter(rest)
    functions = {}
    for name, (ports, outputs) in made.items():
        functions[name] = tapes.function(name, {**ports, "e": e}, {key: next(replaced) for key in outputs})
    return {"derive": tapes.function("derive", {"p": p}, {"derived": ca.vertcat(*derived)}), **functions}
