"""Stability margins. Truth: published examples, formulas, python-control, and poles of changed missions."""

import json
import math

import control
import numpy as np
import pytest
from typer.testing import CliRunner

import casadi_gnc as gnc
from casadi_gnc.checking.broken_loops import cuts, scheme_margins
from casadi_gnc.checking.linear import loop_at, spectral_radius
from casadi_gnc.checking.margins import BrokenLoop, common_gain, disk_of_all, margins
from casadi_gnc.cli.main import app
from casadi_gnc.errors import FlightError


def broken(system, period=0.0):
    """Cut u = -y: w = -y."""
    state = control.ss(system)
    return BrokenLoop(state.A, state.B, -state.C, -state.D, period)


def test_the_published_example():
    """Seiler, Packard, Gahinet (2020), the loop 25/(s^3 + 10 s^2 + 10 s + 10) of their figures 3 and 5."""
    found = margins(broken(control.tf([25], [1, 10, 10, 10])))
    assert found.gain_low == 0.0
    assert found.gain_high == pytest.approx(3.6, abs=1e-9)
    assert math.degrees(found.phase) == pytest.approx(29.1, abs=0.05)
    assert found.phase_at == pytest.approx(1.78, abs=0.005)
    assert found.disk == pytest.approx(0.46, abs=0.005)
    assert found.disk_at == pytest.approx(1.94, abs=0.02)
    assert 1 / found.disk_gain == pytest.approx(0.63, abs=0.005)
    assert found.disk_gain == pytest.approx(1.59, abs=0.005)
    assert math.degrees(found.disk_phase) == pytest.approx(25.8, abs=0.05)


@pytest.mark.parametrize("seed", range(12))
def test_random_loops_against_python_control(seed):
    """Gain, phase and modulus where it has one of each; the disk on its own grid."""
    rng = np.random.default_rng(seed)
    system = control.tf([10 ** rng.uniform(-1, 1)], np.poly(-rng.uniform(0.1, 3, 4)))
    if not broken(system).is_stable():
        system = system / 50
    found = margins(broken(system))
    gain, phase, modulus, *_ = control.stability_margins(system)
    assert found.gain_high == pytest.approx(gain, rel=1e-7)
    assert found.modulus == pytest.approx(modulus, rel=1e-6)
    assert math.degrees(found.phase) == pytest.approx(phase if math.isfinite(phase) else 180.0, rel=1e-6)
    alpha, *_ = control.disk_margins(system, np.geomspace(1e-3, 1e2, 20000))
    assert found.disk == pytest.approx(alpha, rel=1e-5)


def test_a_double_integrator_by_formulas():
    """L = (kd s + kp)/(J s^2) crosses 1 at a frequency that a quadratic gives; sampled, kd h/J = 2 is the end."""
    kp, kd, J, h = 4.0, 3.0, 2.0, 0.1
    found = margins(broken(control.tf([kd, kp], [J, 0, 0])))
    crossing = math.sqrt((kd**2 + math.sqrt(kd**4 + 4 * J**2 * kp**2)) / (2 * J**2))
    assert found.phase == pytest.approx(math.atan(kd * crossing / kp), rel=1e-10)
    assert found.delay == pytest.approx(math.atan(kd * crossing / kp) / crossing, rel=1e-10)
    assert (found.gain_low, found.gain_high) == (0.0, math.inf)
    A, B = np.array([[1, h], [0, 1]]), np.array([[h * h / 2 / J], [h / J]])
    sampled = margins(BrokenLoop(A, B, -np.array([[kp, kd]]), np.zeros((1, 1)), h))
    assert sampled.gain_high == pytest.approx(2 * J / (kd * h), rel=1e-9)  # Jury: 4 - 2 g kd h/J = 0


def test_a_delay_of_whole_samples_is_exact():
    """With so many samples of delay that the margin is not passed the loop is stable, with one more it is not."""
    h, gain = 0.01, 1.0
    found = margins(BrokenLoop(np.array([[1.0]]), np.array([[h]]), -np.array([[gain]]), np.zeros((1, 1)), h))
    whole = int(found.delay / h)

    def radius(samples):
        late = np.eye(samples + 1, k=-1)
        late[0, 0], late[0, samples] = 1.0, -h * gain if samples else 1.0 - h * gain
        return np.abs(np.linalg.eigvals(late)).max()

    assert radius(whole) < 1 < radius(whole + 1)


def test_a_conditionally_stable_loop_has_an_end_below():
    loop = broken(control.tf([4, 4, 4], [1, 0, 0, 0]))
    assert margins(loop).gain_low == pytest.approx(0.25, rel=1e-9)
    assert common_gain(loop) == (pytest.approx(0.25, rel=1e-6), math.inf)


