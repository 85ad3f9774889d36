"""Derivatives of operations, of largest and least, of formulas, and of whole flights.

Truths: differences of the values themselves, extrapolated (Richardson), and what is known of soft maxima.
"""

import itertools
import sys
from importlib import import_module
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from mpmath import mp

import casadi_gnc
from casadi_gnc.allocation.in_flight import OnlineInFlight
from casadi_gnc.allocation.online import OnlineSolver
from casadi_gnc.errors import FlightError
from casadi_gnc.mathematics.linearised import linearised
from casadi_gnc.mathematics.soft import slack, soft_maximum, soft_minimum
from casadi_gnc.missions.one_build import OneBuild
from casadi_gnc.missions.parameters import vary
from casadi_gnc.missions.requirements import Requirement, evaluating
from casadi_gnc.missions.scheme import Metric
from casadi_gnc.missions.sensitivities.engine import DerivativeEngine
from casadi_gnc.missions.sensitivities.outcomes import _OfMetric
from casadi_gnc.missions.sensitivities.robustness import weighed_robustness
from casadi_gnc.signals import Layout, Signal

sys.path.insert(0, str(Path(__file__).parents[1] / "oracles"))
long_double_flight = import_module("long_double_flight")

X = ca.SX.sym("x", 3)
#: Every operation that a tape may have, at a point where it is smooth.
OPERATIONS = [
    X[0] + 2 * X[1] - X[2], X[0] * X[1] * X[2], X[0] / X[1], -X[0], X[0] ** 2, 1 / X[1], 2 * X[0],
    ca.exp(X[0]), ca.log(X[1]), ca.expm1(X[0]), ca.log1p(X[1]), X[1] ** X[0], X[1] ** 2.5, ca.sqrt(X[1]),
    ca.sin(X[0]), ca.cos(X[0]), ca.tan(X[0]), ca.asin(X[0]), ca.acos(X[0]), ca.atan(X[0]), ca.atan2(X[0], X[2]),
    ca.sinh(X[0]), ca.cosh(X[0]), ca.tanh(X[0]), ca.asinh(X[0]), ca.acosh(1 + X[1]), ca.atanh(X[0]),
    ca.fabs(X[2]), ca.floor(X[1]) * X[0], ca.ceil(X[1]) * X[0], ca.fmod(X[1], X[0]), ca.sign(X[2]) * X[1],
    ca.copysign(X[0], X[2]), ca.hypot(X[0], X[1]), ca.fmin(X[0], X[1]), ca.fmax(X[0], X[1]),
    ca.if_else(X[0] < X[1], X[0] * X[2], ca.sqrt(X[0] - X[1])), ca.if_else(X[0] > X[1], ca.log(X[2]), X[2]),
]  # fmt: skip
AT = np.array([0.3, 1.7, -0.6])


def finite(column):
    values = np.array(column).ravel()
    return np.where(np.isfinite(values), values, 0.0)


def richardson(f, x, direction, step):
    """Return the slope of f by central differences of three steps, and an estimate of its error."""
    d = [(f(x + s * direction) - f(x - s * direction)) / (2 * s) for s in (step, step / 2, step / 4)]
    once = [(4 * b - a) / 3 for a, b in itertools.pairwise(d)]
    found = (16 * once[1] - once[0]) / 15
    return found, abs(found - once[1])


@pytest.mark.parametrize("one", OPERATIONS, ids=str)
def test_every_operation_has_its_derivative(one):
    tape = ca.Function("f", [X], [one], ["x"], ["y"])
    three = linearised(tape, ())
    value, partials = three.values(AT)
    assert float(value) == float(tape(AT))
    back = np.array(three.reverse(finite(partials), 1.0)).ravel()
    for i, direction in enumerate(np.eye(3)):
        slope, _ = richardson(lambda x: float(tape(x)), AT, direction, 1e-2)
        assert float(three.forward(finite(partials), direction)) == pytest.approx(slope, rel=1e-7, abs=1e-8)
        assert back[i] == pytest.approx(slope, rel=1e-7, abs=1e-8)


