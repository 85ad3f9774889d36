"""Matrices of a synthesis file from CSV and .mat: the recipe that rows give; what is wrong, in one sentence."""

import tomllib

import numpy as np
import pytest
from scipy import io

from casadi_gnc.errors import ProblemError
from casadi_gnc.problem_files.document import read
from casadi_gnc.problem_files.synthesis_file import load_synthesis
from casadi_gnc.problem_files.synthesis_recipes import IntermediateObserver
from casadi_gnc.system.matrix_file import read_matrix

NAME = "shi2020/synthesis"


def shortened(text, key, value):
    """Return the text of a synthesis with one matrix, of several lines, replaced."""
    begin = text.index(f"\n{key} = [") + 1
    end = text.index("\n]", begin) + 2
    return f"{text[:begin]}{key} = {value}{text[end:]}"


def test_matrices_of_files_are_those_of_rows(tmp_path):
    text = read(NAME).text
    rows = tomllib.loads(text)["recipe"]
    np.savetxt(tmp_path / "plant.csv", rows["A"], delimiter=", ", fmt="%.17g", header="position [m], rate [m/s]")
    io.savemat(tmp_path / "plant.mat", {"B": np.array(rows["B"]), "other": 3.0})
    mine = tmp_path / "mine.toml"
    mine.write_text(shortened(shortened(text, "A", '"plant.csv"'), "B", '"plant.mat:B"'))
    read_one, shipped = load_synthesis(mine).recipe, load_synthesis(NAME).recipe
    assert isinstance(read_one, IntermediateObserver)
    assert read_one == shipped
    assert rows["A"] == read_one.A


@pytest.mark.parametrize(
    ("told", "content", "message"),
    [
        ("plant.csv", "a, b\n1, 2\n", r"plant\.csv, line 1: .*a matrix has no line of names"),
        ("plant.csv", "1, 2\n\n# note\n3\n", r"plant\.csv, line 4: has 1 numbers, and the first row 2"),
        ("plant.csv", "1, inf\n", r"plant\.csv: holds a number that is not finite"),
        ("plant.csv", "# nothing\n", r"plant\.csv: holds no number"),
        ("gone.csv", None, r"gone\.csv: cannot be read: No such file"),
        ("gone.mat:A", None, r"gone\.mat: cannot be read: No such file"),
        ("plant.mat:A", "1, 2\n", r"plant\.mat: cannot be read as a \.mat file"),
        ("plant.txt", "1, 2\n", r"'plant\.txt' names no matrix; write its rows"),
        ("plant.mat", "1, 2\n", r"'plant\.mat' names no matrix; write its rows"),
    ],
)
def test_what_is_no_matrix_is_told(tmp_path, told, content, message):
    if content is not None:
        (tmp_path / told.partition(":")[0]).write_text(content)
    with pytest.raises(ProblemError, match=message):
        read_matrix(told, tmp_path)
    mine = tmp_path / "mine.toml"
    mine.write_text(shortened(read(NAME).text, "A", f'"{told}"'))
    with pytest.raises(ProblemError, match=rf"mine\.toml, line \d+, recipe\.A: .*{message.partition(': ')[2]}"):
        load_synthesis(mine)


def test_what_a_mat_file_lacks_is_told(tmp_path):
    io.savemat(tmp_path / "plant.mat", {"A": np.eye(2), "z": np.eye(2) * 1j, "t": "text", "cube": np.zeros((2, 2, 2))})
    assert read_matrix("plant.mat:A", tmp_path) == [[1.0, 0.0], [0.0, 1.0]]
    with pytest.raises(ProblemError, match=r"plant\.mat: has no variable 'B'; there is A, z, t, cube"):
        read_matrix("plant.mat:B", tmp_path)
    for name in ("z", "t", "cube"):
        with pytest.raises(ProblemError, match=f"its variable '{name}' is no matrix of real numbers"):
            read_matrix(f"plant.mat:{name}", tmp_path)
