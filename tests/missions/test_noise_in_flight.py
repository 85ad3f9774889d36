"""Noise, efforts of two kinds, several funnels and true outputs: what a craft may have, in both engines.

The craft is a point that is pushed and turned; its law pulls both back. Truth: the formula of what
is recorded, and the two engines on each other.
"""

from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
import pytest

import casadi_gnc
from casadi_gnc.allocation import Direct
from casadi_gnc.laws import Law, PerformanceFunnel
from casadi_gnc.missions.actuation import Actuation
from casadi_gnc.missions.craft import Craft
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.plant import Plant
from casadi_gnc.missions.scheme import Funnel, Metric, Scheme
from casadi_gnc.missions.timing import Noise, Timing
from casadi_gnc.signals import Layout, Signal
from casadi_gnc.status import StepStatus

STATE = Layout((Signal("place", 3, "m", limit=10.0), Signal("angle", 1, "rad", limit=10.0)))
EFFORT = Layout((Signal("force", 3, "N"), Signal("torque", 1, "N m")))


@dataclass(frozen=True, eq=False)
class Wanderer(Plant):
    """A point that moves as it is pushed."""

    state = measurement = STATE
    inputs = EFFORT
    noise = Layout((Signal("sensor", 3), Signal("push", 2)))
    outputs = Layout((Signal("distance", 1, "m"),))

    def measure(self, t, x, noise):
        return x + ca.vertcat(1e-2 * noise[:3], 0)

    def rate(self, t, x, actuators, noise):
        return actuators + ca.vertcat(0, 0, 0.1 * noise[3:])

    def show(self, t, x, actuators):
        return {"distance": ca.norm_2(x[:3])}

    def status(self, t, x, actuators):
        return {StepStatus.KEEP_OUT_ENTERED: ca.norm_2(x[:3]) < 0.2}


class WandererCraft(Craft):
    """The point, where it begins, and a note."""

    def plant(self):
        return Wanderer()

    def start(self):
        return {"place": [1.0, -2.0, 0.5], "angle": [-1.5]}

    def notes(self):
        return ("a note",)


@dataclass(frozen=True, eq=False)
class Pull(Law):
    """Pull to zero."""

    inputs = STATE
    memory = Layout((Signal("mean", 4),))

    def command(self, t, y, m):
        return -y - 0.1 * m

    def rate(self, t, y, m, wanted, achieved):
        return y + 0 * achieved


def mission(**changes) -> Mission:
    actuation = Actuation(
        effectiveness=lambda seen: ca.diag(ca.vertcat(1, 1, 1, 1 - 0.1 * seen.angle)),
        lower=[-1.0] * 4,
        upper=[1.0] * 4,
        rate=float("inf"),
        limit_below=[-0.5] * 4,
        limit_above=[0.5] * 4,
        allocator=Direct(),
        effort=EFFORT,
        reach=lambda seen, period: (ca.DM([-1.0] * 4), ca.vertcat(1, 1, 1, 0.3)),
        judge=lambda seen, limited, actuators: {StepStatus.WHEEL_SATURATED: actuators[3] >= 0.3},
    )
    wide = PerformanceFunnel(*(ca.DM([value] * 3) for value in (3.0, 0.5, 0.1, 1.0, 1.0)))
    narrow = PerformanceFunnel(*(ca.DM([value]) for value in (3.0, 0.5, 0.1, 1.0, 1.0)))
    made = Mission(
        name="wander",
        craft=WandererCraft(),
        timing=Timing("sampled", 0.1, 20.0, 2),
        schemes=(Scheme("pull", Pull(hold=0.1), actuation),),
        metrics=(Metric("nearest", "least", "distance", unit="m"),),
        funnels=(Funnel("place", wide), Funnel("angle", narrow)),
        noise=Noise(seed=3, every=2, truncation=3.0),
    )
    return replace(made, **changes)


@pytest.mark.parametrize("mode", ["sampled", "continuous"])
def test_engines_agree_word_for_word_with_noise(mode):
    machine = casadi_gnc.fly(mission(), engine="vm", mode=mode)
    compiled = casadi_gnc.fly(mission(), maths="libm", mode=mode)
    assert compiled.made["engine"] == "c"
    assert compiled.made["seed"] == 3
    assert (machine.samples.view(np.uint64) == compiled.samples.view(np.uint64)).all()
    assert machine.metrics == compiled.metrics
    assert machine.statuses == compiled.statuses
    assert machine.notes == compiled.notes == ("a note",)


