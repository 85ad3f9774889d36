"""What can be asked of a tuning: costs, gains, bounds, digits; and what is wrong with it, in one sentence."""

import dataclasses
import math
from typing import Any

import casadi as ca
import numpy as np
import pytest

import casadi_gnc as gnc
from casadi_gnc.checks import Verdict
from casadi_gnc.errors import GncError
from casadi_gnc.laws.attitude_pd import AttitudePD
from casadi_gnc.laws.mrp_feedback import MrpFeedback
from casadi_gnc.tuning.conditions import conditions_of, new_troubles
from casadi_gnc.tuning.costs import cost_of, from_record
from casadi_gnc.tuning.gains import gains_free
from casadi_gnc.tuning.loop_bounds import LoopBounds


@pytest.fixture(scope="module")
def slew():
    return gnc.load("satellites/slew")


@pytest.fixture(scope="module")
def funnel():
    return gnc.load("huang2020/slew")


@pytest.mark.parametrize(
    ("text", "units"),
    [
        (None, ["s", "N m s"]),
        ("integral(rate) + 0.5 integral(achieved)", ["rad", "N m s"]),
        ("settling_time+2*largest_wheel_speed", ["s", "rad/s"]),
        ("settling(rate, 1e-3) + peak(mrp) + 1e-2 mean(achieved)", ["s", "-", "N m"]),
    ],
)
def test_terms_have_units(slew, text, units):
    cost, mission = cost_of(text, slew, "pd")
    assert [one.unit for one in cost.terms] == units
    assert {one.column.partition(".")[2] for one in cost.terms} <= {one.name for one in mission.metrics}
    assert cost_of(cost.text, slew, "pd")[0].text == cost.text


def test_default_cost_of_a_craft_whose_rate_alone_is_regulated():
    cost, _ = cost_of(None, gnc.load("huang2020/detumble"), "observer_pinv")
    assert cost.text == "integral(rate) + 0.1 integral(achieved)"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("settling(rate)", r"settling\(rate\) has the threshold '', expected a number above 0"),
        ("peak(rate, 3)", r"peak\(rate, 3\) has a threshold; only settling and reaching take one"),
        ("integral(mpr)", "no signal 'mpr' is recorded; did you mean mrp"),
        ("speed", "the mission has no metric 'speed'; there is settling_time, largest_wheel_speed"),
        ("requirement(ACS-1)", "the mission has no requirement 'ACS-1'; there is none"),
        ("integral(mrp) - 1", r"the cost 'integral\(mrp\) - 1' has the term"),
        ("wobble(mrp)", r"a cost knows no wobble\(...\); there is integral, peak"),
        ("", "the cost '' has the term ''"),
    ],
)
def test_what_is_no_cost_is_told(slew, text, told):
    with pytest.raises(GncError, match=told):
        cost_of(text, slew, "pd")


def test_value_of_each_kind_from_a_record(slew):
    """Of |x| = 3, 2, 1, 0.5, 0.25 at 0 ... 4 s; the integral is the mean times the 4 s of the flight."""
    time, signal = np.arange(5.0), np.array([3.0, -2.0, 1.0, -0.5, 0.25])
    cost, _ = cost_of(
        "integral(rate) + peak(rate) + least(rate) + final(rate) + settling(rate, 0.75) + reaching(rate, 1.5) + "
        "mean(rate)", slew, "pd",
    )  # fmt: skip
    cost = [*cost.terms]
    values = [from_record(one, time, signal, 4.0) for one in cost]
    assert values[1:] == [3.0, 0.25, 0.25, 3.0, 2.0, 1.35]
    never, _ = cost_of("settling(rate, 0.1)", slew, "pd")
    assert from_record(never.terms[0], time, signal, 4.0) == pytest.approx(4.0 * 0.25 / 0.1)


def test_gains_have_bounds_and_scales(slew):
    found = gains_free(slew, "pd", ["attitude_gain", "rate_gain=2:30"])
    assert [(one.low, one.high) for one in found.each] == [(0.4, 40.0), (2.0, 30.0)]
    assert found.start == pytest.approx([math.log(4.0), math.log(18.0)])
    assert found.values(np.array([found.low, found.high])) == pytest.approx(np.array([[0.4, 2.0], [40.0, 30.0]]))
    mixed = gains_free(gnc.load("satellites/slew_and_track"), "mrp", ["integral_gain=0:0.1"])
    assert mixed.values(mixed.start[None, :])[0, 0] == mixed.each[0].value


