"""A problem file with other values keeps its text but for these."""

from __future__ import annotations

import difflib
import tomllib

import pytest

from casadi_gnc.problem_files.changing import changed
from casadi_gnc.problem_files.document import of_text, read, shipped
from casadi_gnc.problem_files.loading import craft_of
from casadi_gnc.problem_files.rewriting import dumped, rewritten
from casadi_gnc.problem_files.toml_spans import layout_of


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
            ["- amplitude_N_m = [1.5e-4, -2e-4, -1.5e-4]", "+ amplitude_N_m = [0.0, -2e-4, -1.5e-4]"],
        ),
        (
            {"scheme.pd_pinv.allocation.note": "x"},
            ['- allocation = { method = "pinv" }', '+ allocation = { note = "x", method = "pinv" }'],
        ),
        (  # the mirror entry follows
            {"spacecraft.inertia_kg_m2.2.1": 0.01},
            [
                "- inertia_kg_m2 = [[0.49019, 0.0, 0.0], [0.0, 1.2089, 0.0], [0.0, 0.0, 1.2916]]",
                "+ inertia_kg_m2 = [[0.49019, 0.01, 0.0], [0.01, 1.2089, 0.0], [0.0, 0.0, 1.2916]]",
            ],
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


@pytest.mark.parametrize(
    ("changes", "rows"),
    [
        ({"1.2": 5.0}, [[1, 5.0, 3], [5.0, 4, 5], [3, 5, 6]]),
        ({"3.1": 5.0, "3.3": 7.0}, [[1, 2, 5.0], [2, 4, 5], [5.0, 5, 7.0]]),
        ({"2": [7, 8, 9]}, [[1, 7, 3], [7, 8, 9], [3, 9, 6]]),
        ({"*.3": 0}, [[1, 2, 0], [2, 4, 0], [0, 0, 0]]),
        ({"1.2": 5.0, "2.1": 6.0}, [[1, 5.0, 3], [6.0, 4, 5], [3, 5, 6]]),  # which the table refuses
        ({"1": [7, 8], "3.2": 0}, [[7, 8], [8, 4, 0], [3, 0, 6]]),
    ],
)
@pytest.mark.parametrize("key", ["believed.inertia_kg_m2", "dispersion.1.correlated.covariance"])
def test_an_entry_of_a_symmetric_matrix_takes_its_mirror_image_along(key, changes, rows):
    before = [[1, 2, 3], [2, 4, 5], [3, 5, 6]]
    data = {"believed": {"inertia_kg_m2": before}, "dispersion": [{"correlated": {"covariance": before}}]}
    craft = craft_of(read("tao2019/case1"))
    after = changed(data, {f"{key}.{entry}": value for entry, value in changes.items()}, craft)
    table = after["believed"] if key.startswith("believed") else after["dispersion"][0]["correlated"]
    assert table[key.split(".")[-1]] == rows
    assert before == [[1, 2, 3], [2, 4, 5], [3, 5, 6]]


def test_a_value_of_several_lines_with_comments_and_quotes():
    text = 'format = 1\na = [ # "first ]\n  1.0, # one\n  2.0,\n] # after\nb = "x # y"\n'
    document = of_text(read("huang2020/slew").path, text)
    put = rewritten(document, {"a.2": 3.0}, craft_of(read("huang2020/slew")))
    assert put == text.replace("2.0", "3.0")


@pytest.mark.parametrize("name", shipped())
def test_content_written_anew_reads_back(name):
    data = read(name).data
    assert tomllib.loads(dumped(data)) == data


def leaves(at, path=()):
    if isinstance(at, dict):
        for key, item in at.items():
            yield from leaves(item, (*path, key))
    elif isinstance(at, list):
        for i, item in enumerate(at):
            yield from leaves(item, (*path, i))
    else:
        yield path, at


MISSIONS = [name for name in shipped() if read(name).data["kind"] == "mission"][::4]


def test_every_value_of_a_shipped_file_is_found_where_it_stands():
    found = 0
    for name in MISSIONS:
        text = read(name).text
        places = layout_of(text).values
        told = [(text[slice(*places[path])], value) for path, value in leaves(tomllib.loads(text))]
        assert tomllib.loads("\n".join(f"x{i} = {each}" for i, (each, _) in enumerate(told))) == {
            f"x{i}": value for i, (_, value) in enumerate(told)
        }
        found += len(told)
    assert found > 300


def times_three(value):
    return [times_three(item) for item in value] if isinstance(value, list) else 3 * value


@pytest.mark.parametrize("name", MISSIONS)
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_gains_are_written_and_all_comments_stay(name, end):
    shipped_one = read(name)
    document = of_text(shipped_one.path, shipped_one.text.replace("\n", end))
    changes = {
        f"scheme.{scheme['name']}.law.{key}": times_three(value)
        for scheme in document.data["scheme"]
        for key, value in scheme["law"].items()
        if isinstance(value, (float, list))
    }
    text = rewritten(document, changes, craft_of(document))
    assert tomllib.loads(text) == changed(document.data, changes, craft_of(document))
    before, after = ([line.partition("#")[2] for line in each.split("\n")] for each in (document.text, text))
    assert before == after