def test_all_channels_at_once_never_bear_more_than_one():
    rng = np.random.default_rng(3)
    A = rng.normal(size=(5, 5))
    A -= (np.linalg.eigvals(A).real.max() + 0.5) * np.eye(5)
    loop = BrokenLoop(A, 0.3 * rng.normal(size=(5, 2)), rng.normal(size=(2, 5)), np.zeros((2, 2)))
    assert loop.is_stable()
    alpha, _ = disk_of_all(loop)
    assert alpha <= min(margins(loop.channel(i)).disk for i in range(2)) + 1e-9
    for _ in range(200):  # every diagonal factor of the disk is borne
        turn = alpha / 2 * 0.999 * np.exp(2j * np.pi * rng.uniform(size=2))
        factors = np.diag((1 + turn) / (1 - turn))
        assert np.linalg.eigvals(loop.A + loop.B @ factors @ loop.C).real.max() < 0


def test_a_loop_that_is_not_stable_has_none():
    with pytest.raises(ValueError, match="not stable"):
        margins(broken(control.tf([1], [1, -2])))


@pytest.mark.parametrize(
    "name",
    ["huang2020/detumble", "huang2019/nominal", "shi2020/docking",
     *(pytest.param(name, marks=pytest.mark.slow) for name in ("sun2018/circular_orbit", "tao2019/wide_funnel_10ms"))],
)  # fmt: skip
def test_a_cut_loop_closed_again_is_the_loop(name):
    """The poles are those of the linear loop that the checks look at, wherever it is cut."""
    mission = gnc.load(name)
    for scheme in mission.schemes[:2]:
        whole = np.sort_complex(np.linalg.eigvals(loop_at(mission, scheme, 0.0).moving))
        for loop in cuts(mission, scheme, 0.0):
            assert np.abs(np.sort_complex(np.linalg.eigvals(loop.closed())) - whole).max() < 1e-6


def test_the_gain_margin_is_where_the_mission_becomes_unstable():
    """An inertia that is smaller by the margin brings the poles of the whole linear loop to the unit circle."""
    mission = gnc.load("huang2020/detumble")
    scheme = mission.scheme("damping_pinv")
    high = scheme_margins(mission, scheme).effort_high
    for share, stable in ((0.999, True), (1.001, False)):
        lighter = gnc.load("huang2020/detumble", {"truth.inertia_factor": 1.1 / (high * share)})
        assert (spectral_radius(loop_at(lighter, lighter.scheme("damping_pinv"), 0.0).moving) < 1) is stable


def test_rate_damping_by_hand():
    """w' = v/J, v = -k w, held for h: the phase of k h/J/(exp(j omega h) - 1) is -90 degrees - omega h / 2."""
    mission = gnc.load("huang2020/detumble")
    h, k, found = 0.1, 0.4, scheme_margins(mission, mission.scheme("damping_pinv"))
    # The orbit engine and gravity do not act at this order.
    for i, moment in enumerate(np.diag(np.array(mission.truth.inertias()["true"]))):
        one = found.channels[f"torque {i + 1}"]
        crossing = 2 / h * math.asin(k * h / moment / 2)
        assert one.phase_at == pytest.approx(crossing, rel=1e-5)
        assert one.phase == pytest.approx(math.pi / 2 - crossing * h / 2, abs=1e-5)
        assert one.delay == pytest.approx(one.phase / one.phase_at, rel=1e-9)


def test_what_has_no_margins_is_told():
    mission = gnc.load("huang2020/slew_as_printed")
    with pytest.raises(FlightError, match="'funnel_pinv' is not stable at its target"):
        scheme_margins(mission, mission.scheme("funnel_pinv"))


def test_command(tmp_path):
    told = CliRunner().invoke(app, ["margins", "huang2020/slew", "--scheme", "pd_pinv", "--json"])
    (one,) = json.loads(told.stdout)["schemes"]
    assert one["scheme"] == "pd_pinv"
    assert set(one["channels"]) == {f"{name} {i}" for name in ("torque", "mrp", "rate") for i in (1, 2, 3)}
    assert one["channels"]["torque 1"]["gain_high"] == pytest.approx(one["effort_high"], rel=1e-3)
    assert one["mass_centre"]["low_m"][0] == pytest.approx(-0.33138, rel=1e-3)  # the axis at which det T(d) is zero
    assert one["mass_centre"]["why_none"] == ""
    drawn = tmp_path / "margins.svg"
    told = CliRunner().invoke(
        app, ["margins", "huang2020/slew", "--scheme", "pd_pinv", "--figures", str(tmp_path), "--format", "svg"]
    )
    assert told.exit_code == 0
    assert "…" not in told.stdout
    assert drawn.read_text().startswith("<?xml")