def test_rounding_gives_both_sides_within_bounds(slew):
    found = gains_free(slew, "pd", ["attitude_gain", "rate_gain=2:18.04"])
    near = found.rounded(np.array([3.14159, 18.037]), 3)
    assert sorted(map(tuple, near)) == [(3.14, 18.0), (3.15, 18.0)]
    assert gains_free(slew, "pd", ["attitude_gain"]).rounded(np.array([4.0]), 2).tolist() == [[4.0]]


@pytest.mark.parametrize(
    ("free", "told"),
    [
        ([], "no gain is free"),
        (["rate_gian"], "flies by AttitudePD, and 'rate_gian' is no gain of it; did you mean rate_gain"),
        (["rate_gain=5:2"], "the bounds of rate_gain are '5:2', expected LOW:HIGH"),
        (["rate_gain=a:b"], "the bounds of rate_gain are 'a:b', expected LOW:HIGH"),
        (["rate_gain=0:20"], "the bounds of rate_gain begin at 0; the law asks for above 0"),
        (["rate_gain=1:2"], "rate_gain is 18, outside its bounds from 1 to 2"),
        (["rate_gain", "rate_gain"], "the gain rate_gain is named twice"),
        (["rate_gain.2"], "leads nowhere"),
    ],
)
def test_what_is_no_gain_is_told(slew, free, told):
    with pytest.raises(GncError, match=told):
        gains_free(slew, "pd", free)


def test_a_gain_of_zero_needs_bounds():
    with pytest.raises(GncError, match=r"integral_gain is 0, from which no scale follows; give its bounds"):
        gains_free(gnc.load("satellites/slew").with_scheme(law=_mrp()), "pd", ["integral_gain"])


def _mrp():
    law = gnc.load("satellites/slew_and_track").scheme("mrp").law
    assert isinstance(law, MrpFeedback)
    return dataclasses.replace(law, integral_gain=0.0)


def test_conditions_of_the_theorem_are_functions_of_the_gains(funnel):
    """At gains that keep Theorem 1 and at others that do not, they hold where the law itself says that they do."""
    gains = gains_free(funnel, "funnel_pinv", ["rate_gain", "observer_gain"])
    found = conditions_of(funnel, "funnel_pinv", gains)
    told = {one.name: one for one in funnel.scheme("funnel_pinv").law.checks()}
    assert found.names == tuple(name for name, one in told.items() if one.holds)
    for values in ([2.0, 27.0], [0.2, 1.0]):
        other = funnel.with_scheme("funnel_pinv", rate_gain=values[0], observer_gain=values[1])
        own = {one.name: one for one in other.scheme().law.checks()}
        assert [m >= 0 for m in found.margins(np.array(values))] == [own[name].holds for name in found.names]


def test_conditions_that_cannot_hold_together_are_named(funnel):
    gains = gains_free(funnel, "funnel_pinv", ["rate_gain=1.9:2.1"])
    with pytest.raises(GncError, match=r"gains\.theorem1\.filter cannot hold with rate_gain from 1\.9 to 2\.1"):
        conditions_of(funnel, "funnel_pinv", gains, every=True)


@dataclasses.dataclass(frozen=True, eq=False)
class AtOdds(AttitudePD):
    """A law whose conditions ask for a fast rate loop and for a quiet one; `far` adds one that holds with either."""

    far: Any = gnc.gain("-", "whether the third is there", symbol="n", minimum=0.0)

    def checks(self):
        def told(name, value, least):
            return gnc.Check(name, value, least, "N m s", "note", "", "", at_least=True)

        yield told("gains.fast", self.rate_gain, 20.0 if self.far else 30.0)
        yield told("gains.quiet", -self.rate_gain, -30.0 if self.far else -10.0)
        if self.far:
            yield told("gains.far", abs(self.rate_gain - 25.0), 10.0)


