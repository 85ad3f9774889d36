"""Any function as C: branches, loops, tables, splines, linear systems and long functions, against CasADi's machine."""

import json
import re
import subprocess
import sys
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from printed_functions import Printed, everything, on_the_machine, same_words

from casadi_gnc.embedded import programs
from casadi_gnc.embedded.parts import Parts
from casadi_gnc.errors import PrinterError


def test_every_kind_of_piece_has_the_words_of_the_machine_and_solves_what_it_is_given(rng):
    function = everything()
    printed = Printed([function])
    linear = (9, 10, 11)
    for k in range(120):
        x, a = rng.normal(size=3) * 2 + 1, rng.normal(size=(3, 3))
        x = np.round(x) if k % 4 == 0 else x  # on the grid
        given = x, a.ravel(order="F"), [float(k % 5 - 1)]
        status, found = printed(0, *given)
        expected = on_the_machine(function, *given)
        assert status == 0
        for i, (one, other) in enumerate(zip(found, expected, strict=True)):
            if i not in linear:
                assert same_words(one, other), (i, given)
        # Backward stable: the residual is rounding of the data (Higham 2002, 9.3), whatever the condition number.
        right = 2 * x * x
        solution = found[9] - x
        scale = np.abs(a).sum() * np.abs(solution).max() + np.abs(right).max() + np.abs(x).max()
        assert np.abs(a @ solution - right).max() <= 50 * np.finfo(float).eps * scale
        inverse = found[11].reshape(3, 3, order="F")
        assert (
            np.abs(a @ inverse - np.eye(3)).max() <= 50 * np.finfo(float).eps * np.abs(a).sum() * np.abs(inverse).max()
        )


def test_pieces_are_printed_once_and_as_what_they_are():
    parts = Parts()
    parts.function(everything())
    text = parts.text()
    for piece in ("f_uneven", "f_both", "f_smooth", "f_solve_3", "f_jac_uneven"):
        assert len(re.findall(rf"static void {piece}\(", text)) == 1, piece
    assert "for (k = 0; k < 3; ++k)" in text
    x, u = ca.SX.sym("x", 3), ca.SX.sym("u")
    later = x
    for _ in range(20):
        later = ca.vertcat(later[1] + ca.sin(u), later[2] * later[0], ca.cos(later[0]))
    many = Parts()
    many.function(ca.Function("step", [x, u], [later]).mapaccum("steps", 100))
    assert many.text().count("gnc_cos(") == 20  # those of one step, not of a hundred
    assert re.search(r"if \(\(which > -1\.\) && \(which < 1\.\)\)", text)


def test_a_function_is_looked_at_once_however_often_it_is_called(monkeypatch):
    s, x = ca.SX.sym("s", 2), ca.MX.sym("x", 2)
    calm = ca.Function("calm", [s], [ca.sin(s) * ca.sumsqr(s) + sum((s[0] / (k + 2) for k in range(40)), s[1])])
    law = ca.Function("law", [x], [sum((calm(x * k) for k in range(1, 31)), x)])
    looked, has_calls = [], programs._has_calls
    monkeypatch.setattr(programs, "_has_calls", lambda function: looked.append(function.name()) or has_calls(function))
    parts = Parts()
    parts.function(law)
    assert sum("f_calm(" in line for line in parts.text().splitlines() if ";" in line) == 30
    assert looked.count("probe") == 1
    assert looked.count("calm") <= 3


def test_functions_that_are_never_inlined_stay_functions_wherever_they_are_called(rng):
    x, y = ca.SX.sym("x", 3), ca.MX.sym("y", 3)
    closed = {"never_inline": True}
    both = ca.Function("both", [x], [ca.sin(x), ca.sum1(x)], closed)
    one = ca.Function("one", [y], [ca.cos(y) * both(y)[1]], closed)
    other = ca.Function("one", [y], [y * y], closed)  # another one of the same name
    of_scalars = ca.Function("of_scalars", [x], [one(both(x)[0] * 2) + other(x)])
    of_matrices = ca.Function("of_matrices", [y], [one(one(y)) + other(both(y)[0])], closed)
    loop = of_matrices.map(4)
    printed = Printed([of_scalars, of_matrices, loop])
    for name in ("f_both", "f_one", "f_one_2", "f_of_matrices"):
        assert len(re.findall(rf"static void {name}\(", printed.parts.text())) == 1, name
    for k, function in enumerate(printed.functions):
        given = rng.normal(size=function.nnz_in(0))
        assert same_words(printed(k, given)[1][0], on_the_machine(function, given)[0])


@pytest.mark.parametrize(
    "matrix", [np.zeros((3, 3)), [[1, 2, 3], [4, 5, 6], [7, 8, 9]], [[1, 1, 0], [1, 1, 0], [0, 0, 1]]]
)
def test_singular_matrices_raise_the_status_and_give_zeros(matrix):
    a, b = ca.MX.sym("a", 3, 3), ca.MX.sym("b", 3)
    printed = Printed([ca.Function("f", [a, b], [ca.solve(a, b)])])
    status, (found,) = printed(0, np.array(matrix, dtype=float).T.ravel(), np.ones(3))
    assert status == 4
    assert not found.any()
    # Rows of very different size are no singularity: the answer is exact.
    status, (found,) = printed(0, np.diag([1e-200, 1.0, 1e150]).ravel(), np.array([1e-200, 2.0, 3e150]))
    assert (status, list(found)) == (0, [1.0, 2.0, 3.0])