def test_a_seed_is_a_flight_and_another_seed_another():
    first, again = casadi_gnc.fly(mission()), casadi_gnc.fly(mission())
    other = casadi_gnc.fly(mission(noise=Noise(seed=4, every=2)))
    assert (first.samples == again.samples).all()
    assert np.abs(first["place"] - other["place"]).max() > 1e-3


def test_noise_is_held_between_draws():
    """Pushed with held noise and a dead law, the angle moves by equal steps within a draw."""
    held = mission(noise=Noise(seed=3, every=5))
    dead = replace(held.schemes[0].actuation, limit_below=[-1e-12] * 4, limit_above=[1e-12] * 4)
    flight = casadi_gnc.fly(held.with_scheme(actuation=dead))
    steps = np.diff(flight["angle"]).reshape(-1, 5)
    assert np.abs(steps - steps[:, :1]).max() < 1e-12  # the dead law's own push
    assert np.abs(np.diff(steps[:, 0])).min() > 1e-6


def test_efforts_funnels_outputs_and_statuses_are_recorded_by_name():
    flight = casadi_gnc.fly(mission())
    assert flight.unit("wanted_force") == "N"
    assert flight.unit("achieved_torque") == "N m"
    assert np.allclose(flight["distance"], np.linalg.norm(flight["place"], axis=1), rtol=1e-15)
    assert flight.metrics["nearest"] == pytest.approx(flight["distance"].min(), rel=1e-15)
    told = flight["torque"] * (1 - 0.1 * flight["angle"])  # angle is measured without noise
    assert np.allclose(flight["achieved_torque"], told, rtol=1e-14)
    assert flight["torque"].max() == 0.3
    wall = 2.5 * np.exp(-0.1 * flight.time) + 0.5
    assert np.allclose(flight["funnel_upper_angle"], wall, rtol=1e-14)
    assert np.allclose(flight["funnel_use_angle"], np.abs(flight["angle"]) / wall, rtol=1e-13)
    inside = int((flight["distance"] < 0.2).sum())
    assert flight.statuses[StepStatus.KEEP_OUT_ENTERED][0] == inside > 0
    assert flight.statuses[StepStatus.WHEEL_SATURATED][0] == int((flight["torque"] >= 0.3).sum()) > 0


def test_every_kind_of_metric_is_what_numpy_makes_of_the_record():
    asked = [
        ("reach", "reaching", 0.5, 0.0, float("inf"), "two"),
        ("settle", "settling", 0.5, 0.0, float("inf"), "two"),
        ("settle_window", "settling", 0.5, 0.95, 15.0, "two"),
        ("settle_at_once", "settling", 0.5, 15.0, float("inf"), "two"),
        ("settle_too_early", "settling", 0.5, 0.0, 1.0, "two"),
        ("settle_nowhere", "settling", 0.5, 50.0, float("inf"), "two"),
        ("reach_window", "reaching", 0.5, 0.95, 15.0, "two"),
        ("most", "peak", 0.0, 1.0, 3.0, "two"),
        ("least", "least", 0.0, 1.0, 3.0, "max"),
        ("last", "final", 0.0, 1.0, 3.05, "two"),
        ("mean", "mean", 0.0, 10.0, float("inf"), "max"),
        ("sum", "sample_sum", 0.0, 10.0, 12.0, "two"),
        ("empty", "least", 0.0, 50.0, float("inf"), "max"),
        ("unreached", "reaching", 1e-9, 0.0, float("inf"), "max"),
    ]
    metrics = tuple(Metric(n, kind, "place", level, a, "m", u, norm) for n, kind, level, a, u, norm in asked)
    flight = casadi_gnc.fly(mission(metrics=metrics))
    t, two, most = flight.time, np.linalg.norm(flight["place"], axis=1), np.abs(flight["place"]).max(axis=1)
    early, late = (t >= 1.0) & (t <= 3.0), t >= 10.0
    expected = {
        "reach": t[two < 0.5][0],
        "settle": t[two >= 0.5][-1] + 0.1,
        "settle_window": t[(two >= 0.5) & (t <= 15.0)][-1] + 0.1 - 0.95,
        "settle_at_once": 0.0,
        "settle_too_early": None,
        "settle_nowhere": None,
        "reach_window": t[two < 0.5][0] - 0.95,
        "most": two[early].max(),
        "least": most[early].min(),
        "last": two[t <= 3.05][-1],
        "mean": most[late].mean(),
        "sum": two[late & (t <= 12.0)].sum(),
        "empty": None,
        "unreached": None,
    }
    for name, value in expected.items():
        assert flight.metrics[name] == (None if value is None else pytest.approx(value, rel=1e-12)), name