def test_a_root_at_zero_and_a_branch_that_was_not_taken_leave_no_mark():
    for one in (ca.sqrt(ca.sumsqr(X)), ca.if_else(X[0] < 1, X[1], ca.log(X[0]) / X[0])):
        three = linearised(ca.Function("f", [X], [one], ["x"], ["y"]), ())
        _, partials = three.values([0, 0, 0])
        gradient = np.array(three.reverse(finite(partials), 1.0)).ravel()
        assert np.isfinite(gradient).all()


def test_what_stays_still_has_no_derivative():
    tape = ca.Function("f", [X, ca.SX.sym("t")], [X[0] * X[1], X[0] > 1], ["x", "t"], ["y", "flags"])
    three = linearised(tape, ("t", "flags"))
    assert three.moving == ("x",)
    assert three.forward.name_out() == ["y"]
    assert three.forward.name_in() == ["partials", "x"]


def test_soft_maxima_lie_where_they_are_said_to():
    numbers = np.random.default_rng(1).standard_normal(50)
    for temperature in (1e-9, 1e-3, 0.1, 3.0):
        value, counts = soft_maximum(numbers, temperature)
        assert 0 <= value - numbers.max() <= slack(50, temperature)
        assert counts.sum() == pytest.approx(1)
        low, _ = soft_minimum(numbers, temperature)
        assert 0 <= numbers.min() - low <= slack(50, temperature)
    assert soft_maximum(numbers, 0.0)[0] == numbers.max()


FORMULAS = [
    "always(x[1] <= 2)", "eventually[1, 4](x[1] > 1) and not x[2] > 3", "always[0, 9](eventually[0, 3](x[1] >= 0))",
    "held[2](x[1] < 3) or always[3, 5](x[2] < 1)", "(x[1] < 1.5) until[1, 6] (x[2] > 0.5)",
    "not ((x[1] < 1.5) until[0, 6] (x[2] > 0.5))", "always[3, 20](held[2](x[1] < 3) until[2, 5] (x[2] > 1))",
]  # fmt: skip
LAYOUT = Layout((Signal("time"), Signal("x", 2)))


@pytest.mark.parametrize("formula", FORMULAS)
def test_robustness_counts_its_margins(formula):
    row = LAYOUT.symbol("row")
    bound = Requirement("A", formula=formula).bind(LAYOUT, row, 1.0)
    margins = np.random.default_rng(7).standard_normal((len(bound.margins), 25))
    exact, counts, none = weighed_robustness(bound.tree, margins, 0.0)
    assert none == 0
    assert exact == evaluating.robustness(bound.tree, margins)[0]
    assert set(np.abs(counts).ravel()) == {0, 1}
    for temperature in (1e-6, 0.2):
        value, counts, most = weighed_robustness(bound.tree, margins, temperature)
        assert abs(value - exact) <= most
        direction = np.random.default_rng(8).standard_normal(margins.shape)
        slope = richardson(
            lambda m, T=temperature: weighed_robustness(bound.tree, m, T)[0], margins, direction, temperature / 20
        )[0]
        assert float((counts * direction).sum()) == pytest.approx(slope, rel=1e-5, abs=1e-7)


@pytest.mark.parametrize("norm", ["max", "two"])
@pytest.mark.parametrize("kind", ["settling", "reaching", "peak", "least", "final", "mean", "sample_sum"])
def test_metrics_count_their_samples(kind, norm):
    rng = np.random.default_rng(3)
    asked = np.exp(-np.arange(20.0) / 6)[:, None] * (1 + 0.2 * rng.random((20, 2)))
    # Settling is asked of the whole flight.
    window = {} if kind == "settling" else {"after": 1.0, "until": 8.0}
    metric = Metric("m", kind, "x", threshold=0.6, norm=norm, **window)
    outcome = _OfMetric(metric, LAYOUT, 0.5)
    exact = outcome.weigh(asked, 0.0)
    for temperature in (1e-4, 0.05):
        found = outcome.weigh(asked, temperature)
        assert abs(found.value - exact.value) <= found.slack + 1e-15
        direction = rng.standard_normal(asked.shape)
        slope = richardson(lambda a, T=temperature: outcome.weigh(a, T).value, asked, direction, 1e-6)[0]
        assert float((found.weights * direction).sum()) == pytest.approx(slope, rel=1e-5, abs=1e-7)


