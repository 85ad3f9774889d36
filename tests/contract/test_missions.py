"""What every shipped mission must keep: both engines write the same words, and check runs."""

import numpy as np
import pytest
from shipped_missions import missions, name_of

import casadi_gnc
from casadi_gnc.missions.checking import check


def kinds() -> dict[tuple[str, ...], tuple[str, str]]:
    """Return one mission and scheme of every craft, law and allocation."""
    found: dict[tuple[str, ...], tuple[str, str]] = {}
    for mission, loaded in missions().items():
        for scheme in loaded.schemes:
            kind = (type(loaded.truth).__name__, name_of(scheme.law), type(scheme.actuation.allocator).__name__)
            found.setdefault(kind, (mission, scheme.name))
    return found


@pytest.mark.parametrize(("problem", "scheme"), kinds().values(), ids=["-".join(kind) for kind in kinds()])
def test_engines_write_the_same_words(problem, scheme):
    """Sixty samples of each kind, in the mission's own mode, with libm on both sides."""
    mission = missions()[problem]
    short = mission.with_timing(duration=59 * mission.timing.sample_period).with_scheme(scheme)
    machine = casadi_gnc.fly(short, engine="vm", decimation=1)
    compiled = casadi_gnc.fly(short, maths="libm", decimation=1)
    assert compiled.made["engine"] == "c"
    differ = machine.samples.view(np.uint64) != compiled.samples.view(np.uint64)
    assert not differ.any(), [name for name in machine.layout.names if differ[:, machine.layout.place(name)].any()]


@pytest.mark.parametrize("problem", sorted(missions()))
def test_every_shipped_mission_can_be_checked(problem):
    found = check(missions()[problem])
    assert found
    assert all(each.consequence and each.remedy and each.source for each in found)
