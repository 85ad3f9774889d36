"""Truth: what a file says, and the sentences that it gets where it cannot be meant so."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from pydantic import BaseModel, ValidationError

from casadi_gnc.campaigns.correlated import Correlated
from casadi_gnc.campaigns.dispersions import DispersionTable
from casadi_gnc.campaigns.distributions import Choice, LogUniform, Normal, Uniform
from casadi_gnc.campaigns.orientations import Direction, Rotation
from casadi_gnc.tables.complaints import sentences
from casadi_gnc.tables.part import MisfitError


class File(BaseModel):
    dispersion: list[DispersionTable]


def read(text: str) -> DispersionTable:
    data = tomllib.loads(f'[[dispersion]]\nkey = "truth.*"\n{text}')
    return File.model_validate(data).dispersion[0]


GOOD = {
    "normal = { mean = 1.0, deviation = 0.03, truncate = 3.0 }": (2, Normal(1.0, 0.03, 3.0, 2)),
    "normal = { mean = 1, deviation = 1 }": (1, Normal(1.0, 1.0)),
    "uniform = [-0.05, 0.05]": (3, Uniform(-0.05, 0.05, 3)),
    "log_uniform = [1e-6, 1]": (1, LogUniform(1e-6, 1.0)),
    "choice = { values = [1, 2.5] }": (4, Choice(((1.0,), (2.5,)), size=4)),
    "choice = { values = [[1, 0], [0, 1]], weights = [3, 1] }": (2, Choice(((1.0, 0.0), (0.0, 1.0)), (3.0, 1.0))),
    "direction = {}": (3, Direction()),
    "direction = { length = 0.1, length_to = 0.3, about = [1, 0, 0], within_rad = 0.5 }": (
        3,
        Direction(0.1, 0.3, (1.0, 0.0, 0.0), 0.5),
    ),
    "rotation = {}": (3, Rotation()),
    'rotation = { form = "quaternion_scalar_first", deviation_rad = 0.1, nominal = [1, 0, 0, 0] }': (
        4,
        Rotation("quaternion_scalar_first", 0.1, None, (1.0, 0.0, 0.0, 0.0)),
    ),
    "correlated = { mean = [1, 2], covariance = [[1, 0.5], [0.5, 1]] }": (
        2,
        Correlated((1.0, 2.0), ((1.0, 0.5), (0.5, 1.0))),
    ),
    'table = { file = "cases.csv", columns = ["b"] }': (1, Choice(((2.0,), (4.0,)))),
    'table = { file = "cases.csv" }': (2, Choice(((1.0, 2.0), (3.0, 4.0)))),
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "cases.csv").write_text("a, b\n1, 2\n3, 4\n", encoding="utf-8")
    (tmp_path / "comma.csv").write_text("a,b\n1,5,2\n", encoding="utf-8")
    (tmp_path / "nan.csv").write_text("a,b\n1,2\n1,nan\n", encoding="utf-8")
    (tmp_path / "none.csv").write_text("a,b\n", encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize("text", GOOD)
def test_files_say_distributions(text, folder):
    size, expected = GOOD[text]
    assert read(text).distribution(size, folder) == expected


def test_a_rotation_starts_at_the_attitude_of_the_key(folder):
    table = read("rotation = { deviation_rad = 0.1 }")
    assert table.distribution(3, folder, [0.1, 0.2, 0.3]) == Rotation("mrp", 0.1, None, (0.1, 0.2, 0.3))
    assert read("rotation = {}").distribution(3, folder, [0.1, 0.2, 0.3]) == Rotation()


BAD = {
    "": "has no distribution; expected one of normal, uniform, log_uniform, choice",
    "uniform = [0, 1]\nlog_uniform = [1, 2]": "uniform: has several distributions, uniform and log_uniform; keep one",
    "normal = { mean = 1 }": "normal.deviation: is missing",
    "normal = { mean = 1, sigma = 2 }": "normal.sigma: unknown key",
    "normal = { mean = 1, deviation = 0 }": "normal.deviation: is 0, expected a number > 0",
    "normal = { mean = inf, deviation = 1 }": "normal.mean: is inf, expected a finite number",
    "normal = 3": "normal: is 3, expected a table",
    "uniform = [1, 1]": "uniform: from 1 to 1; expected the lower end first",
    "uniform = [1]": "uniform: has 1 entry, expected at least 2",
    'uniform = ["a", 1]': "uniform.0: is 'a', expected a number",
    "log_uniform = [0, 1]": "log_uniform: from 0; expected numbers above 0",
    "choice = { values = [] }": "choice.values: has 0 entries, expected at least 1",
    "choice = { values = [1, 2], weights = [1] }": "choice.weights: 1 weights for 2 values",
    "choice = { values = [1, 2], weights = [0, 0] }": "choice.weights: all weights are zero",
    "choice = { values = [1, 2], weights = [-1, 2] }": "choice.weights.0: is -1, expected a number >= 0",
    "choice = { values = [[1], [1, 2]] }": "choice.values: rows of 1 and 2 numbers",
    "direction = { about = [0, 0, 0] }": "direction.about: is zero",
    "direction = { length = 2, length_to = 1 }": "direction.length_to: 1 is not above length, 2",
    "direction = { within_rad = 7 }": "direction.within_rad: is 7, expected a number <= 3.14",
    "rotation = { truncate = 3 }": "rotation.truncate: is for a rotation with deviation_rad",
    "rotation = { deviation_rad = 0.1, nominal = [1, 0] }": "rotation.nominal: the nominal attitude has 2 numbers",
    "correlated = { mean = [1, 2], covariance = [[1, 2], [2, 1]] }": "correlated.covariance: the covariance is not pos",
    "correlated = { mean = [1], covariance = [[1, 0], [0, 1]] }": "correlated.covariance: the mean has 1 numbers",
    "gaussian = { mean = 1, deviation = 1 }": "gaussian: unknown key",
}


@pytest.mark.parametrize("text", BAD)
def test_what_cannot_be_meant_is_told_with_its_place(text):
    data = tomllib.loads(f'[[dispersion]]\nkey = "truth.*"\n{text}')
    with pytest.raises(ValidationError) as caught:
        File.model_validate(data)
    told = [f"{'.'.join(map(str, path[2:]))}: {sentence}" for path, sentence in sentences(caught.value, File, data)]
    assert any(BAD[text] in each for each in told), told
    assert len(told) <= 2


MISFITS = {
    ("direction = {}", 4): ("gives 3 numbers; the key 'truth.*' stands for 4", ("direction",)),
    ("choice = { values = [[1, 2], [3, 4]] }", 3): ("gives 2 numbers", ("choice",)),
    ("choice = { values = [[1, 0, 0, 0, 1, 0, 0, 0, 1]] }", 6): ("of a symmetric matrix give mirror", ("choice",)),
    ('rotation = { form = "quaternion_scalar_last" }', 3): ("gives 4 numbers", ("rotation",)),
    ('table = { file = "cases.csv" }', 3): ("gives 2 numbers", ("table",)),
    ('table = { file = "cases.csv", columns = ["c"] }', 1): ("has no column 'c'; it has a, b", ("table", "columns")),
    ('table = { file = "comma.csv" }', 2): ("comma.csv, line 2: 3 entries, expected 2", ("table", "file")),
    ('table = { file = "nan.csv" }', 2): ("nan.csv, line 3: a number is not finite", ("table", "file")),
    ('table = { file = "none.csv" }', 2): ("no rows", ("table", "file")),
    ('table = { file = "lost.csv" }', 2): ("lost.csv", ("table", "file")),
}


@pytest.mark.parametrize("given", MISFITS)
def test_what_does_not_fit_its_key_is_told_with_its_place(given, folder):
    told, path = MISFITS[given]
    with pytest.raises(MisfitError, match=told) as caught:
        read(given[0]).distribution(given[1], folder)
    assert caught.value.path == path


def test_points_become_values(folder):
    found = read("uniform = [-1, 3]").distribution(2, folder).at(np.array([[0.0, 0.5], [1.0, 0.25]]))
    assert found.tolist() == [[-1.0, 1.0], [3.0, 0.0]]