def flown(name, scheme, keys, samples=1000, away=0.0):
    """Return short flights, an engine that asks for all states and actuators, and weights for each of their numbers.

    They begin at numbers, (P,), that are the file's own, or drawn `away` from them, as a share of each.
    """
    mission = casadi_gnc.load(name.removesuffix(" continuous"), strict=False)
    mode = "continuous" if name.endswith("continuous") else mission.timing.mode
    short = mission.with_timing(duration=mission.timing.sample_period * samples, record_every=1, mode=mode)
    varied = vary(short, keys, scheme)
    layout = varied.tapes.row
    row = layout.symbol("row")
    efforts = varied.scheme.actuation.named("limited").names
    names = (*short.truth.state.names, *efforts, *short.truth.inputs.names)
    places = [i for name in names for i in range(*layout.place(name).indices(layout.size))]
    engine = DerivativeEngine(varied, ca.Function("quantities", [row], [row[places]]))
    own = varied.parameters.nominal
    drawn = np.random.default_rng(1).uniform(-1, 1, len(own))
    p = own + away * drawn * np.where(own == 0, np.abs(own).max() or 1.0, np.abs(own))
    record = OneBuild(varied).fly_row(p, mission.noise.seed, decimation=1).samples[:, places]
    sizes = np.abs(record).max(axis=0)
    weights = np.random.default_rng(0).standard_normal(record.shape) / np.where(sizes > 0, sizes, 1)
    return varied, engine, p, places, record, weights


#: Of the other missions, which take longer to build.
MORE = {
    "tao2019/case1": ("funnels", ["initial.position_m"]),
    "sun2018/circular_orbit": ("tracking", ["initial.position_m"]),
    "shi2020/docking": ("iobc", ["initial.*"]),
    "huang2020/slew": ("funnel_pinv", ["initial.rate_rad_per_s", "scheme.funnel_pinv.law.rate_gain"]),
    "satellites/slew": ("pd", ["initial.axis", "initial.angle_deg"]),
}
#: Schemes whose allocation is an expression, in both modes, and what they are differentiated by.
FLIGHTS = {
    "huang2020/detumble": ("observer_pinv", ["initial.rate_rad_per_s", "scheme.observer_pinv.law.rate_gain"]),
    "huang2020/detumble continuous": ("damping_pinv", ["initial.rate_rad_per_s", "truth.inertia_factor"]),
}


#: Of others, a hundredth away from the file's own numbers: where these are symmetric, wheels reach a limit in pairs,
#: and a slope is one to either side.
AWAY = {
    "satellites/flexible_slew": ("pd", ["initial.axis", "initial.angle_deg"]),
    "huang2019/fault_free": ("observers_pinv", ["initial.mrp", "initial.rate_rad_per_s"]),
    "huang2020/slew_as_printed": ("pd_pinv", ["initial.mrp", "initial.rate_rad_per_s"]),
    "huang2020/slew_chaser_model": ("pd_pinv", ["initial.mrp", "initial.rate_rad_per_s"]),
    "satellites/detumble_bdot": ("bdot", ["initial.rate_deg_per_s"]),
    "satellites/earth_pointing": ("mrp", ["initial.euler_321_deg", "initial.rate_deg_per_s"]),
    "satellites/safe_mode": ("modes", ["initial.euler_321_deg", "initial.rate_deg_per_s"]),
    "huang2019/free_axes": ("pd_pinv", ["initial.mrp", "initial.rate_rad_per_s"]),
    "huang2019/free_axes_two_observers": ("observers_pinv", ["initial.mrp", "initial.rate_rad_per_s"]),
    "huang2019/nominal": ("observers_pinv", ["initial.mrp", "initial.rate_rad_per_s"]),
    "huang2019/tough": ("finite_time_pinv", ["initial.mrp", "initial.rate_rad_per_s"]),
    "huang2019/vertices": ("observers_pinv", ["initial.mrp", "initial.rate_rad_per_s"]),
    "huang2019/wheel_faults": ("observers_pinv", ["initial.mrp", "initial.rate_rad_per_s"]),
    "huang2020/detumble_chaser_model": ("observer_pinv", ["initial.rate_rad_per_s"]),
    "satellites/earth_pointing_day": ("mrp", ["initial.euler_321_deg", "initial.rate_deg_per_s"]),
    "satellites/slew_and_track": (
        "eigenaxis",
        ["scheme.eigenaxis.law.frequency", "scheme.eigenaxis.law.damping_ratio"],
    ),
    "shi2020/docking_as_printed": ("dobc", ["initial.position_m"]),
    "sun2018/as_printed": ("literal", ["initial.attitude_error", "initial.rate_error_rad_per_s"]),
    "sun2018/fast_tumble": ("tracking", ["initial.attitude_error", "initial.rate_error_rad_per_s"]),
    "sun2018/quarter_limits": ("tracking", ["initial.attitude_error", "initial.rate_error_rad_per_s"]),
    "sun2018/without_observer": ("neither", ["initial.attitude_error", "initial.rate_error_rad_per_s"]),
    "tao2019/as_printed": ("corrected", ["initial.mrp", "initial.position_m"]),
    "tao2019/case2": ("bounded", ["initial.mrp", "initial.position_m"]),
    "tao2019/sweeps": ("auxiliary", ["initial.mrp", "initial.position_m"]),
    "tao2019/wide_funnel_10ms": ("sampled", ["initial.mrp", "initial.position_m"]),
}
#: Steps of the differences, as shares of a number. One craft flies on its reference, with errors of the size of what
#: doubles lose of an orbit's position: there a step has to stand out.
STEPS = {"satellites/slew_and_track": [1e-2, 3e-3]}


