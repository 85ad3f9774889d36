"""Margins of linearised loops, each tried: with that gain, that phase or that delay the loop is on the edge."""

import math

import numpy as np
import pytest

import casadi_gnc
from casadi_gnc.checking.linear import loop_at, opened
from casadi_gnc.checking.margins import as_data, margins

LOOPS = [
    ("huang2020/detumble", "damping_pinv"),
    ("huang2020/detumble", "observer_pinv"),
    ("huang2020/slew", "funnel_pinv"),
    ("huang2019/nominal", "observers_pinv"),
    ("sun2018/circular_orbit", "tracking"),
    ("tao2019/case1", "plain"),
]


def off_the_edge(loop, factors):
    """Return how far the pole that is nearest to the stability boundary is from it, with a factor on each axis."""
    a, b, c = opened(loop)
    poles = np.linalg.eigvals(a + b @ np.diag(factors) @ c)
    return np.abs(np.abs(poles) - 1 if loop.sampled else poles.real).min()


@pytest.mark.parametrize(("name", "scheme"), LOOPS)
def test_margins_are_where_the_loop_is_on_the_edge(name, scheme):
    mission = casadi_gnc.load(name)
    loop = loop_at(mission, mission.scheme(scheme), mission.timing.duration)
    a, b, c = opened(loop)
    np.testing.assert_allclose(a + b @ c, loop.matrix, atol=1e-12)
    for i, one in enumerate(margins(loop)):

        def factors(value, i=i):
            each = np.ones(b.shape[1], dtype=complex)
            each[i] = value
            return each

        scale = one.crossing * (mission.timing.sample_period if loop.sampled else 1.0)
        if one.gain_low > 1e-3 or math.isfinite(one.gain_high):
            gain = one.gain_high if math.isfinite(one.gain_high) else one.gain_low
            assert off_the_edge(loop, factors(gain)) < 2e-4 * max(scale, 1e-2)
        # The frequency of a crossing is read between two of 4000 points over seven decades.
        assert off_the_edge(loop, factors(np.exp(-1j * one.phase))) < 1e-4 * scale
        assert one.delay >= one.phase / one.crossing * (1 - 1e-6) or one.delay > 0
        assert 0 < one.distance <= 1.01
        assert one.distance <= 2 * math.sin(min(one.phase, math.pi) / 2) * (1 + 1e-3)


def test_rate_damping_by_hand():
    """w' = v/J, v = -k w, held for h: z - 1 + (h/J) L's gain. |L| = 1 where 2 sin(omega h / 2) = k h / J."""
    mission = casadi_gnc.load("huang2020/detumble")
    h, k = 0.1, 0.4
    # The believed inertia is a tenth less than the true one; the orbit engine and gravity do not act at this order.
    inertia = np.diag(np.array(mission.truth.inertias()["true"]))
    loop = loop_at(mission, mission.scheme("damping_pinv"), mission.timing.duration)
    for one, moment in zip(margins(loop), inertia, strict=True):
        crossing = 2 / h * math.asin(k * h / moment / 2)
        assert one.crossing == pytest.approx(crossing, rel=1e-4)
        # The phase of 1/(exp(j omega h) - 1) is -90 degrees - omega h / 2.
        assert one.phase == pytest.approx(math.pi / 2 - crossing * h / 2, abs=1e-4)
        assert one.delay == pytest.approx(one.phase / one.crossing, rel=1e-9)


def test_as_control_reads_them():
    """python-control, on the same cut loop."""
    control = pytest.importorskip("control")
    mission = casadi_gnc.load("huang2019/nominal")
    loop = loop_at(mission, mission.scheme("observers_pinv"), mission.timing.duration)
    a, b, c = opened(loop)
    for i, one in enumerate(margins(loop)):
        others = [k for k in range(3) if k != i]
        cut = control.ss(a + b[:, others] @ c[others], b[:, [i]], -c[[i]], 0)
        gain, phase, distance, _, crossing, _ = control.stability_margins((
            np.abs(one.response), np.degrees(np.unwrap(np.angle(one.response))), one.frequency
        ))  # fmt: skip
        response = cut(1j * one.frequency)
        np.testing.assert_allclose(one.response, response, rtol=1e-6)
        assert min(one.gain_high, 1 / max(one.gain_low, 1e-9)) == pytest.approx(gain, rel=1e-3)
        assert math.degrees(one.phase) == pytest.approx(abs(phase), rel=1e-3)
        assert one.distance == pytest.approx(distance, rel=1e-3)
        assert one.crossing == pytest.approx(crossing, rel=1e-3)


def test_a_loop_without_a_slope_has_none():
    mission = casadi_gnc.load("huang2019/nominal")
    assert margins(loop_at(mission, mission.scheme("finite_time_pinv"), mission.timing.duration)) == []


def test_none_is_none_in_data():
    mission = casadi_gnc.load("huang2020/detumble")
    (first, *_) = as_data(margins(loop_at(mission, mission.scheme("damping_pinv"), mission.timing.duration)))
    assert first["gain_low"] is None
    assert first["phase_rad"] > 1.5
