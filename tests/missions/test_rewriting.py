"""A problem file with other values keeps its text but for these."""

from __future__ import annotations

import difflib
import tomllib

import pytest

from casadi_gnc.problem_files.changing import changed
from casadi_gnc.problem_files.document import of_text, read, shipped
from casadi_gnc.problem_files.loading import craft_of
from casadi_gnc.problem_files.rewriting import dumped, rewritten


def lines_apart(before, after):
    told = difflib.ndiff(before.splitlines(), after.splitlines())
    return [line for line in told if line.startswith(("- ", "+ "))]


@pytest.mark.parametrize(
    ("changes", "apart"),
    [
        ({"truth.inertia_factor": 1.25}, ["- inertia_factor = 1.1", "+ inertia_factor = 1.25"]),
        (
            {"initial.mrp.2": 0.5, "initial.mrp.3": -1e-7},
            ["- mrp = [-0.206, -0.179, 0.075]", "+ mrp = [-0.206, 0.5, -1e-07]"],
        ),
        (
            {"environment.orbit_rate_rad_per_s": 2e-3},
            [
                "- orbit_rate_rad_per_s = 1.1e-3 # not printed; changes the sums by less than 2e-4",
                "+ orbit_rate_rad_per_s = 0.002 # not printed; changes the sums by less than 2e-4",
            ],
        ),
        (
            {"scheme.pd_pinv.law.rate_gain": 0.7},
            [
                '- law = { type = "attitude_pd", attitude_gain = 0.1, rate_gain = 0.5 } # gains not printed',
                '+ law = { type = "attitude_pd", attitude_gain = 0.1, rate_gain = 0.7 } # gains not printed',
            ],
        ),
        ({"scheme.funnel_robust.law.rate_gain": 3.0}, ["- rate_gain = 2.0", "+ rate_gain = 3.0"]),
        (
            {"environment.harmonic.2.amplitude_N_m.1": 0.0},
            ["- amplitude_N_m = [1.5e-4, -2e-4, -1.5e-4]", "+ amplitude_N_m = [0.0, -0.0002, -0.00015]"],
        ),
        ({"noise.seed": 3}, ["+ ", "+ [noise]", "+ seed = 3"]),
        ({"timing.plant_substeps": 2}, ["+ plant_substeps = 2"]),
    ],
)
def test_only_what_changes_is_written(changes, apart):
    document = read("huang2020/slew")
    craft = craft_of(document)
    text = rewritten(document, changes, craft)
    assert changed(tomllib.loads(text), {}, craft) == changed(tomllib.loads(text), changes, craft)
    assert lines_apart(document.text, text) == apart


def test_a_value_of_several_lines_with_comments_and_quotes():
    text = 'format = 1\na = [ # "first ]\n  1.0, # one\n  2.0,\n] # after\nb = "x # y"\n'
    document = of_text(read("huang2020/slew").path, text)
    put = rewritten(document, {"a.2": 3.0}, craft_of(read("huang2020/slew")))
    assert put == 'format = 1\na = [1.0, 3.0] # after\nb = "x # y"\n'


@pytest.mark.parametrize("name", shipped())
def test_content_written_anew_reads_back(name):
    data = read(name).data
    assert tomllib.loads(dumped(data)) == data
