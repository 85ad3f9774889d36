"""Tables as text: what is read is what stands there, and what is no table is refused with its line."""

import os

import numpy as np
import pytest

from casadi_gnc.errors import ProblemError
from casadi_gnc.system.csv_file import number, read_rows, read_table
from casadi_gnc.system.reading import text_of


def written(tmp_path, content):
    path = tmp_path / "u.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


@pytest.mark.parametrize("delimiter", [",", ", ", " ,  "])
def test_what_numpy_writes_is_read_back_word_by_word(tmp_path, delimiter, rng):
    values = rng.standard_normal((20, 3)) * 10.0 ** rng.integers(-300, 300, (20, 3))
    path = tmp_path / "u.csv"
    np.savetxt(path, values, delimiter=delimiter, header=delimiter.join(("u1", "u2", "u3")), comments="", fmt="%.17g")
    table = read_table(path)
    assert table.names == ["u1", "u2", "u3"]
    assert np.array_equal(table.column_numbers(["u3", "u1"]), values[:, [2, 0]])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("u1,u2,u3\n0,001,0,002,0,003\n", "line 2: 6 entries, expected 3; numbers are written with a decimal point"),
        ("u1,u2,u3\n1,2,3\n\n1,2\n", "line 4: 2 entries, expected 3$"),
        ("u1,u2,u3\n1,2,3,\n", "line 2: 4 entries, expected 3"),
        ("\n# forces\nu1,u2,u1\n", "line 3: the column 'u1' is named twice"),
        ("u1, u1\n", "named twice"),
        ('u1,u2\n1,"2\n3,4\n', "line 2: is no row of a table: a quotation mark is not closed"),
        ("", "is empty"),
        (b"u1,u2\n1,2\n1,\xff\n", "line 3: cannot be read as UTF-8 text: byte 0xff"),
    ],
)
def test_what_is_no_table_is_refused_with_its_line(tmp_path, content, message):
    with pytest.raises(ProblemError, match=message) as caught:
        read_table(written(tmp_path, content))
    assert str(caught.value).startswith("u.csv")


@pytest.mark.parametrize("text", ["0,5", "1_000", "０", "0x10", "1e", "", "1 2", "--1", "e5", "1d3", "nan0"])
def test_what_is_no_number_is_none(text):
    with pytest.raises(ValueError, match="is no number|there is no number"):
        number(text)


@pytest.mark.parametrize("text", ["-1.", ".5", "+1E-3", "NaN", "-inf", "1e999"])
def test_numbers_are_those_of_python(text):
    assert np.array_equal(number(text), float(text), equal_nan=True)


def test_lines_are_counted_as_an_editor_counts_them(tmp_path):
    """A form feed or a separator inside a line ends none."""
    assert [line for line, _ in read_rows(written(tmp_path, "a\x0cb\r\nc\rd\n\u2028\ne"))] == [1, 2, 3, 5]


def test_what_may_never_end_is_not_opened(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path, message in (
        (tmp_path / "pipe", "is a pipe, expected a file"),
        (tmp_path, "is a folder, expected a file"),
        (tmp_path / "nowhere", "cannot be read: No such file"),
    ):
        with pytest.raises(ProblemError, match=message):
            text_of(path)
    with pytest.raises(ProblemError, match="is a device"):
        text_of(type(tmp_path)("/dev/zero"))
    (tmp_path / "large").write_bytes(b"a" * 1001)
    with pytest.raises(ProblemError, match=r"larger than 0.001 MB"):
        text_of(tmp_path / "large", largest=1000)
