"""More than 200 functions as C: every operation and kind of piece, against CasADi's machine and on emulated targets."""

import casadi as ca
import numpy as np
import pytest
from packages import needs_target
from printed_functions import Printed, everything, on_the_machine, same_words

import casadi_gnc as gnc
from casadi_gnc.embedded.programs import expanded, is_plain
from casadi_gnc.missions.onboard import describe, sampled

UNARY = (
    *(
        "exp",
        "log",
        "expm1",
        "log1p",
        "sqrt",
        "sq",
        "twice",
        "sin",
        "cos",
        "tan",
        "asin",
        "acos",
        "atan",
        "sinh",
        "cosh",
    ),
    *("tanh", "erf", "asinh", "acosh", "atanh", "fabs", "floor", "ceil", "sign", "neg", "inv", "not"),
)
BINARY = (
    *("add", "sub", "mul", "div", "pow", "atan2", "fmod", "copysign", "fmin", "fmax", "hypot", "lt", "le", "eq", "ne"),
    *("and", "or", "if_else_zero"),
)
MISSIONS = {
    "huang2020/slew": "funnel_pinv",
    "huang2019/nominal": "observers_robust",
    "shi2020/docking": "iobc",
    "sun2018/circular_orbit": "tracking",
    "tao2019/case1": "funnels",
}


def code(name: str) -> int:
    return getattr(ca, f"OP_{name.upper()}")


def random_graph(seed: int, operations: int, *also: str) -> ca.Function:
    """Return a function of random operations on values that stay of order one, each operation in turn."""
    rng, x = np.random.default_rng(seed), ca.SX.sym("x", 4)
    values = ca.vertsplit(x)
    names = [*UNARY, *BINARY, *also]
    while len(values) < operations:
        name = names[(seed + len(values)) % len(names)]
        one, other = (values[i] for i in rng.integers(max(0, len(values) - 40), len(values), 2))
        made = ca.SX.unary(code(name), one) if name in UNARY else ca.SX.binary(code(name), one, other)
        shown = ca.sin(made) + 0.25 if len(values) % 3 == 0 else made
        # NaN ends here: its sign, which copysign sees, is the processor's.
        bounded = ca.if_else(ca.fabs(made) <= 100, shown, values[len(values) % 4] * 0.5)
        values.append(one + values[0] if bounded.is_constant() else bounded)  # what CasADi folds tests nothing
    return ca.Function(f"graph{seed}", [x], [ca.vertcat(*values[4:])])


def network() -> ca.Function:
    """Return a network of three layers, matrix by matrix."""
    rng, x = np.random.default_rng(5), ca.MX.sym("x", 8)
    layer = x
    for rows, columns in ((16, 8), (16, 16), (3, 16)):
        weights, bias = (ca.DM(rng.normal(size=size) / 3) for size in ((rows, columns), (rows, 1)))
        layer = ca.tanh(weights @ layer + bias)
    return ca.Function("network", [x], [layer])


def kalman(solve: bool) -> ca.Function:
    """Return a step of an extended Kalman filter of a pendulum with drift, measured in two angles."""
    x, p, z, u = ca.MX.sym("x", 3), ca.MX.sym("p", 3, 3), ca.MX.sym("z", 2), ca.MX.sym("u")
    ahead = x + 0.01 * ca.vertcat(x[1], -9.81 * ca.sin(x[0]) + u + x[2], 0)
    slope = ca.jacobian(ahead, x)
    spread = slope @ p @ slope.T + 1e-4 * ca.DM.eye(3)
    sight = ca.vertcat(ca.sin(ahead[0]), ahead[0] + ahead[2])
    look = ca.substitute(ca.jacobian(sight, x), x, x)
    s = look @ spread @ look.T + 1e-2 * ca.DM.eye(2)
    det = s[0, 0] * s[1, 1] - s[0, 1] * s[1, 0]
    inverse = ca.vertcat(ca.horzcat(s[1, 1], -s[0, 1]), ca.horzcat(-s[1, 0], s[0, 0])) / det
    gain = ca.solve(s, look @ spread).T if solve else spread @ look.T @ inverse
    after = ahead + gain @ (z - sight)
    return ca.Function("kalman", [x, p, z, u], [after, spread - gain @ look @ spread])


