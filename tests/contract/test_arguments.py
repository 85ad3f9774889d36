"""Arguments of the front door: each is documented, and none is swallowed."""

import inspect
import re

import pytest

import casadi_gnc as gnc

CALLED = [
    name for name in gnc.__all__ if callable(getattr(gnc, name)) and name not in ("GncError", "StepStatus")
]  # an exception, which takes what all do, and an enumeration
KEYWORDS = (inspect.Parameter.VAR_KEYWORD,)


def documentation(thing) -> str:
    """Return the docstring; of a class those of its bases too, from which arguments are inherited."""
    if not inspect.isclass(thing):
        return inspect.getdoc(thing) or ""
    told = [inspect.cleandoc(each.__doc__) for each in thing.__mro__ if each is not object and each.__doc__]
    return "\n".join(told)


@pytest.mark.parametrize("name", CALLED)
def test_every_argument_is_documented(name):
    thing = getattr(gnc, name)
    told = documentation(thing)
    lacking = [each for each in inspect.signature(thing).parameters if not re.search(rf"\b{each}\b", told)]
    assert lacking == []


METHODS = [
    pytest.param(thing, method, id=f"{name}.{method.__name__}")
    for name in CALLED
    if inspect.isclass(thing := getattr(gnc, name))
    for name_of, method in inspect.getmembers(thing, lambda each: inspect.isfunction(each) or inspect.ismethod(each))
    if not name_of.startswith("_") and (method.__module__ or "").startswith("casadi_gnc")
]


@pytest.mark.parametrize(("thing", "method"), METHODS)
def test_every_argument_of_a_method_is_documented(thing, method):
    """By itself or by its class, which says once what its methods take."""
    told = f"{documentation(method)}\n{documentation(thing)}"
    taken = [each for each in inspect.signature(method).parameters if each not in ("self", "cls")]
    assert [each for each in taken if not re.search(rf"\b{each}\b", told)] == []


SWALLOWING = [
    name
    for name in CALLED
    if any(each.kind in KEYWORDS for each in inspect.signature(getattr(gnc, name)).parameters.values())
]


def test_who_passes_keywords_on_is_known():
    assert SWALLOWING == ["campaign", "fly", "fly_all", "vary"]


@pytest.mark.parametrize("name", CALLED)
def test_no_keyword_is_swallowed(name):
    """One that nobody knows is refused, whatever else is right; what is required is given."""
    thing = getattr(gnc, name)
    given = {"problem": "huang2020/detumble", "flights": 1, "keys": "truth.inertia_factor"}
    needed = {
        each.name: given.get(each.name)
        for each in inspect.signature(thing).parameters.values()
        if each.default is each.empty and each.kind in (each.POSITIONAL_OR_KEYWORD, each.KEYWORD_ONLY)
    }
    with pytest.raises((TypeError, gnc.GncError, ValueError), match="nonsuch|takes no arguments"):
        thing(**needed, nonsuch=1)


@pytest.mark.parametrize(("method", "known"), [("with_timing", "duration"), ("with_scheme", "title")])
def test_changes_of_a_mission_are_known_ones(detumble, method, known):
    change = getattr(detumble, method)
    named = ("damping_pinv",) if method == "with_scheme" else ()
    change(*named, **{known: 10.0 if known == "duration" else "x"})
    with pytest.raises((TypeError, gnc.GncError), match="nonsuch"):
        change(*named, nonsuch=1)


def test_values_of_a_layout_are_those_of_its_signals():
    layout = gnc.Layout((gnc.Signal("rate", 3, "rad/s"),))
    with pytest.raises((TypeError, KeyError, gnc.GncError), match="nonsuch"):
        layout.pack(rate=[0, 0, 0], nonsuch=1)