@pytest.mark.slow
@pytest.mark.parametrize("name", [*FLIGHTS, *(pytest.param(one, marks=pytest.mark.long) for one in MORE | AWAY)])
def test_tangents_and_adjoints_of_the_first_1000_samples(name):
    """Truth: differences of the same flight in long double, extrapolated, of steps in which no decision turns."""
    scheme, keys = (FLIGHTS | MORE | AWAY)[name]
    varied, engine, p, places, record, weights = flown(name, scheme, keys, away=0.01 if name in AWAY else 0.0)
    seed = varied.nominal.noise.seed
    found = engine.values(p, seed)
    assert np.array_equal(found.asked, record)  # word for word
    back = engine.adjoint(p, seed, weights, found)
    np.testing.assert_allclose(engine.tangents(p, seed, weights, np.eye(len(p))), back, rtol=1e-9, atol=1e-12)
    if not long_double_flight.FINER:
        pytest.skip("long double is no finer than double here")
    finer = long_double_flight.LongDoubleFlights(varied)
    for i, direction in enumerate(np.eye(len(p), dtype=np.longdouble)):
        slopes = [
            float(richardson(
                lambda at: (weights * finer.record(at, seed)[:, places]).sum(), p, direction, np.longdouble(step)
            )[0])
            for step in max(abs(p[i]), 1e-3) * np.array(STEPS.get(name, [1e-7, 1e-8, 1e-9]))
        ]  # fmt: skip
        assert min(abs(back[i] / slope - 1) for slope in slopes) < 1e-6, varied.parameters.keys[i]


