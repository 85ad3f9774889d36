"""Texts that are no formula: one sentence that says where, what was expected and what was meant."""

import pytest

from casadi_gnc.errors import RequirementError
from casadi_gnc.missions.requirements import Requirement
from casadi_gnc.missions.requirements.parsing import parse

RECORD = {"time": [0.0, 1.0, 2.0], "rate": [[0.0] * 3] * 3, "speed": [0.0] * 3, "status": [0.0] * 3}

WRONG = {
    "always": 'character 7 of the formula, after "always": expected "(" after always and its interval, found the end',
    "always(": 'character 8 of the formula, after "always(": expected a signal, a number, a function or "(", found the end',
    "always(rate)": "what stands in always(...) is a value, expected a condition such as norm(rate) <= 0.01",
    "always(norm(rate) <= 1": 'expected ")" at the end of always(...), found the end',
    "always(norm(rat) <= 1)": "there is no signal 'rat'; did you mean rate?",
    "always(gibberish <= 1)": "there is no signal 'gibberish'; there is time, rate, speed, status",
    "alway(speed <= 1)": "character 1 of the formula: there is no function 'alway'; did you mean always?",
    "always(sin(speed) <= 1)": "there is no function 'sin'; did you mean min?",
    "always(rate <= 1)": "rate has 3 elements, and a comparison takes one number; take its norm, max(abs(...)) or an element",
    "always(rate[4] <= 1)": "rate has 3 elements, counted from 1; there is no rate[4]",
    "always(rate[0] <= 1)": 'expected the number of an element of rate, counted from 1, found "0"',
    "always(rate[1][2] <= 1)": 'expected ")" at the end of always(...), found "["',
    "always[5, 2](speed <= 1)": "the interval of always ends at 2 s, before it begins at 5 s",
    "always[-1, 2](speed <= 1)": 'expected a time in seconds, not negative, or "end", in the interval of always, found "-"',
    "always[end, 3](speed <= 1)": "the interval of always begins at the end; expected a time in seconds",
    "always[0.2, 0.4](speed <= 1)": "no sample lies from 0.2 to 0.4 s; there is one every 1 s",
    "held(speed <= 1)": "held takes for how long, in seconds: held[60](...)",
    "held[1, 2](speed <= 1)": "held takes for how long, in seconds: held[60](...)",
    "norm(rate) <= 1": '"norm(rate) <= 1" says nothing of when it must hold; write always(...)',
    "always(speed = 1)": "'=' is no sign of the language; write ==",
    "always(speed <= 1) && always(speed <= 2)": "'&' is no sign of the language; write and",
    "always(speed <= 1) and 3": "a part of and is a value",
    "always(not 3)": "what stands after not is a value",
    "always((speed <= 1) + 2 <= 3)": "what is left of + is a condition, expected a value such as norm(rate)",
    "always(raised(FUNEL_LEFT))": "there is no status 'FUNEL_LEFT'; did you mean FUNNEL_LEFT?",
    "always(speed <= 1) always(speed <= 2)": 'expected the end, or a word that joins: and, or, implies, until, <=, ..., found "always"',
    "always(norm(rate, rate) <= 1)": "norm takes 1 argument, got 2",
    "always(dot(rate, [1, 2]) <= 1)": "dot of 3 and 2 elements",
    "always(norm(rate + [1, 2]) <= 1)": "rate has 3 elements and this value 2",
    "always(speed / 0 <= 1)": 'after "always(speed /": a division by zero',
    "always(speed <= 1e400)": "1e400 is beyond the largest number there is",
    "always(speed <= 1e308 * 10)": "a number in this comparison is beyond the largest there is",
    "always(norm <= 3)": 'expected "(" after norm, found "<="',
    f"always({'(' * 40}speed{')' * 40} <= 1)": "expected at most 30 parts inside each other",
    f"always({'+'.join(['speed'] * 300)} <= 1)": "expected at most 200 operations; split the formula",
    "x" * 5000: "the formula has 5000 characters, expected at most 4000; split it",
}


