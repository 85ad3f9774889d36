"""Sets that an allocation or a theorem claims: which they are, and a break in one whose place is known by hand."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from braked_block import written

import casadi_gnc as gnc
from casadi_gnc.campaigns import DispersionTable
from casadi_gnc.errors import GncError
from casadi_gnc.missions.requirements import Requirement
from casadi_gnc.problem_files.document import of_text, read
from casadi_gnc.problem_files.loading import load_document
from casadi_gnc.tuning.claims import claimed
from casadi_gnc.tuning.objective import Objective


def ranges(mission, scheme, by):
    found, _ = claimed(mission, scheme, [by])
    return {one.key: tuple(one.uniform) for one in found.dispersions}


def wheels(shares, *faulty):
    """Return a mission whose allocation bears weak wheels, with a fault of some of them."""
    text = read("huang2019/fault_free").text
    assert "centre_of_mass_error_m = [0.65, 0.65, 0.65]" in text
    text = text.replace("centre_of_mass_error_m = [0.65, 0.65, 0.65]", f"wheel_effectiveness = {shares}")
    text += "".join(f'\n[[fault]]\nchannel = "wheel"\nindex = {i}\nfrom_s = 0.0\n' for i in faulty)
    return load_document(of_text(Path("w.toml"), text))


def test_sets_are_those_of_the_file():
    """Boxes of 10 to 30 and of -2 to 2, of which adaptation's proofs cover what is a tenth inside."""
    centre = ranges(gnc.load("huang2020/detumble"), "observer_robust", "allocation")
    assert centre == {f"truth.centre_of_mass_error_m.{i}": (-5e-3, 5e-3) for i in (1, 2, 3)}
    told = ranges(gnc.load("tao2019/case1"), "funnels", "theorem")
    assert told.pop("spacecraft.mass_kg") == pytest.approx((12.0, 28.0))
    for place in ("1.1", "2.2", "3.3"):
        assert told.pop(f"spacecraft.inertia_kg_m2.{place}") == pytest.approx((12.0, 28.0))
    for place in ("1.2", "1.3", "2.3"):
        assert told.pop(f"spacecraft.inertia_kg_m2.{place}") == pytest.approx((-1.6, 1.6))
    assert not told
    mission = wheels([0.5, 1.0], 3, 1, 4, 2)
    assert ranges(mission, "observers_robust", "allocation") == {
        f"fault.{i}.effectiveness": (0.5, 1.0) for i in (1, 2, 3, 4)
    }


def test_a_claimed_range_takes_the_place_of_a_dispersion_of_its_numbers():
    key = "truth.centre_of_mass_error_m"
    mission = gnc.load("huang2020/detumble")
    own = [DispersionTable(key=key, uniform=[-1.0, 1.0]), DispersionTable(key="truth.inertia_factor", uniform=[1, 2])]
    found, _ = claimed(dataclasses.replace(mission, dispersions=own), "observer_robust", ["allocation"])
    assert [one.key for one in found.dispersions] == ["truth.inertia_factor", *(f"{key}.{i}" for i in (1, 2, 3))]


@pytest.mark.parametrize(
    ("name", "scheme", "by", "told"),
    [
        ("huang2020/detumble", "observer_pinv", "allocation", "the allocation of observer_pinv is set up against no"),
        ("satellites/slew", "pd", "theorem", "AttitudePD names no bounds of the craft within which its theorem holds"),
        ("satellites/slew", "pd", "luck", "'luck' claims no set; expected one of allocation, theorem"),
    ],
)
def test_who_claims_nothing_is_told(name, scheme, by, told):
    with pytest.raises(GncError, match=told):
        claimed(gnc.load(name), scheme, [by])


def test_a_wheel_without_a_fault_is_told():
    mission = wheels([0.5, 1.0], 1, 3)
    with pytest.raises(GncError, match=r"wheels of 0\.5 to 1 of their command, and wheel 2, 4 has no fault"):
        claimed(mission, "observers_robust", ["allocation"])


SLOW = """[[requirement]]
id = "SLOW"
formula = "always[2, 5](abs(speed[1]) <= 0.08)"
"""


@pytest.mark.slow
def test_a_break_within_a_theorem_s_set_lies_where_it_does_by_hand(tmp_path):
    """After n samples of 0.1 s the speed is 0.5^n (1 - w/5) + w/5: at n = 20 it passes 0.08 with w = 0.4.

    The law covers winds up to 0.5, and the file disperses nothing.
    """
    found = gnc.falsify(written(tmp_path, 5.0, SLOW), "SLOW", claims=["theorem"], out=tmp_path / "broken.toml")
    assert found.broken is not None
    (moved,) = found.broken.moved
    right = 5 * (0.08 - 0.5**20) / (1 - 0.5**20)
    assert (moved.key, moved.value) == ("spacecraft.wind_N", pytest.approx(right, rel=0.01))
    assert moved.value >= right
    assert gnc.fly(tmp_path / "broken.toml").verdicts["SLOW"].word == "not met"
    assert found.notes == ("over the set that the theorem claims: spacecraft.wind_N from -0.5 to 0.5",)


@pytest.mark.slow
def test_nothing_in_an_allocation_s_set_is_worse_than_what_is_found():
    """The corners, edges and faces of the box of mass centres, flown one by one, against what the search leaves."""
    mission = gnc.load("huang2020/detumble").with_timing(duration=5.0)
    asked = Requirement("END", formula="always[4, 5](norm(rate) <= 1)")
    mission = dataclasses.replace(mission, requirements=[asked]).read_from(mission.origin)
    found = gnc.falsify(mission, "END", scheme="observer_robust", claims=["allocation"], flights=64)
    assert found.broken is None
    box, _ = claimed(mission, "observer_robust", ["allocation"])
    steps = np.linspace(-1.0, 1.0, 3)
    grid = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    values = Objective(box, "observer_robust", what="END").values(grid)
    assert values.min() < found.nominal
    assert found.left <= values.min() + 1e-12
