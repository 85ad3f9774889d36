"""Random formulas on random signals: RTAMT's robustness in discrete time, and monitors that agree with the record."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest

from casadi_gnc.missions.requirements import Monitor, Requirement
from casadi_gnc.signals import Layout, Signal

NAMES = ("a", "b", "c")
SAMPLES = 40


class Writer:
    """Write a formula in both languages; of RTAMT's, `held` is `historically` once there are enough samples."""

    def __init__(self, rng, endless=True):
        self.rng, self.held, self.endless = rng, set(), endless

    def interval(self):
        first = self.rng.choice((0, 0, 1, 3))
        return first, first + self.rng.choice((0, 1, 2, 5, 9))

    def compared(self):
        left, right = self.rng.sample(NAMES, 2)
        sign, number = self.rng.choice(("<=", ">=", "<", ">", "==", "!=")), round(self.rng.uniform(-1, 1), 3)
        ours = f"({left} - {right} {sign} {number})"
        return ours, ours.replace("!=", "!==")

    def formula(self, depth):
        if depth == 0:
            return self.compared()
        kind = self.rng.choice(("always", "eventually", "until", "held", "not", "and", "or", "implies"))
        ours, theirs = self.formula(depth - 1)
        if kind == "not":
            return f"not ({ours})", f"not ({theirs})"
        if kind in ("and", "or", "implies"):
            mine, other = self.formula(self.rng.randrange(depth))
            return f"(({ours}) {kind} ({mine}))", f"(({theirs}) {kind} ({other}))"
        if kind == "held":
            length = self.rng.choice((1, 2, 4))
            self.held.add(length)
            return f"held[{length}]({ours})", f"((historically[0,{length}]({theirs})) and (since{length} >= 0.0))"
        first, last = self.interval()
        if kind == "until":
            mine, other = self.formula(self.rng.randrange(depth))
            return f"(({ours}) until[{first}, {last}] ({mine}))", f"(({theirs}) until[{first},{last}] ({other}))"
        if self.endless and self.rng.random() < 0.2:
            return f"{kind}({ours})", f"{kind}({theirs})"
        return f"{kind}[{first}, {last}]({ours})", f"{kind}[{first},{last}]({theirs})"

    def whole(self):
        """Return a formula that says something of time."""
        ours, theirs = self.formula(self.rng.choice((1, 2, 2, 3)))
        first, last = self.interval()
        kind = self.rng.choice(("always", "eventually"))
        return f"{kind}[{first}, {last}]({ours})", f"{kind}[{first},{last}]({theirs})"


def rtamts(text, held, signals):
    import rtamt

    specification = rtamt.StlDiscreteTimeSpecification()
    data = {"time": list(range(SAMPLES)), **{name: list(map(float, signals[name])) for name in NAMES}}
    data |= {f"since{length}": [-math.inf] * length + [math.inf] * (SAMPLES - length) for length in held}
    for name in data:
        if name != "time":
            specification.declare_var(name, "float")
    specification.spec = text
    specification.parse()
    return specification.evaluate(data)[0][1]


def test_monitors_that_are_told_of_the_end_say_what_the_record_says():
    """Every formula with bounded inner intervals; so does the monitor's verdict before, where it has one."""
    rng, row = random.Random(16), Layout((Signal("time", 1, "s"), *map(Signal, NAMES)))
    decided = 0
    for number in range(150):
        ours, _ = Writer(rng, endless=False).whole()
        numbers, time = np.random.default_rng(number), np.arange(float(SAMPLES))
        signals = {name: np.cumsum(numbers.normal(size=SAMPLES)) * 0.5 for name in NAMES}
        requirement = Requirement("R", formula=ours)
        monitor = Monitor([requirement], row, 1.0)
        words = [
            monitor.step(time=t, **{name: signals[name][i] for name in NAMES})["R"].word for i, t in enumerate(time)
        ]
        truth, last = requirement.robustness({"time": time, **signals}), monitor.finish()["R"]
        assert (last.robustness, last.word) == (truth, "met" if truth >= 0 else "not met"), ours
        assert set(words) <= {"open", last.word}, ours
        decided += words[-1] != "open"
    assert 75 < decided <= 150


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:typing.io is deprecated")  # of the parser that it runs on
@pytest.mark.packages("rtamt")
def test_a_thousand_random_formulas_have_its_robustness():
    rng, infinite = random.Random(15), 0
    for number in range(1000):
        writer = Writer(rng)
        ours, theirs = writer.whole()
        numbers = np.random.default_rng(number)
        signals = {name: np.cumsum(numbers.normal(size=SAMPLES)) * 0.5 for name in NAMES}
        requirement = Requirement("R", formula=ours)
        found = requirement.robustness({"time": np.arange(SAMPLES, dtype=float), **signals})
        expected = rtamts(theirs, writer.held, signals)
        if math.isinf(expected):
            infinite += 1
            assert found == expected, ours
        else:
            assert abs(found - expected) <= 1e-12 * max(1.0, abs(expected)), ours
    assert 0 < infinite < 300  # most say a number
