"""What every shipped mission must keep: both engines write the same words, and check runs."""

import numpy as np
import pytest
from shipped_missions import missions, parametrized

from casadi_gnc.checking import check
from casadi_gnc.missions import tapes
from casadi_gnc.missions.engines import CompiledEngine
from casadi_gnc.missions.flying import begin
from casadi_gnc.missions.machine_engine import VirtualMachineEngine

EVERY = [(name, scheme.name) for name, mission in missions().items() for scheme in mission.schemes]
SAMPLES = 40


@pytest.mark.parametrize(("problem", "scheme"), parametrized(EVERY))
def test_engines_write_the_same_words(problem, scheme):
    """Every scheme of every mission, in its own mode, noise and faults included, with libm on both sides."""
    mission = missions()[problem].with_scheme(scheme)
    built, chosen = tapes.tapes_of(mission, mission.schemes[0]), mission.schemes[0]
    records = []
    for engine in (
        CompiledEngine(mission, chosen, built, "libm", optimise="-O0"),
        VirtualMachineEngine(mission, chosen, built),
    ):
        carried, record = begin(mission, built, engine), np.zeros((2 * SAMPLES, built.row.size))
        assert engine.run(carried, 0, SAMPLES, 1, record) == SAMPLES
        # And from the middle of the flight, where faults have set in.
        assert engine.run(carried, mission.timing.samples // 2, SAMPLES, 1, record[SAMPLES:]) == SAMPLES
        records.append(record)
    differ = records[0].view(np.uint64) != records[1].view(np.uint64)
    assert not differ.any(), [name for name in built.row.names if differ[:, built.row.place(name)].any()]


@pytest.mark.parametrize("problem", parametrized([(name,) for name in sorted(missions())]))
def test_every_shipped_mission_can_be_checked(problem):
    found = check(missions()[problem])
    assert found
    assert all(each.consequence and each.remedy and each.source for each in found)