def shapes() -> list[ca.Function]:
    """Return MX functions with calls, maps, branches, tables and splines, of several sizes each."""
    found = []
    for n in (1, 2, 3, 5, 8):
        x, c = ca.MX.sym("x", n), ca.MX.sym("c")
        grid = np.linspace(-2, 2, n + 2)
        table = ca.interpolant("table", "linear", [grid**3 if n % 2 else grid], np.cos(3 * grid))
        smooth = ca.interpolant("smooth", "bspline", [np.linspace(-2, 2, n + 4)], np.sin(np.linspace(-2, 2, n + 4)))
        s = ca.SX.sym("s", n)
        call = ca.Function("call", [s], [ca.sin(s) * ca.sumsqr(s), s[-1]])
        found += [
            ca.Function("calls", [x], [call(call(x)[0])[0] + call(x * 2)[0], call(x)[1]]),
            ca.Function("maps", [x], [*call.map(4)(ca.horzcat(x, 2 * x, -x, x * x))]),
            ca.Function("steps", [x], [ca.Function("one", [s], [call(s)[0]]).mapaccum(6 * n)(x)]),
            ca.Function(
                "branches", [x, c], [ca.if_else(c > 0, call(x)[0], x, True), ca.conditional(c, [x], 2 * x, True)]
            ),
            ca.Function("tables", [x], [table(x[0]), smooth(x[0]), ca.jacobian(smooth(x[0]) * x[-1], x)]),
            ca.Function("matrices", [x], [ca.norm_2(x) * x, ca.mtimes(x, x.T), ca.sum1(x)]),
        ]
    return found


def steps_of_missions() -> list[ca.Function]:
    """Return the tapes of the controllers of missions."""
    return [
        tape
        for problem, scheme in MISSIONS.items()
        for tape in describe(sampled(gnc.load(problem)), scheme, ()).tapes.values()
    ]


@pytest.mark.slow
def test_more_than_two_hundred_functions_have_the_words_of_the_machine():
    functions = [random_graph(seed, 20 + seed % 40) for seed in range(130)]
    functions += [random_graph(1000 + seed, 150) for seed in range(15)] + [random_graph(2000, 2500)]
    functions += [random_graph(3000 + seed, 80, "remainder") for seed in range(5)]
    functions += [*shapes(), *steps_of_missions(), network(), kalman(solve=False)]
    assert len(functions) >= 200
    printed, rng = Printed(functions, optimise="-O1"), np.random.default_rng(11)
    compared = numbers = 0
    for k, function in enumerate(functions):
        # CasADi's way from MX to SX simplifies some sums and products; the C is what it makes.
        machine = expanded(function, function.name()) if is_plain(function) else function
        for draw in range(6):
            given = [rng.normal(size=function.nnz_in(i)) for i in range(function.n_in())]
            given = [np.round(one) for one in given] if draw == 5 else given
            _, found = printed(k, *given)
            for one, other in zip(found, on_the_machine(machine, *given), strict=True):
                assert same_words(one, other), (k, function, given)
                compared, numbers = compared + one.size, numbers + int(np.isfinite(one).sum())
    assert compared > 40_000
    assert numbers > 0.8 * compared  # not for lack of numbers


def one_of_all() -> ca.Function:
    """Return a function with many of the set inside."""
    x, a, c = ca.MX.sym("x", 4), ca.MX.sym("a", 3, 3), ca.MX.sym("c")
    results = list(everything()(x[:3], a, c))
    results += [random_graph(seed, 60)(x) for seed in range(4)]
    p = a @ a.T + ca.DM.eye(3)
    results += [network()(ca.vertcat(x, x)), *kalman(solve=True)(x[:3], p, x[:2], c)]
    return ca.Function("all", [x, a, c], [ca.if_else(ca.fabs(one) <= 1e6, one, 0) for one in results])


@pytest.mark.long  # the search for a bound of its step goes on to its end, on each board
@pytest.mark.parametrize("real", ["float64", "float32"])
@needs_target("cortex-m4f")
@needs_target("cortex-m7")
@needs_target("rv64")
@needs_target("ppc64")
def test_a_function_with_everything_has_the_same_words_on_targets(tmp_path, real):
    gnc.generate(one_of_all(), tmp_path / "all", name="all_of_it", real=real, steps=60)
    found = gnc.verify(tmp_path / "all", ["cortex-m4f", "cortex-m7", "rv64", "ppc64"])
    assert found["words"] == 0
    assert found["comparisons"][0]["of"] > 60 * 300