ROBUST = ["initial.rate_rad_per_s", "scheme.funnel_robust.law.rate_gain"]
#: Flights through the on-board allocator, and how many samples of them. A tumble has so many changes of sets that after
#: more samples no step lies between them and the root of the gap.
ON_BOARD = {
    "huang2020/slew": ("funnel_robust", ROBUST, 1000),
    "huang2019/tough": ("observers_robust", ["initial.mrp", "initial.rate_rad_per_s"], 1000),
    "huang2020/detumble": ("observer_robust", ["initial.rate_rad_per_s"], 300),
    "satellites/thruster_hold": ("robust", ["initial.euler_321_deg", "initial.rate_deg_per_s"], 1000),
}


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [pytest.param(one, marks=[] if one == "huang2020/slew" else pytest.mark.long) for one in ON_BOARD]
)
def test_through_the_on_board_allocator(name, monkeypatch):
    """Truth: differences of the flight itself, of the step whose own error is estimated least.

    The derivatives are those of the optimum, and the flight's forces lie within the certified gap of it: with the gap
    of 1e-8 differences of a slew are off by up to 4e-6, so the solver is asked for a smaller one here.
    """

    def finer(allocator, compiler=None):
        return OnlineSolver(allocator.problem, compiler=compiler, tolerance=1e-13)

    monkeypatch.setattr(OnlineInFlight, "solver", finer)
    scheme, keys, samples = ON_BOARD[name]
    varied, engine, p, _, record, weights = flown(name, scheme, keys, samples)
    seed = varied.nominal.noise.seed
    found = engine.values(p, seed)
    assert np.array_equal(found.asked, record)
    back = engine.adjoint(p, seed, weights, found)
    np.testing.assert_allclose(engine.tangents(p, seed, weights, np.eye(len(p))), back, rtol=1e-8)
    for i, direction in enumerate(np.eye(len(p))):
        slopes = [
            richardson(lambda at: (weights * engine.values(at, seed).asked).sum(), p, direction, step)
            for step in max(abs(p[i]), 1e-3) * np.array([3e-2, 3e-3, 3e-4, 1e-4, 3e-5, 1e-5])
        ]
        slope, _ = min(slopes, key=lambda one: one[1])
        assert back[i] == pytest.approx(slope, rel=1e-6), varied.parameters.keys[i]


def exact_forces(problem, command, box, raw):
    """Return the forces that solve the optimality conditions on the sets of an answer, from rest, to 30 digits."""
    mp.dps = 30
    weights = [v for v, weight in enumerate(raw.weights) if weight > 1e-9]
    held = [force in (low, high) for force, low, high in zip(raw.forces, *box, strict=True)]
    free = [i for i, fixed in enumerate(held) if not fixed]
    B = [mp.matrix(problem.effectiveness + problem.errors[v] @ problem.coupling) for v in weights]
    h, q = mp.mpf(problem.accuracy_weight), problem.effort_weight + problem.change_weight
    F, w = mp.matrix(raw.forces), mp.matrix([raw.weights[v] for v in weights])
    for _ in range(4):
        r = [b * F - mp.matrix(command) for b in B]
        G = [h * b.T * each for b, each in zip(B, r, strict=True)]
        n, k = len(free), len(weights)
        K, residual = mp.zeros(n + k + 1), mp.zeros(n + k + 1, 1)
        for a, i in enumerate(free):
            residual[a] = q[i] * F[i] - problem.effort_weight[i] * problem.preferred[i]
            residual[a] += sum(w[c] * G[c][i] for c in range(k))
            for b, j in enumerate(free):
                K[a, b] = sum(w[c] * h * sum(B[c][e, i] * B[c][e, j] for e in range(3)) for c in range(k))
                K[a, b] += q[i] if i == j else 0
            for c in range(k):
                K[a, n + c] = K[n + c, a] = G[c][i]
        cost = [h * (each.T * each)[0] / 2 for each in r]
        for c in range(k):
            residual[n + c] = cost[c] - cost[0]
            K[n + c, n + k], K[n + k, n + c] = -1, 1
        residual[n + k] = sum(w) - 1
        step = mp.lu_solve(K, -residual)
        for a, i in enumerate(free):
            F[i] += step[a]
        for c in range(k):
            w[c] += step[n + c]
    return F, tuple(held), tuple(weights)


def ties(problem, command, forces, held, vertices):
    """Return how far the conditions that the worst vertices tie are from one that follows from the others, 0 to 1."""
    free = [i for i, fixed in enumerate(held) if not fixed]
    each = [problem.effectiveness + problem.errors[v] @ problem.coupling for v in vertices]
    gradients = [(B.T @ (B @ forces - command))[free] for B in each]
    apart = np.array([one - gradients[0] for one in gradients[1:]])
    if not len(apart):
        return 1.0
    return np.linalg.svd(apart / np.linalg.norm(apart, axis=1, keepdims=True), compute_uv=False)[-1]


