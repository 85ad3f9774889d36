"""Formulas mean what their definition says: in a record, in a flight's tally and sample by sample."""

import math

import numpy as np
import pytest
import temporal_logic as truth

from casadi_gnc.errors import RequirementError
from casadi_gnc.missions.requirements import Monitor, Requirement, watches
from casadi_gnc.signals import Layout, Signal

PERIOD = 0.5
ROW = Layout((Signal("time", 1, "s"), *(Signal(name) for name in truth.SIGNALS)))


def cases(seed: int, count: int, *, longest: int = 6, steps: int = 0):
    """Yield formulas, their text and signals; with `steps`, signals of whole numbers so that margins are often 0."""
    rng = np.random.default_rng(seed)
    while count:
        formula = truth.drawn(rng, int(rng.integers(1, 5)), longest)
        if formula[0] in truth.COMPARISONS or not any(
            word in str(formula) for word in ("always", "eventually", "until", "held")
        ):
            continue
        count -= 1
        samples = int(rng.integers(2, 25))
        signals = {name: rng.normal(size=samples) for name in truth.SIGNALS}
        if steps:
            signals = {name: np.round(steps * values) for name, values in signals.items()}
            formula = _rounded(formula, steps)
        yield formula, truth.text(formula, PERIOD), signals


def _rounded(formula, steps):
    if formula[0] in truth.COMPARISONS:
        return (*formula[:2], float(round(steps * formula[2])))
    return tuple(_rounded(part, steps) if isinstance(part, tuple) else part for part in formula)


def record(signals):
    return {"time": PERIOD * np.arange(len(signals["a"])), **signals}


def test_robustness_is_that_of_the_definition():
    """Least and largest pick one of the margins and change no bit."""
    for formula, text, signals in cases(1, 600):
        found = Requirement("R", formula=text).robustness(record(signals))
        assert found == truth.robustness(formula, signals), text


def test_the_sign_says_whether_it_holds():
    """Signals of whole numbers lie on their bounds often: strict and other comparisons are told apart."""
    met = 0
    for formula, text, signals in cases(2, 600, steps=1):
        verdict = Requirement("R", formula=text).verdict(record(signals))
        assert verdict.met == truth.holds(formula, signals), text
        met += verdict.met
    assert 100 < met < 500


def test_the_tally_says_what_the_record_says():
    """Sample by sample, as engines fold it; what does not fit says so by not being there."""
    folded = 0
    for formula, text, signals in cases(3, 400):
        watched = watches([Requirement("R", formula=text)], ROW, PERIOD)
        folded += len(watched)
        for watch in watched:
            kept = np.array(watch.initial)
            for k, t in enumerate(record(signals)["time"]):
                row = [t, *(values[k] for values in signals.values())]
                kept = np.array(watch.step(row, kept)).ravel()
                upto = {name: values[: k + 1] for name, values in signals.items()}
                assert watch.read(kept) == truth.robustness(formula, upto), text
    assert folded > 100


def ahead(formula):
    """Return how many samples after an instant a formula needs."""
    kind, *rest = formula
    inner = max((ahead(part) for part in rest if isinstance(part, tuple)), default=0)
    return inner + (rest[1] if kind in ("always", "eventually", "until") else 0)


def without_end(formula):
    kind, *rest = formula
    return any(without_end(part) for part in rest if isinstance(part, tuple)) or (
        kind in ("always", "eventually", "until") and rest[1] is None
    )


def judged(formula, signals):
    """Return the robustness over those instants of the outermost interval whose own intervals have passed."""
    kind, first, last, *parts = formula
    known = len(signals["a"]) - max(map(ahead, parts))
    window = range(first, max(0, known if last is None else min(last + 1, known)))
    if kind == "until":
        keep, goal = parts
        reached = [
            min([truth.robustness(goal, signals, j), *(truth.robustness(keep, signals, i) for i in range(j))])
            for j in window
        ]
        return max(reached, default=-math.inf)
    values = [truth.robustness(parts[0], signals, j) for j in window]
    return min(values, default=math.inf) if kind == "always" else max(values, default=-math.inf)


@pytest.mark.slow
def test_a_monitor_judges_each_instant_once_its_intervals_have_passed():
    """Windows that reach past the sample at hand are not judged yet; those that were are as the definition says."""
    rng, watched = np.random.default_rng(4), 0
    while watched < 200:
        kind = str(rng.choice(("always", "eventually", "until")))
        inner = [truth.drawn(rng, int(rng.integers(1, 4)), 4) for _ in range(1 + (kind == "until"))]
        first, last = sorted(int(n) for n in rng.integers(0, 12, 2))
        formula = (kind, first, None if rng.random() < 0.5 else last, *inner)
        if any(map(without_end, inner)):
            continue
        watched += 1
        text = truth.text(formula, PERIOD)
        parts = [text, f"not ({text})", f"({text}) and always(a <= 1)", f"({text}) or eventually[0.6, 3](b >= 1)", "always(a <= 1)",
                 "eventually[0.6, 3](b >= 1)"]  # fmt: skip
        monitor = Monitor([Requirement(f"R{i}", formula=each) for i, each in enumerate(parts)], ROW, PERIOD)
        signals = {name: rng.normal(size=30) for name in truth.SIGNALS}
        for k in range(30):
            seen = [
                each.robustness
                for each in monitor.step(time=PERIOD * k, **{n: v[k] for n, v in signals.items()}).values()
            ]
            expected = judged(formula, {name: values[: k + 1] for name, values in signals.items()})
            assert seen[:2] == [expected, -expected], (text, k)
            assert seen[2] == min(expected, seen[4])
            assert seen[3] == max(expected, seen[5])


