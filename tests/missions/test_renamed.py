"""A scheme is what it is whatever it is called: the checks of a mission made of renamed schemes are the same."""

from dataclasses import replace

import pytest

import casadi_gnc
from casadi_gnc.problem_files.document import read, shipped

MISSIONS = [name for name in shipped() if read(name).data["kind"] == "mission"]


QUICK = ("huang2020/detumble", "huang2019/nominal", "shi2020/docking")


@pytest.mark.parametrize(
    "name", [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in MISSIONS]
)
def test_renamed_schemes_are_checked_alike(name):
    mission = casadi_gnc.load(name, strict=False)
    scheme = mission.schemes[-1]
    alone = replace(mission, schemes=[replace(scheme, name="nobody_knows_it")])
    found, own = casadi_gnc.check(alone), casadi_gnc.check(mission, scheme.name)
    # As text, in which a value that is no number equals itself.
    assert [repr(each.of("")) for each in found] == [repr(each.of("")) for each in own]
    assert {each.scheme for each in found} == {"nobody_knows_it"}