@pytest.mark.slow
def test_the_allocator_is_differentiated_as_its_optimality_conditions_are():
    """Truth: differences of the solution of the conditions in 30 digits, at many sets of bounds and worst vertices."""
    varied, engine, _, _, record, _ = flown("huang2020/slew", "funnel_robust", ROBUST, samples=1)
    scheme, count = varied.scheme, record.shape[1]
    problem = scheme.actuation.allocator.problem
    reach = scheme.actuation.rate * varied.mission.timing.sample_period
    box = [np.clip(np.full(problem.count, side), scheme.actuation.lower, scheme.actuation.upper)
           for side in (-reach, reach)]  # fmt: skip
    rng, sets, none = np.random.default_rng(5), set(), np.zeros(problem.count)
    compared = 0
    for _ in range(40):
        p = varied.parameters.nominal.copy()
        p[:3] = rng.standard_normal(3) * 10 ** rng.uniform(-4, -1)
        direction = np.append(rng.standard_normal(3), 0.0)
        limited = engine.values(p, 1).asked[0, -problem.count - 3 : -problem.count]
        slopes = np.zeros(count)
        for i in range(count - problem.count - 3, count):
            weights = np.zeros(record.shape)
            weights[0, i] = 1.0
            (slopes[i],) = engine.tangents(p, 1, weights, direction[None, :])
        efforts, slopes = np.split(slopes, [count - problem.count])
        raw = OnlineSolver(problem).solve(limited, none, *box)
        step = mp.mpf(10) ** -9
        try:
            (ahead, *known), (behind, *_) = (
                exact_forces(problem, mp.matrix(limited) + sign * step * mp.matrix(efforts[-3:]), box, raw)
                for sign in (1, -1)
            )
        except ZeroDivisionError:  # more worst vertices than the weights can be told of
            continue
        if ties(problem, np.array(limited), np.array([float(force) for force in ahead]), *known) < 1e-6:
            continue  # one tie follows from the others, and which of their weights changes is anybody's choice
        sets.add(tuple(known))
        compared += 1
        truth = np.array([float((a - b) / (2 * step)) for a, b in zip(ahead, behind, strict=True)])
        np.testing.assert_allclose(slopes, truth, rtol=1e-6, atol=1e-7 * np.abs(truth).max())
    assert len(sets) >= 5
    assert compared >= 30


KEYS = ["initial.rate_rad_per_s", "scheme.observer_pinv.law.rate_gain"]


@pytest.mark.slow
def test_a_whole_flight():
    """Metrics have the values that the flight tells, and slopes that its differences have."""
    mission = casadi_gnc.load("huang2020/detumble")
    flight = casadi_gnc.vary(mission, KEYS, "observer_pinv").fly()
    for of in ("settling_time", "steady_rate", "torque_sample_sum"):
        slopes = casadi_gnc.sensitivities(mission, KEYS, of, "observer_pinv")
        found = slopes.at(temperature=1e-5)
        assert found.exact == pytest.approx(flight.metrics[of], rel=1e-12)
        assert abs(found.value - found.exact) <= found.slack + 1e-12 * abs(found.exact)
        back = slopes.at(temperature=1e-5, method="adjoint").gradient
        np.testing.assert_allclose(found.gradient, back, rtol=1e-10)
        nominal = slopes.varied.parameters.nominal
        for i, direction in enumerate(np.eye(len(nominal))):
            slope, _ = richardson(
                lambda p, s=slopes: s.at_row(p, temperature=1e-5).value, nominal, direction, 1e-6 * abs(nominal[i])
            )
            assert found.gradient[i] == pytest.approx(slope, rel=1e-5)
    assert found[KEYS[1]] == found.gradient[-1]
    assert found[KEYS[0]].shape == (3,)


def test_bad_input():
    mission = casadi_gnc.load("huang2020/detumble")
    for of, told in (("settling", "no metric and no requirement 'settling'"), ("A-1", "settling_time, steady_rate")):
        with pytest.raises(FlightError, match=told):
            casadi_gnc.sensitivities(mission, KEYS, of, "observer_pinv")
    with pytest.raises(FlightError, match="leads nowhere"):
        casadi_gnc.sensitivities(mission, "truth.mass", "settling_time", "observer_pinv")
    asked = Requirement("A", formula="always(duality_gap <= 1)")
    with pytest.raises(FlightError, match="report of itself, which has no derivative"):
        casadi_gnc.sensitivities(mission, "truth.inertia_factor", asked, "observer_robust")
