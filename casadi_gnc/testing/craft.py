"""What every craft and every mission keep, whoever wrote them."""

from __future__ import annotations

import pickle
from typing import get_args

import numpy as np

from casadi_gnc.checking import check
from casadi_gnc.missions import fitting, tapes
from casadi_gnc.missions.engines import CompiledEngine
from casadi_gnc.missions.flying import begin
from casadi_gnc.missions.machine_engine import VirtualMachineEngine
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.paths import numbers_of
from casadi_gnc.testing.asserting import must
from casadi_gnc.testing.law import check_law
from casadi_gnc.testing.plant import check_plant
from casadi_gnc.tuning.claims import Claimant

#: Samples that both engines fly.
_SAMPLES = 20


def check_craft(mission: Mission) -> None:
    """Test a mission's craft: its plant, what its pictures show, and that it says the same when asked again.

    Raises
    ------
    ContractError, GncError
        Saying what is not kept.
    """
    check_plant(mission)
    craft, scheme = mission.craft, mission.scheme()
    name = type(craft).__name__
    must(craft.__doc__, f"{name} has no docstring: catalogues show its first line")
    must(dict(craft.start()) == dict(craft.start()), f"{name}.start differs from call to call")
    names = {signal for each in tapes.tapes_of(mission, scheme).row.names for signal in [each]}
    for panel in craft.panels(mission):
        known = names | set(scheme.actuation.effort.names)
        must(panel.signal in known, f"{name}.panels shows {panel.signal!r}, which is not recorded")
    for whose, matrix in craft.true_effectivenesses(mission, scheme).items():
        expected = (scheme.actuation.effort.size, mission.truth.inputs.size)
        must(np.shape(matrix) == expected, f"{whose} of {name} has shape {np.shape(matrix)}, expected {expected}")
    for by in get_args(Claimant):
        for key, (low, high) in craft.claimed(mission, scheme, by).items():
            must(low < high, f"{name}.claimed gives {key} the range from {low:g} to {high:g}, which is empty")
            numbers_of(mission, key)


def check_mission(mission: Mission) -> None:
    """Test craft, laws and checks of a mission, that it pickles, and that both engines fly it with the same words.

    Raises
    ------
    ContractError, GncError
        Saying what is not kept.
    """
    check_craft(mission)
    for scheme in mission.schemes:
        check_law(mission, scheme.name)
        why = list(
            fitting.misfits(
                type(scheme.law), fitting.read_by(scheme, mission.truth), scheme.law.belief, scheme.actuation.effort
            )
        )
        must(not why, f"the law of {scheme.name} does not fit: {'; '.join(why)}")
        _check_words(mission.with_scheme(scheme.name))
    for each in check(mission):
        told = f"the check {each.name}"
        must(each.consequence and each.remedy, f"{told} lacks a consequence or a remedy")
    again = pickle.loads(pickle.dumps(mission))
    must(again.digest == mission.digest, f"{mission.name} is another mission once it was pickled")


def _check_words(mission: Mission) -> None:
    """With the C library's functions the compiled C and CasADi's machine write the same words."""
    scheme = mission.scheme()
    built, records = tapes.tapes_of(mission, scheme), []
    compiled = CompiledEngine(mission, scheme, built, "libm", optimise="-O0")
    for engine in (compiled, VirtualMachineEngine(mission, scheme, built)):
        carried, record = begin(mission, built, engine), np.zeros((_SAMPLES, built.row.size))
        engine.run(carried, 0, _SAMPLES, 1, record)
        records.append(record)
    differ = records[0].view(np.uint64) != records[1].view(np.uint64)
    names = [name for name in built.row.names if differ[:, built.row.place(name)].any()]
    must(not names, f"scheme {scheme.name}: the C and CasADi's machine differ in {', '.join(names)}")
