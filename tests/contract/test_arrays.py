"""Arrays of every kind at every entry that takes them: the numbers, or a sentence that names the array."""

from decimal import Decimal
from fractions import Fraction

import casadi as ca
import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp

from casadi_gnc import synthesis
from casadi_gnc.allocation import AllocationProblem, Allocator
from casadi_gnc.benchmarks import outside
from casadi_gnc.errors import AllocationError, BenchmarkError, ProblemError, SynthesisError
from casadi_gnc.mathematics.arrays import real_array
from casadi_gnc.problem_files.allocation_file import load_allocation

NUMBERS = np.array([[1.0, 2.0], [3.0, 4.5]])
TAKEN = {
    "lists": NUMBERS.tolist(),
    "tuples": tuple(map(tuple, NUMBERS.tolist())),
    "big-endian": NUMBERS.astype(">f8"),
    "single": NUMBERS.astype(np.float32),
    "half": NUMBERS.astype(np.float16),
    "long": NUMBERS.astype(np.longdouble),
    "Fortran order": np.asfortranarray(NUMBERS),
    "strides": np.repeat(NUMBERS, 2, axis=1)[:, ::2],
    "sparse": sp.csr_matrix(NUMBERS),
    "sparse array": sp.coo_array(NUMBERS),
    "DM": ca.DM(NUMBERS),
    "objects": np.array([[1, Fraction(2)], [3.0, np.float32(4.5)]], dtype=object),
    "nothing masked": np.ma.masked_array(NUMBERS, mask=False),
    "matrix": np.asmatrix(NUMBERS),
    "read-only": np.frombuffer(NUMBERS.tobytes()).reshape(2, 2),
}
REFUSED = {
    "complex": (NUMBERS + 2j, "complex numbers"),
    "complex without imaginary part": (NUMBERS.astype(complex), "complex numbers"),
    "complex in a list": ([[1j, 2.0], [3.0, 4.0]], "complex numbers"),
    "complex objects": (np.array([[1j, 2], [3, 4]], dtype=object), "complex numbers"),
    "sparse complex": (sp.csr_matrix(NUMBERS * 1j), "complex numbers"),
    "ragged": ([[1.0, 2.0, 3.0], [4.0, 5.0]], "rows of different length: 3, 2"),
    "ragged objects": (np.array([[1.0, 2.0], [3.0]], dtype=object), "rows of different length: 2, 1"),
    "a number beside a row": ([1.0, [2.0]], "numbers stand beside rows"),
    "masked": (np.ma.masked_greater(NUMBERS, 4.0), "masked entries"),
    "text": ([["1.0", "2.0"], ["3.0", "4.0"]], "holds text"),
    "bytes": (NUMBERS.astype("S"), "holds text"),
    "truth": (NUMBERS > 2, "truth values"),
    "dates": (np.array([["2020-01-01"]], dtype="M8[D]"), "dates"),
    "nothing": ([[None, 1.0], [1.0, 1.0]], "NoneType"),
    "decimals": ([[Decimal(1), 1.0]], "Decimal"),
    "a mapping": ({"a": 1}, "dict"),
    "symbols": (ca.SX.sym("x", 2, 2), "symbols"),
    "too large": ([[10**400, 1]], "too large"),
    "records": (np.zeros(2, dtype=[("a", float)]), "no numbers"),
}


@pytest.mark.parametrize("kind", TAKEN)
def test_numbers_are_taken_whatever_holds_them(kind):
    found = real_array("A", TAKEN[kind])
    np.testing.assert_array_equal(found, NUMBERS)
    assert type(found) is np.ndarray
    assert found.dtype == np.dtype("=f8")
    np.testing.assert_array_equal(AllocationProblem(TAKEN[kind], 0.0, 1.0).effectiveness, NUMBERS)
    assert synthesis.h_infinity_norm(-np.eye(2), TAKEN[kind], np.eye(2)).upper == pytest.approx(
        np.linalg.norm(NUMBERS, 2)
    )


def entries(value):
    """Return calls that are given an array, and what each of them raises and calls it."""
    problem = AllocationProblem(NUMBERS, 0.0, 1.0)
    return [
        (lambda: AllocationProblem(value, 0.0, 1.0), AllocationError, "effectiveness"),
        (lambda: AllocationProblem(NUMBERS, value, 1.0), AllocationError, "lower"),
        (lambda: AllocationProblem(NUMBERS, 0.0, 1.0, coupling=value, errors=[NUMBERS]), AllocationError, "coupling"),
        (lambda: AllocationProblem(NUMBERS, 0.0, 1.0, coupling=NUMBERS, errors=value), AllocationError, "errors"),
        (lambda: Allocator(problem).solve(value), AllocationError, "command"),
        (lambda: Allocator(problem).solve(np.ones(2), value), AllocationError, "previous"),
        (lambda: Allocator(problem).solve(np.ones(2), np.ones(2), (value, value)), AllocationError, "box"),
        (lambda: synthesis.h_infinity_norm(value, np.eye(2), np.eye(2)), SynthesisError, "A"),
        (lambda: synthesis.state_feedback(-np.eye(2), value, *[np.eye(2)] * 3), SynthesisError, "B"),
        (lambda: synthesis.observer(-np.eye(2), np.eye(2), value, np.eye(2)), SynthesisError, "E"),
        (lambda: synthesis.stable_ratios(value, -np.eye(2)), SynthesisError, "fixed"),
        (lambda: synthesis.peak_command(-np.eye(2), np.eye(2), value), SynthesisError, "vertices"),
        (lambda: synthesis.box_vertices(value, np.ones(2)), SynthesisError, "lower"),
    ]


@pytest.mark.parametrize("kind", REFUSED)
def test_other_things_are_refused_with_the_name_of_the_array(kind):
    value, words = REFUSED[kind]
    for call, error, name in entries(value):
        with pytest.raises(error, match=words) as told:
            call()
        assert str(told.value).startswith(name)
        assert "\n" not in str(told.value)


def test_complex_matrices_of_matlab_are_refused(tmp_path):
    path = tmp_path / "c.mat"
    scipy.io.savemat(path, {"B": np.array([[1j, 1.0]]), "v": np.ones((1, 3)), "plim": np.array([[0, 1.0]] * 2)})
    with pytest.raises(BenchmarkError, match="B holds complex numbers"):
        outside.read_outside(path)


def test_ragged_files_are_refused_with_their_place(tmp_path):
    for key in ("effectiveness", "coupling", "errors"):
        tables = {
            "effectiveness": [[1.0, -1.0, 0.5], [0.0, 1.0, 0.0]],
            "coupling": [[1.0, 0, 0]],
            "errors": [[[1.0], [0]]],
        }
        tables[key] = [[[1.0], []]] if key == "errors" else [[1.0, 0.0, 0.5], [0.0, 1.0]]
        path = tmp_path / "a.toml"
        text = "\n".join(f"{name} = {value}" for name, value in tables.items())
        path.write_text(f'format = 1\nkind = "allocation"\n[matrices]\n{text}\nlower = 0.0\nupper = 1.0\n')
        with pytest.raises(ProblemError, match=r"rows of ") as told:
            load_allocation(path)
        assert "a.toml" in str(told.value)
        assert key in str(told.value)