@pytest.mark.parametrize("text", WRONG)
def test_what_is_wrong_is_said_and_where(text):
    with pytest.raises(RequirementError) as told:
        Requirement("ACS-1", formula=text).robustness(RECORD)
    assert str(told.value).startswith("ACS-1: ")
    assert WRONG[text] in str(told.value)
    assert told.value.key == "formula"


@pytest.mark.parametrize(
    ("text", "same"),
    [
        ("always[10](speed <= 1)", "always[0, 10](speed <= 1)"),
        ("always(speed <= 1)", "always[0, end](speed <= 1)"),
        ("always(speed <= 1 and speed >= 0 or speed == 2)", "always((speed <= 1 and speed >= 0) or speed == 2)"),
        ("always(not speed <= 1 and speed <= 2)", "always((not (speed <= 1)) and speed <= 2)"),
        (
            "always(speed <= 1 implies speed <= 2 implies speed <= 3)",
            "always(speed <= 1 implies (speed <= 2 implies speed <= 3))",
        ),
        ("speed <= 1 and speed <= 2 until speed <= 3", "speed <= 1 and (speed <= 2 until speed <= 3)"),
        ("always(1 + 2 * speed - 3 <= 4)", "always((1 + (2 * speed)) - 3 <= 4)"),
        ("always(not not speed <= 1)", "always(speed <= 1)"),
        ("always(\n  speed <= 1\n)", "always(speed<=1)"),
    ],
)
def test_what_binds_tighter(text, same):
    assert _bare(parse(text)) == _bare(parse(same))


def _bare(part):
    """Return a tree without the places in the text."""
    if isinstance(part, tuple):
        return tuple(map(_bare, part))
    if not hasattr(part, "__dataclass_fields__"):
        return part
    return type(part).__name__, *(_bare(getattr(part, name)) for name in part.__dataclass_fields__ if name != "place")


@pytest.mark.parametrize(
    ("given", "told", "key"),
    [
        ({}, "R-1 has neither: a metric with at_most or at_least, or a formula", ""),
        ({"metric": "m", "formula": "always(speed <= 1)", "at_most": 1}, "R-1 has both; keep one of them", ""),
        ({"metric": "m"}, "R-1 bounds m by nothing; give at_most or at_least", "metric"),
        ({"metric": "m", "at_most": float("nan")}, "at_most of R-1 is nan, expected a finite number", "at_most"),
        (
            {"metric": "m", "at_most": 1, "at_least": 2},
            "at_least 2 of R-1 is above at_most 1: nothing can meet both",
            "at_least",
        ),
        (
            {"formula": "always(speed <= 1)", "at_least": 1},
            "R-1 has a formula, which holds its own bounds; leave at_least out",
            "at_least",
        ),
        (
            {"metric": "m", "at_most": 1, "share": 0},
            "share of R-1 is 0, expected a number above 0 and up to 1",
            "share",
        ),
        ({"metric": "m", "at_most": 1, "share": 99.7}, "share of R-1 is 99.7", "share"),
        (
            {"metric": "m", "at_most": 1, "confidence": 1},
            "confidence of R-1 is 1, expected a number between 0 and 1",
            "confidence",
        ),
        ({"id": "1 R", "metric": "m", "at_most": 1}, "a requirement has the id '1 R', expected letters, digits", "id"),
    ],
)
def test_fields_that_do_not_fit(given, told, key):
    with pytest.raises(RequirementError) as error:
        Requirement(**{"id": "R-1", **given})
    assert told in str(error.value)
    assert error.value.key == key


@pytest.mark.parametrize(
    ("record", "told"),
    [
        ({"speed": [0.0]}, "needs a record with the signal time, and there is speed"),
        ({"time": [0.0], "speed": [0.0]}, "needs a record of two samples or more"),
        (
            {"time": [0.0, 1.0, 3.0], "speed": [0.0] * 3},
            "needs samples that are equally apart; theirs are 1 to 2 s apart",
        ),
        ({"time": [0.0, 1.0], "speed": [0.0] * 3}, r"the signal speed has the shape \(3,\), and there are 2 times"),
    ],
)
def test_records_that_are_none(record, told):
    with pytest.raises(RequirementError, match=told):
        Requirement("R", formula="always(speed <= 1)").robustness(record)
