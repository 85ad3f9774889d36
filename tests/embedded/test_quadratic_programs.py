"""Quadratic programs of CasADi on the on-board solver: which are taken, what they answer, what is refused."""

import casadi as ca
import numpy as np
import pytest
from packages import needs_target
from scipy.optimize import lsq_linear

from casadi_gnc import generate
from casadi_gnc.delivery.vectors import read_vectors
from casadi_gnc.embedded import boards, targets
from casadi_gnc.embedded.host import HostPackage
from casadi_gnc.embedded.parts import Parts
from casadi_gnc.errors import PrinterError
from casadi_gnc.mathematics.low_rank import split

QUIET = {"print_header": False, "print_info": False, "print_iter": False, "error_on_fail": False}
MIXER = np.random.default_rng(20_190_501).normal(size=(3, 8))
WEIGHTS = np.linspace(1.0, 3.0, 8)


def law() -> ca.Function:
    """Return a step with three programs: eight actuators of three efforts, two unknowns together, two apart."""
    x, p = ca.MX.sym("x", 8), ca.MX.sym("p", 11)
    cost = 50 * ca.sumsqr(ca.mtimes(ca.DM(MIXER), x) - p[:3]) + 0.5 * ca.dot(ca.DM(WEIGHTS), x**2)
    eight = ca.qpsol("eight", "qrqp", {"x": x, "f": cost + 0.5 * ca.sumsqr(x - p[3:]), "p": p}, QUIET)
    two = ca.conic("two", "qrqp", {"h": ca.Sparsity.dense(2, 2)}, QUIET)
    single = ca.conic("single", "qrqp", {"h": ca.Sparsity.diag(2)}, QUIET)
    u, last, g = ca.MX.sym("u", 3), ca.MX.sym("last", 8), ca.MX.sym("g", 2)
    found = eight(p=ca.vertcat(5 * u, last), lbx=-1, ubx=ca.vertcat(ca.inf, np.ones(6), 1 + u[0] ** 2))
    dense = two(h=ca.DM([[4, 1], [1, 2]]), g=g, lbx=ca.vertcat(-0.2, g[1]), ubx=0.1 + g[0])
    apart = single(h=ca.diag(ca.DM([1e-3, 1e4])), g=u[:2], lbx=-3, ubx=3)
    results = [found["x"], found["f"], found["lam_x"], dense["x"], dense["cost"], apart["x"], found["x"]]
    names = ["x", "f", "lam", "dense", "dense_cost", "apart", "last_next"]
    return ca.Function("law", [u, last, g], results, ["u", "last", "g"], names)


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    folder = tmp_path_factory.mktemp("programs") / "law"
    generate(law(), folder, state={"last": "last_next"}, steps=256)
    return folder


@pytest.mark.slow
def test_answers_are_those_of_an_active_set_method_and_of_casadis_where_it_ends(package, rng):
    host, last = HostPackage(package, "law"), np.zeros(8)
    rows = rng.uniform(-1.0, 1.0, size=(200, 5))
    found = host.replay(rows.view(np.uint64), 31)
    whole = np.vstack([10 * MIXER, np.diag(np.sqrt(WEIGHTS)), np.eye(8)])
    machine, own, agreed = law(), 0, 0
    for row, words in zip(rows, found, strict=True):
        x, f, lam, dense, cost, apart, _ = np.split(words.view(np.float64), [8, 9, 17, 19, 20, 22])
        u, g = row[:3], row[3:]
        crossed = 0.1 + g[0] < -0.2 or g[1] > 0.1 + g[0]
        assert words[-1] == 64 * crossed  # a box that is empty, and then the last good answer
        if crossed:
            continue
        right, upper = np.concatenate([50 * u, np.zeros(8), last]), np.array([np.inf, *np.ones(6), 1 + u[0] ** 2])
        expected = lsq_linear(whole, right, (-np.ones(8), upper), method="bvls", tol=1e-15).x
        assert np.abs(x - expected).max() <= 1e-9
        slope = whole.T @ (whole @ x - right)
        assert np.abs(slope + lam).max() <= 1e-9 * max(np.abs(slope).max(), 1.0)
        assert f == pytest.approx(0.5 * np.sum((whole @ x - right) ** 2), rel=1e-9, abs=1e-9)
        h = np.array([[4.0, 1.0], [1.0, 2.0]])
        low, high = np.array([-0.2, g[1]]), np.full(2, 0.1 + g[0])
        root = np.linalg.cholesky(h).T
        expected = lsq_linear(root, -np.linalg.solve(root.T, g), (low, high + 1e-300), method="bvls", tol=1e-15).x
        assert np.abs(dense - expected).max() <= 1e-7
        assert cost == pytest.approx(0.5 * dense @ h @ dense + g @ dense, rel=1e-12, abs=1e-12)
        assert np.abs(apart - np.clip(-u[:2] / [1e-3, 1e4], -3.0, 3.0)).max() <= 1e-12
        theirs = np.array(machine(u, last, g)[0]).ravel()
        feasible = (theirs >= -1 - 1e-9).all() and (theirs <= upper + 1e-9).all()
        own += 1
        agreed += feasible and np.abs(theirs - x).max() <= 1e-6
        last = x
    assert own > 80
    assert agreed >= 0.5 * own  # qrqp gives up on some, and then gives points outside the bounds


