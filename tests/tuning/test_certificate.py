"""What is proved of a linear loop, beside what is known by hand, on both sides of the bound.

A block of 1 kg, braked by -k v every h = 0.1 s while a wind w pushes: v' = (1 - k h) v + h w exactly, stable for k
below 20. With v = 1 at first, after n samples it is (1 - k h)^n (1 - w/k) + w/k.
"""

from __future__ import annotations

import json
from pathlib import Path

import braked_block
import casadi as ca
import numpy as np
import pytest
from typer.testing import CliRunner

import casadi_gnc as gnc
from casadi_gnc.cli.main import app
from casadi_gnc.mathematics.intervals import Interval, enclose
from casadi_gnc.synthesis.contraction import UncertainMap, borne, contraction
from casadi_gnc.tuning.certificate import box_of, certificate
from casadi_gnc.tuning.objective import Objective
from casadi_gnc.tuning.reach import Reach

FILE = """[[requirement]]
id = "SLOW"
formula = "always[2, 5](abs(speed[1]) <= {most})"

[[dispersion]]
key = "scheme.brake.law.brake_gain"
uniform = [{low}, {high}]

[[dispersion]]
key = "spacecraft.wind_N"
uniform = [-0.5, 0.5]
"""


def written(folder: Path, most: float, low: float, high: float) -> Path:
    return braked_block.written(folder, 5.0, FILE.format(most=most, low=low, high=high))


def proved(folder: Path, most: float, low: float, high: float):
    mission = gnc.load(written(folder, most, low, high))
    one = Objective(mission, what="SLOW")
    return certificate(one.cases.varied, one.space, Reach(one.space), mission.requirements[0])


def test_a_peak_is_proved_on_one_side_of_the_bound_only(tmp_path):
    """The largest of 2 s on is that of the least gain, 3, and the most wind: 0.7^20 (1 - 1/6) + 1/6 = 0.16733."""
    largest = 0.7**20 * (1 - 0.5 / 3) + 0.5 / 3
    found = proved(tmp_path, 0.3, 3.0, 7.0)
    assert found.exact
    assert found.holds
    assert 0.8 * (0.3 - largest) < found.least <= 0.3 - largest  # what is of second order is told too large
    assert "proved of the loop, which is linear but for limits" in found.sentence
    tight = proved(tmp_path, 0.99 * largest, 3.0, 7.0)
    assert not tight.holds
    assert "stable. Of SLOW that proves nothing" in tight.sentence


@pytest.mark.parametrize(("high", "stable"), [(19.9, True), (20.1, False)])
def test_stability_is_proved_up_to_the_gain_at_which_it_ends(tmp_path, high, stable):
    found = proved(tmp_path, 10.0, 20.0 - high, high)
    assert found.as_data()["stable"] == stable
    if stable:  # from 10 +- 9.9 the box may grow to 10 +- 10
        assert 1.0 <= found.borne <= 10.0 / 9.9
        assert found.rate >= 0.99
    else:
        assert found.why == "the linear loop is not stable at scheme.brake.law.brake_gain = -0.1"


@pytest.mark.slow
def test_falsify_says_what_is_proved_and_finds_what_breaks(tmp_path):
    largest = 0.7**20 * (1 - 0.5 / 3) + 0.5 / 3
    for most, code in ((0.3, 0), (0.99 * largest, 1)):
        out = tmp_path / f"{code}.toml"
        command = ["falsify", str(written(tmp_path, most, 3.0, 7.0)), "--requirement", "SLOW", "--flights", "64"]
        done = CliRunner().invoke(app, [*command, "--out", str(out), "--json"])
        assert done.exit_code == code
        told = json.loads(done.stdout[done.stdout.index("{") :])
        if code:
            assert told["certificate"] is None
            assert told["broken"]["robustness"] < 0
        else:
            assert told["certificate"]["requirement_holds"]
            assert told["certificate"]["model_is_the_loop_of_the_flight"]
            assert told["certificate"]["least_robustness"] <= told["least"]["robustness"] + 1e-12


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ('mode = "sampled"', "flies in continuous time"),
        ("uniform = [-0.5, 0.5]", "no certificate: the loop has no slope"),
        ("formula", "bounds a metric, and what is proved is of formulas"),
    ],
)
def test_what_is_not_proved_is_said(tmp_path, changed, told):
    file = written(tmp_path, 1.0, 3.0, 7.0)
    text = file.read_text()
    assert changed in text
    if changed == "formula":
        text = text.replace('formula = "always[2, 5](abs(speed[1]) <= 1.0)"', 'metric = "late"\nat_most = 1.0')
        text += '\n[[metric]]\nname = "late"\nkind = "settling"\nsignal = "speed"\nthreshold = 0.5\n'
    elif changed.startswith("mode"):
        text = text.replace(changed, 'mode = "continuous"')
    else:
        text = text.replace("model =", "kink_N = 1.0\nmodel =")
    file.write_text(text)
    mission = gnc.load(file)
    one = Objective(mission, what="SLOW")
    found = certificate(one.cases.varied, one.space, Reach(one.space), mission.requirements[0])
    assert not found.holds
    assert told in found.sentence