@pytest.mark.parametrize(
    ("far", "told"),
    [
        (0.0, r"^gains\.fast and gains\.quiet cannot both hold with rate_gain from 5 to 60; widen the bounds"),
        (1.0, r"gains\.fast, gains\.quiet, gains\.far hold in pairs and not all together with rate_gain from 5 to 60"),
    ],
)
def test_conditions_of_which_two_conflict_are_both_named(slew, far, told):
    """At least 30 and at most 10; then 20 to 30 without 15 to 35, of which any two leave a range."""
    law = AtOdds(attitude_gain=4.0, rate_gain=18.0, far=far, body=slew.scheme("pd").law.body)
    with pytest.raises(GncError, match=told):
        gnc.tune(slew.with_scheme("pd", law=law), ["rate_gain=5:60"], conditions="all")


@dataclasses.dataclass(frozen=True, eq=False)
class Stairs(AttitudePD):
    """A law whose gains take effect in stairs, so that no slope by them says anything."""

    def command(self, t, y, m):
        now = self.inputs.split(y)
        return -ca.floor(4 * self.attitude_gain) / 4 * now.mrp - ca.floor(self.rate_gain) * now.rate


@pytest.mark.slow
@pytest.mark.packages("cma")
def test_gains_without_slopes_come_to_the_cost_that_slopes_find_without_stairs(slew):
    short = slew.with_timing(duration=40.0)
    costs = []
    for kind, gains in ((AttitudePD, (1.25, 54.0)), (Stairs, (1.4, 54.2))):  # of the same effect
        law = kind(attitude_gain=gains[0], rate_gain=gains[1], body=slew.scheme("pd").law.body)
        found = gnc.tune(
            short.with_scheme("pd", law=law), ["attitude_gain", "rate_gain"], cost="integral(mrp)", iterations=8
        )
        costs.append(found.cost_after)
        assert ("evolution" in [how for _, how in found.course]) is (kind is Stairs)
    assert costs[1] == pytest.approx(costs[0], rel=0.01)


def test_poles_of_a_turn_are_those_of_its_quadratic(slew):
    """About each axis J s^2 + 18 s + 4/4, an MRP being a quarter of the angle; samples of 0.1 s delay a little."""
    poles = np.concatenate([np.roots([moment, 18.0, 1.0]) for moment in (85.0, 110.0, 64.0)])
    right = {"decay_1_s": -poles.real.max(), "damping": (-poles.real / np.abs(poles)).min()}
    for name, value in right.items():
        assert not LoopBounds({name: 0.99 * value}).short(slew, "pd")
        (told,) = LoopBounds({name: 1.01 * value}).short(slew, "pd")
        assert told.startswith(f"{name} 0.")
    disk = gnc.margins(slew, "pd")[0].disk_of_efforts
    assert not LoopBounds({"disk": disk}).short(slew, "pd")
    assert LoopBounds({"disk": 1.001 * disk}).short(slew, "pd")


def test_options_are_told(slew):
    each: tuple[tuple[dict[str, Any], str], ...] = (
        ({"against": "worst"}, r"satellites/slew has no \[\[dispersion\]\]|slew has no \[\[dispersion\]\]"),
        ({"against": "campaign"}, r"has neither a \[\[dispersion\]\] nor noise"),
        ({"against": "luck"}, "against is 'luck', expected nominal, worst or campaign"),
        ({"digits": 0}, "digits is 0, expected 1 to 17"),
        ({"keep": {"decay": 1.0}}, "a loop has no 'decay' to keep; there is disk, decay_1_s, damping"),
        ({"keep": {"damping": 0.9}}, "the loop of the first gains does not keep what is asked: damping 0.85"),
        ({"conditions": "some"}, "conditions is 'some', expected held or all"),
    )
    for options, told in each:
        with pytest.raises(GncError, match=told):
            gnc.tune(slew, ["rate_gain"], **options)


def test_troubles_are_those_that_were_less_grave_before():
    before: dict[str, Verdict] = {"a": "ok", "b": "warn", "c": "fail", "d": "note"}
    after: dict[str, Verdict] = {"a": "warn", "b": "warn", "c": "ok", "d": "note", "e": "fail", "f": "ok"}
    assert new_troubles(before, after) == ["a", "e"]
