"""The words of messages: what was given, shown short as a file would write it, and what was expected in its place."""

from __future__ import annotations

import datetime
from collections.abc import Iterable, Mapping
from typing import Any

from casadi_gnc.tables.part import NAME

#: Most characters of a message with its place.
LONGEST = 500
#: Most characters of a value, or a key, that are shown.
SHOWN = 60
_CLOCK = (datetime.date, datetime.time, datetime.datetime)
#: What patterns ask for.
_PATTERNS = {
    NAME: "a name of letters, digits and _ that begins with a letter and has 63 characters at most",
    r"^[a-z][a-z0-9_]{0,40}$": "a name of small letters, digits and _ that begins with a letter",
}


def shown(value: Any) -> str:
    """Return a value for a message, short, and as a problem file would write it.

    Examples
    --------
    >>> shown(True), shown([1.0, 2.0]), shown("x" * 100)[:8], shown({"a": 1})
    ('true', '[1.0, 2.0]', "'xxxxxxx", 'a table')
    """
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, list):
        small = len(value) <= 8 and not any(isinstance(each, (list, dict, str)) for each in value)
        told = f"[{', '.join(map(shown, value))}]" if small else ""
        return told if 0 < len(told) <= SHOWN else f"a list of {len(value)}"
    if isinstance(value, _CLOCK):
        return f"the date or time {value.isoformat()}"
    if isinstance(value, int) and abs(value) >= 10**20:
        return f"a whole number of {len(f'{value:x}')} hexadecimal digits"
    if value is None:
        return "nothing"
    return cut(repr(value), SHOWN)


def cut(text: str, most: int = LONGEST) -> str:
    """Return a text of bounded length; dots stand for what was left out at its end."""
    return text if len(text) <= most else f"{text[: most - 4].rstrip()} ..."


def expected(kinds: Iterable[str]) -> str:
    """Return what may stand in a place, of one kind or another: "a number > 0 or a list of such"."""
    kinds = list(dict.fromkeys(kinds))
    if len(kinds) > 1 and "a list" in kinds and any(each.startswith(("a number", "a finite number")) for each in kinds):
        kinds = [each for each in kinds if each != "a list"] + ["a list of such"]
    return " or ".join(kinds)


def kind_asked(problem: Mapping[str, Any]) -> str | None:
    """Return what pydantic expected where it found another kind of value, or a value out of range; None for others."""
    context = problem.get("ctx", {})
    match problem["type"]:
        case "float_type" | "float_parsing":
            return "a number"
        case "int_type" | "int_parsing" | "int_from_float" | "int_parsing_size":
            return "a whole number"
        case "string_type":
            return "a text in quotes"
        case "bool_type" | "bool_parsing":
            return "true or false"
        case "list_type":
            return "a list"
        case "dict_type" | "model_type" | "model_attributes_type":
            return "a table"
        case "finite_number":
            return "a finite number"
        case "greater_than":
            return f"a number > {context['gt']:g}"
        case "greater_than_equal":
            return f"a number >= {context['ge']:g}"
        case "less_than":
            return f"a number < {context['lt']:g}"
        case "less_than_equal":
            return f"a number <= {context['le']:g}"
        case "literal_error":
            return str(context["expected"])
        case "string_pattern_mismatch":
            return _PATTERNS.get(context["pattern"], "a text of another form")
    return None


def length_asked(problem: Mapping[str, Any]) -> str | None:
    """Return how long a list is and should be; None where that is not what is wrong."""
    context = problem.get("ctx", {})
    limits = {"too_short": ("min_length", "at least"), "too_long": ("max_length", "at most")}
    if problem["type"] not in limits:
        return None
    key, word = limits[problem["type"]]
    count = context["actual_length"] if context.get("actual_length") is not None else "more"
    return f"has {count} {'entry' if count == 1 else 'entries'}, expected {word} {context[key]}"