def long_function(operations: int) -> ca.Function:
    """Return a function of about so many operations whose values live long."""
    x = ca.SX.sym("x", 6)
    values, rng = list(ca.vertsplit(x)), np.random.default_rng(1)
    while len(values) < operations:
        i, j = rng.integers(max(0, len(values) - 2000), len(values), 2)
        one, other = values[i], values[j]
        kind = len(values) % 5
        values.append(
            (one - other, one * 0.5 + 0.5, ca.if_else(one < other, one, -other), one * other, ca.sin(one))[kind]
        )
    return ca.Function("long", [x], [ca.vertcat(*values[-20:]), values[operations // 2]])


def test_long_functions_are_split_into_functions_of_bounded_length_with_the_same_words(rng):
    function = long_function(10_000)
    printed = Printed([function], optimise="-O1")
    bodies = re.findall(r"static void f_long_part\d+\(.*?\n}", printed.text, re.DOTALL)
    assert len(bodies) > 3
    assert max(body.count("\n") for body in bodies) < 3500
    given = rng.normal(size=6)
    _, found = printed(0, given)
    assert all(same_words(one, other) for one, other in zip(found, on_the_machine(function, given), strict=True))


QUIET = {"print_header": False, "print_info": False}


def refused() -> dict[str, tuple[ca.Function, str]]:
    """Return functions that have no C form, and what is said."""
    x, p = ca.MX.sym("x", 2), ca.MX.sym("p", 2)
    nlp = ca.nlpsol(
        "solver",
        "sqpmethod",
        {"x": x, "p": p, "f": ca.sumsqr(x - p)},
        {"qpsol": "qrqp", "print_header": False, "qpsol_options": QUIET},
    )
    conic = ca.conic("quadratic", "qrqp", {"h": ca.Sparsity.dense(2, 2), "a": ca.Sparsity.dense(1, 2)}, QUIET)
    root = ca.rootfinder("root", "newton", ca.Function("g", [x, p], [x * x - p]))
    large = ca.MX.sym("large", 33, 33)
    sparse = ca.MX.sym("sparse", ca.Sparsity.banded(40, 1))
    index = ca.MX.sym("index")

    class Mine(ca.Callback):
        def __init__(self) -> None:
            ca.Callback.__init__(self)
            self.construct("mine")

    refused.mine = Mine()  # type: ignore[attr-defined]  # CasADi keeps no reference

    def within(called: ca.MX, *given: ca.MX) -> ca.Function:
        return ca.Function("outer", [ca.Function("middle", list(given), [called])(*given)] and list(given), [called])

    return {
        "nlpsol": (within(nlp(x0=p, p=p)["x"], p), "outer, solver is of kind Sqpmethod, .* solve it on the ground"),
        "conic": (conic, "quadratic is of kind Qrqp, .* call it in a function of its own"),
        "rootfinder": (within(root(p, p), p), "outer, root is of kind Newton, .* Newton steps in CasADi symbols"),
        "callback": (within(refused.mine(index), index), "outer, mine is of kind Callback, .* Python does not fly"),  # type: ignore[attr-defined]
        "solve": (
            within(ca.solve(large, large[:, 0]), large),
            "dense linear system of 33 unknowns, expected at most 32",
        ),
        "sparse": (
            within(ca.solve(sparse, ca.MX.ones(40)), sparse),
            r"sparse \(118 entries\) linear system of 40 unknowns",
        ),
        "find": (within(ca.find(x), x), "outer: a node searches the first element that is not zero"),
        "logsumexp": (within(ca.logsumexp(x), x), "outer has a node LogSumExp, which has no C form here"),
        "nan": (
            within(ca.interpolant("bad", "linear", [[0, 1]], [1, np.nan])(index), index),
            "outer, bad is a table with an entry that is no finite number",
        ),
        "erfinv": (ca.Function("outer", [index], [ca.erfinv(index)]), "operation 'erfinv' has no C form here"),
    }


@pytest.mark.parametrize("name", list(refused()))
def test_what_has_no_c_form_is_refused_by_name_with_what_to_do(name):
    function, sentence = refused()[name]
    with pytest.raises(PrinterError, match=sentence) as told:
        Parts().function(function)
    assert "\n" not in str(told.value)


def test_functions_of_too_many_operations_are_refused_with_their_size(monkeypatch):
    monkeypatch.setattr("casadi_gnc.embedded.programs.MOST_OPERATIONS", 1000)
    with pytest.raises(
        PrinterError, match=r"long has \d+ operations, expected at most 1000; write what repeats as a map"
    ):
        Parts().function(long_function(10_000))


@pytest.mark.long  # compiles 1e5 operations three times; the script prints the times as well
def test_a_function_of_a_hundred_thousand_operations_takes_less_than_a_gigabyte():
    script = Path(__file__).parents[1] / "bench" / "large_function.py"
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=True)
    found = json.loads(done.stdout)
    assert found["operations"] > 100_000
    assert max(found["own_MB"], found["compilers_MB"]) < 1000