def test_perturbations_of_one_and_of_several_axes():
    """A stable 0.9 (cos, sin) turned by a real factor d of itself is stable while (1 + d) 0.9 < 1: d < 1/9."""
    turn = 0.9 * np.array([[0.8, 0.6], [-0.6, 0.8]])
    one = UncertainMap(turn, (0.05 * turn,), (np.eye(2),))
    assert borne(one) == pytest.approx((1 / 9) / 0.05, rel=0.03)
    assert borne(one) <= (1 / 9) / 0.05
    found = contraction(one, 0.96)
    assert found is not None
    assert np.linalg.eigvalsh(found.P).min() >= 1 - 1e-6
    for d in (-1.0, 1.0):
        step = (1 + 0.05 * d) * turn
        assert np.linalg.eigvalsh(step.T @ found.P @ step - 0.96**2 * found.P).max() <= 1e-9
    assert contraction(one, 0.94) is None  # (1 + 0.05) 0.9 = 0.945
    # A row that is any of a norm up to 0.3 takes a diagonal 0.5, 0.5 out at 0.5 of the first axis.
    row = UncertainMap(np.diag([0.5, 0.5]), (np.eye(2)[:, [0]],), (0.3 * np.eye(2),))
    assert borne(row) <= 0.5 / 0.3
    assert borne(row) == pytest.approx(0.5 / 0.3, rel=0.03)


def test_intervals_hold_what_is_drawn_from_them():
    x = ca.SX.sym("x", 2)
    told = [
        ca.sin(x[0]) * x[1] - x[0] ** 2,
        ca.if_else(x[0] < 0.5, x[1] / x[0], ca.sqrt(x[1])),
        ca.norm_2(x),
        ca.cos(x[0]) * ca.exp(x[1]) / ca.acos(x[0] / 10),
        ca.fmax(ca.fabs(x[0]), ca.tanh(x[1])) + ca.floor(x[0]),
    ]
    function, draw = ca.Function("f", [x], [ca.vertcat(*told)]), np.random.default_rng(1)
    middle, half = 2 * draw.normal(size=(2, 100)), np.abs(draw.normal(size=(2, 100))) * draw.choice([0.01, 1.0], 100)
    (found,) = enclose(function, [Interval(middle - half, middle + half)])
    for _ in range(50):
        values = np.array(function(middle + half * draw.uniform(-1, 1, (2, 100))))
        assert ((found.low <= values) & (values <= found.high) | np.isnan(values)).all()
    assert np.isfinite(found.low[[0, 2, 4]]).all()
    (exact,) = enclose(function, [Interval.of(middle)])
    assert exact.low[2] == pytest.approx(np.hypot(*middle), rel=1e-14)
    (jumps,) = enclose(function, [Interval(middle - half, middle + half)], smooth=True)
    crossed = (middle - half < 0.5)[0] & (middle + half >= 0.5)[0]
    assert np.isinf(jumps.low[1][crossed]).all()


def test_a_box_holds_the_set():
    from casadi_gnc.campaigns.correlated import Correlated
    from casadi_gnc.campaigns.distributions import Choice, LogUniform, Normal
    from casadi_gnc.tuning.space import Space

    laws = [Normal(1.0, 0.5, truncate=3.0), LogUniform(0.1, 10.0), Choice(((2.0,), (3.0,)))]
    laws.append(Correlated((0.0, 1.0), ((4.0, 1.0), (1.0, 1.0))))
    space = Space(list("abcde"), list("abcd"), laws, np.array([1.0, 20.0, 2.0, 0.0, 1.0]))
    reach = Reach(space, "box", 4.0)
    low, high = box_of(space, reach)
    assert [low[0], high[0]] == [-0.5, 2.5]
    assert [low[1], high[1]] == pytest.approx([0.1, 20.0])  # the file's own number too
    assert [low[2], high[2]] == [2.0, 3.0]
    rows = space.rows(reach.filled(np.random.default_rng(0).random((500, space.size))))
    assert ((low - 1e-9 <= rows) & (rows <= high + 1e-9)).all()
