"""Dispersions of a file: what is wrong is told with its line, all at once, and by `check` too."""

from __future__ import annotations

import re

import pytest

import casadi_gnc
from casadi_gnc.errors import ProblemError
from casadi_gnc.system import assets

TEXT = (assets.folder("problems") / "huang2020" / "slew.toml").read_text(encoding="utf-8")


def written(tmp_path, tables):
    place = tmp_path / "mine.toml"
    place.write_text(TEXT + tables)
    return place


WRONG = """
[[dispersion]]
key = "truth.inertia_facto"
uniform = [0.9, 1.1]

[[dispersion]]
key = "initial.mrp"
choice = { values = [[1.0, 2.0]] }

[[dispersion]]
key = "initial.*"
uniform = [-0.01, 0.01]

[[dispersion]]
key = "timing.sample_period_s"
uniform = [0.1, 0.2]

[[dispersion]]
key = "truth.inertia_factor"
table = { file = "gone.csv" }
"""
TOLD = [
    ("truth.inertia_facto", "'truth.inertia_facto' leads nowhere: truth has no 'inertia_facto'; did you mean"),
    ("choice", "gives 2 numbers; the key 'initial.mrp' stands for 3"),
    ('"initial.*"', "gives initial.mrp.1, as 'initial.mrp' does; each number can follow one distribution only"),
    ("timing.sample", "'timing.sample_period_s' cannot be a column: sizes and steps follow from it"),
    ("gone.csv", "gone.csv"),
]


def test_all_that_is_wrong_is_told_at_once_with_its_line(tmp_path):
    place = written(tmp_path, WRONG)
    lines = place.read_text().splitlines()
    for read in (casadi_gnc.load, casadi_gnc.check):
        with pytest.raises(ProblemError) as error:
            read(place)
        told = str(error.value).splitlines()
        assert len(told) == len(TOLD)
        for sentence, (text, expected) in zip(told, TOLD, strict=True):
            assert expected in sentence
            assert text in lines[int(re.match(r"mine.toml, line (\d+)", sentence)[1]) - 1]


def test_check_finds_what_no_campaign_could_disperse(tmp_path):
    """The believed actuators are data of the on-board solver, set up before any flight; the true inertia is none."""
    tables = '\n[[dispersion]]\nkey = "truth.inertia_factor"\nuniform = [0.9, 1.1]\n'
    tables += '\n[[dispersion]]\nkey = "spacecraft.thrusters.max_force_N"\nuniform = [0.9, 1.1]\n'
    found = casadi_gnc.check(written(tmp_path, tables), "funnel_robust")
    (one,) = [each for each in found if each.name.startswith("dispersion.")]
    assert (one.name, one.verdict) == ("dispersion.spacecraft.thrusters.max_force_N", "fail")
    assert "'spacecraft.thrusters.max_force_N' cannot be a column" in one.consequence
    with pytest.raises(casadi_gnc.GncError, match="cannot be a column"):
        casadi_gnc.campaign(written(tmp_path, tables), 8, scheme="funnel_robust")