def test_a_monitor_says_met_or_not_met_only_of_what_stays_so():
    """Whatever comes after: the same record continued in many ways."""
    rng, decided = np.random.default_rng(7), 0
    for _, text, signals in cases(5, 150, longest=4):
        try:
            monitor = Monitor([Requirement("R", formula=text)], Layout(ROW.signals), PERIOD)
        except RequirementError:
            continue
        words = []
        for k, t in enumerate(record(signals)["time"]):
            words.append(monitor.step(time=t, **{name: values[k] for name, values in signals.items()})["R"].word)
        known = [k for k, word in enumerate(words) if word != "open"]
        if not known:
            continue
        assert len(set(words[known[0] :])) == 1, text
        decided += 1
        for scale in (1.0, 3.0, 100.0):
            longer = {n: np.append(v[: known[0] + 1], scale * rng.normal(size=60)) for n, v in signals.items()}
            assert Requirement("R", formula=text).verdict(record(longer)).word == words[known[0]], text
    assert decided > 40


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("always(norm(v) <= 6)", 1.0),
        ("always(max(abs(v)) <= 4.5)", 0.5),
        ("always(min(v) >= -5)", 1.0),
        ("always(-5 <= v[3] < 2)", 1.0),
        ("always(dot(v, [0, 0, 2]) > -8.5)", 0.5),
        ("always(norm(v - [3, 0, -4]) <= 0.25)", 0.25),
        ("always((v[1] + v[3]) * 2 / 4 >= -1)", 0.5),
        ("always(sqrt(v[1] + 1) == 2)", 0.0),
        ("always(max(v[1], 1, v[3]) <= +3.5)", 0.5),
        ("always(- v[3] <= 4)", 0.0),
        ("always(sqrt(v[3]) <= 1)", -math.inf),
        ("always(not sqrt(v[3]) <= 1)", -math.inf),
        ("always(v[1] / v[2] > 1)", math.inf),
        ("always[1, 1](2 <= 3)", 1.0),
        ("eventually[2, 3](2 <= 3)", -math.inf),
        ("always(v[2] / abs(v[2]) > 1)", -math.inf),
    ],
)
def test_values_and_comparisons(text, expected):
    signals = {"time": [0.0, 1.0], "v": [[3.0, 0.0, -4.0]] * 2}
    assert Requirement("R", formula=text).robustness(signals) == expected


@pytest.mark.parametrize(
    ("text", "met"),
    [
        ("always(status == 0)", False),
        ("always[0, 1](status == 0)", True),
        ("always[0, 1](status != 0)", False),
        ("always(not raised(FUNNEL_LEFT))", False),
        ("eventually(raised(COMMAND_LIMITED))", True),
        ("always[2, end](raised(FUNNEL_LEFT) and not raised(COMMAND_LIMITED))", False),
        ("always[2](not raised(FUNNEL_LEFT))", False),
        ("always[3, end](raised(FUNNEL_LEFT) and raised(COMMAND_LIMITED) and not raised(EFFORT_SHORT))", True),
        ("eventually(raised(EFFORT_SHORT) or not raised(FUNNEL_LEFT))", True),
    ],
)
def test_bits_of_the_status(text, met):
    signals = {"time": [0.0, 1.0, 2.0, 3.0], "status": [0.0, 0.0, 4.0, 6.0]}
    assert Requirement("R", formula=text).verdict(signals).met is met


def test_what_is_not_a_number_meets_nothing():
    signals = {"time": [0.0, 1.0], "v": [1.0, math.nan], "status": [0.0, math.nan]}
    for text in ("v <= 2", "v > 2", "v == 2", "v != 2", "not v <= 2", "raised(FUNNEL_LEFT)", "not raised(FUNNEL_LEFT)"):
        assert Requirement("R", formula=f"always[1, 1]({text})").robustness(signals) < 0, text


def test_intervals_fall_on_samples():
    """From the first sample at or after the begin to the last at or before the end; held at least so long."""
    signals = {"time": 0.1 * np.arange(11), "v": np.arange(11.0)}
    for text, expected in (
        ("always[0.3, 0.7](v >= 0)", 3.0),
        ("always[0.25, 0.7](v >= 0)", 3.0),
        ("always[0.3, 0.75](v <= 0)", -7.0),
        ("eventually[0.6](v >= 0)", 6.0),
        ("eventually(held[0.25](v <= 5))", 2.0),
        ("eventually(held[0.3](v <= 5))", 2.0),
    ):
        assert Requirement("R", formula=text).robustness(signals) == expected, text
    with pytest.raises(RequirementError, match="no sample lies from 0.32 to 0.38 s; there is one every 0.1 s"):
        Requirement("R", formula="always[0.32, 0.38](v >= 0)").robustness(signals)


def test_windows_of_any_width_in_long_records():
    """Against the least of every window, taken one by one."""
    values = np.random.default_rng(9).normal(size=20_000)
    signals = {"time": np.arange(20_000.0), "a": values}
    for width in (1, 2, 3, 1000, 19_999, 20_000, 30_000):
        found = Requirement("R", formula=f"eventually(always[0, {width - 1}](a >= 0))").robustness(signals)
        assert found == max(values[k : k + width].min() for k in range(len(values))), width