@pytest.mark.slow
@needs_target("cortex-m7")
def test_words_are_the_same_on_a_cortex_m7_and_the_step_is_small(package):
    _, expected = read_vectors(package, "float64")
    found = targets.measure(package, "law", boards.find("cortex-m7"), float_only=False)
    assert int((found.outputs != expected).sum()) == 0
    assert np.median(found.instructions) <= 60_000
    assert found.bss == 0


def refused() -> dict[str, tuple[ca.Function, str]]:
    """Return programs that the on-board solver does not take, and what is said."""
    x, p = ca.MX.sym("x", 9), ca.MX.sym("p", 9)
    g = ca.MX.sym("g", 2)

    def conic(size: int, rows: int = 0, kind: str = "qrqp") -> ca.Function:
        sparsity = {"h": ca.Sparsity.dense(size, size), "a": ca.Sparsity.dense(rows, size)}
        return ca.conic("solver", kind, sparsity, QUIET)

    def outer(result: ca.MX, given: ca.MX = g) -> ca.Function:
        return ca.Function("outer", [given], [result])

    many = np.random.default_rng(3).normal(size=(9, 12))
    alone = ca.qpsol("alone", "qrqp", {"x": x, "p": p, "f": ca.sumsqr(x - p)}, QUIET)
    return {
        "constraints": (
            outer(conic(2, 1)(h=ca.DM.eye(2), g=g, a=ca.DM.ones(1, 2), uba=1)["x"]),
            r"outer, solver is a quadratic program with 1 linear constraints, expected bounds .* weighted squares",
        ),
        "changes": (
            outer(conic(2)(h=ca.diag(1 + g**2), g=g)["x"]),
            "outer, solver is a quadratic program whose matrix changes at run time, .* linear part",
        ),
        "indefinite": (
            outer(conic(2)(h=ca.DM([[1, 2], [2, 1]]), g=g)["x"]),
            "of 2 unknowns whose matrix is not positive definite, expected a positive diagonal and at most 6",
        ),
        "singular": (outer(conic(2)(h=ca.DM.ones(2, 2), g=g)["x"]), "matrix is not positive definite"),
        "rank": (
            outer(conic(12)(h=many.T @ many + np.eye(12) * np.arange(1, 13), g=ca.repmat(g, 6))["x"]),
            r"of 12 unknowns whose matrix is of another form, expected .* H = diag\(d\) \+ B'B",
        ),
        "lopsided": (outer(conic(2)(h=ca.DM([[3, 1], [0, 3]]), g=g)["x"]), "matrix is not symmetric"),
        "large": (outer(conic(65)(h=ca.DM.eye(65), g=ca.repmat(g[0], 65))["x"]), "of 65 unknowns, expected 1 to 64"),
        "itself": (alone, r"alone is a quadratic program itself, whose result lam_p is no number; make a function"),
        "bare": (conic(2), "solver is of kind Qrqp, .* call it in a function of its own"),
        "map": (outer(conic(2).map(2)(h=ca.DM.eye(2), g=ca.horzcat(g, g))["x"]), "solver is of kind Qrqp"),
    }


@pytest.mark.parametrize("name", list(refused()))
def test_other_programs_are_refused_with_their_form_and_what_to_do(name):
    function, sentence = refused()[name]
    with pytest.raises(PrinterError, match=sentence) as told:
        Parts().function(function)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize(("count", "rows"), [(1, 0), (4, 0), (6, 5), (7, 6), (8, 3), (12, 6), (13, 6), (20, 2)])
def test_matrices_of_the_form_are_split(count, rows, rng):
    b, d = rng.normal(size=(rows, count)), 10.0 ** rng.uniform(-1.5, 0.0, size=count)
    matrix = np.diag(d) + b.T @ b
    found = split(matrix.tolist(), 6)
    assert found is not None
    diagonal, factor = np.array(found[0]), np.array(found[1]).reshape(-1, count)
    assert len(factor) <= rows
    assert diagonal.min() > 0.0
    assert np.abs(np.diag(diagonal) + factor.T @ factor - matrix).max() <= 1e-9 * np.linalg.eigvalsh(matrix).min()
