"""Make files that nobody meant: shipped problem files and tables, changed at random from a seed.

Most changes keep the file TOML and change what it says; some change its text. The same seed gives the same mutant.
"""

from __future__ import annotations

import random
import re
from collections.abc import Callable

from casadi_gnc.problem_files.document import read, shipped

#: A small problem of each kind whose shipped file is large.
SMALL = {
    "matrices": """format = 1
kind = "allocation"
sample_period_s = 0.1
torque_limit_N_m = [0.1, 0.1]
[matrices]
effectiveness = [[1.0, -1.0, 0.5, 0.2], [0.3, 0.4, -1.0, 0.1]]
coupling = [[0.1, 0.2, 0.1, 0.0]]
errors = [[[0.1], [0.0]], [[-0.1], [0.0]]]
lower = 0.0
upper = [1.0, 1.0, 2.0, 1.0]
max_rate_per_s = 5.0
[weights]
accuracy = 1e4
effort = [1.0, 1.0, 2.0, 1.0]
[faults]
dead = [4]
stuck = [{ actuator = 1, force_N = 0.1 }]
degraded = [{ actuator = 2, low = 0.5, high = 1.0 }]
[options]
priorities = [0, 1]
""",
    "wheels": """format = 1
kind = "allocation"
[wheels]
axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.5773502691896258, 0.5773502691896258, 0.5773502691896258]]
inertia_kg_m2 = 1e-3
max_torque_N_m = 0.01
max_momentum_N_m_s = 0.3
speed_rad_per_s = [1.0, 2.0, 3.0, 4.0]
desaturation_per_s = 0.01
[options]
keep_direction = true
""",
    "feedback": """format = 1
kind = "synthesis"
[recipe]
type = "state_feedback"
A = [[0.0, 1.0], [0.0, 0.0]]
B = [[0.0], [1.0]]
E = [[0.0], [1.0]]
C = [[1.0, 0.0], [0.0, 0.0]]
D = [[0.0], [1.0]]
gamma = 3.0
margin = 1e-7
half_widths = [0.1, 0.1]
limit = 10.0
""",
    "ellipsoid": """format = 1
kind = "synthesis"
[recipe]
type = "input_ellipsoid"
A = [[0.0, 1.0], [0.0, 0.0]]
B = [[0.0], [1.0]]
decay_1_s = 0.1
limit = 1.0
vertices = [[0.1, 0.0], [-0.1, 0.0]]
""",
    "claims": """format = 1
kind = "claims"
paper = "nobody (2020)"
doi = "10.1000/1"
[[claim]]
id = "least_mass"
text = "what is computed"
where = "Table 1"
printed = 0.5
tolerance = 0.01
computation = { name = "NAME", arguments = {} }
""",
}

NUMBERS = (
    "0", "-1", "1", "2.5", "1e308", "-1e308", "1e-308", "1e30", "1e300", "1e-30", "inf", "-inf", "nan", "0.0", "-0.0",
    "9223372036854775807", "-9223372036854775808", "1" + "0" * 30, "7" * 5000, "0x" + "f" * 4000, "1e999", "3000",
)  # fmt: skip
OTHERS = (
    '""', '"x"', "true", "false", "[]", "{}", "[[]]", "[[[]]]", "1979-05-27", "07:32:00", "1979-05-27T07:32:00Z",
    '"' + "a" * 2000 + '"', "[" * 40 + "]" * 40, "[1, [2]]", "[1.0, 2.0, 3.0]", "[[1.0, 2.0], [3.0]]", '["a"]',
    "{ a = 1 }", '"./nowhere.py:Craft"', '"huang2020/slew"', "'\\'", '"é ü 漢"', '"../../etc/passwd"', "[true]",
    "[" + "1.0, " * 3000 + "]",
)  # fmt: skip
_VALUE = re.compile(r"(?<![\w.\-\"'])[-+]?\d[\d_]*\.?\d*(?:[eE][-+]?\d+)?(?![\w.\"'])")


def sources() -> dict[str, str]:
    """Return the texts that mutants are made of, by name."""
    found = {name: read(name).text for name in shipped()}
    return {**found, **SMALL}


def _lines(text: str) -> list[str]:
    return text.split("\n")


def _some_line(text: str, draw: random.Random, mark: str = "=") -> int | None:
    places = [k for k, line in enumerate(_lines(text)) if mark in line and not line.lstrip().startswith("#")]
    return draw.choice(places) if places else None


def number(text: str, draw: random.Random) -> str:
    """Replace a number."""
    places = list(_VALUE.finditer(text))
    if not places:
        return text
    place = draw.choice(places)
    return text[: place.start()] + draw.choice(NUMBERS) + text[place.end() :]


def scaled(text: str, draw: random.Random) -> str:
    """Multiply a number by a power of ten, or turn its sign."""
    places = [each for each in _VALUE.finditer(text) if len(each[0]) < 30]
    if not places:
        return text
    place = draw.choice(places)
    value = float(place[0].replace("_", "")) * draw.choice(
        (-1.0, 10.0 ** draw.randint(-12, 12), 10.0 ** draw.randint(-300, 290))
    )
    return text[: place.start()] + repr(value) + text[place.end() :]


def value(text: str, draw: random.Random) -> str:
    """Replace what stands behind a key on one line."""
    at = _some_line(text, draw)
    if at is None:
        return text
    lines = _lines(text)
    lines[at] = f"{lines[at].split('=', 1)[0]}= {draw.choice((*OTHERS, *NUMBERS))}"
    return "\n".join(lines)


def dropped(text: str, draw: random.Random) -> str:
    """Leave a line out."""
    lines = _lines(text)
    del lines[draw.randrange(len(lines))]
    return "\n".join(lines)


def doubled(text: str, draw: random.Random) -> str:
    """Write a line twice, the second time elsewhere half of the times."""
    lines = _lines(text)
    line = draw.choice(lines)
    lines.insert(lines.index(line) if draw.random() < 0.5 else draw.randrange(len(lines)), line)
    return "\n".join(lines)


def renamed(text: str, draw: random.Random) -> str:
    """Change a letter of a key, or give it another name."""
    at = _some_line(text, draw)
    if at is None:
        return text
    lines = _lines(text)
    key, rest = lines[at].split("=", 1)
    place = draw.randrange(max(1, len(key)))
    key = draw.choice(
        (key[:place] + key[place + 1 :], key[:place] + "x" + key[place:], "self ", "a" * 300, '"" ', "a.b.c ")
    )
    lines[at] = f"{key}={rest}"
    return "\n".join(lines)


def shortened(text: str, draw: random.Random) -> str:
    """Leave an entry of a list out, or write one twice."""
    places = [k for k, letter in enumerate(text) if letter == ","]
    if not places:
        return text
    at = draw.choice(places)
    end = min((k for k in (text.find(",", at + 1), text.find("]", at)) if k > 0), default=at)
    piece = text[at:end]
    return text[:at] + (piece * 2 if draw.random() < 0.5 else "") + text[end:]


def moved(text: str, draw: random.Random) -> str:
    """Put a table's header elsewhere, or change its brackets."""
    at = _some_line(text, draw, "[")
    if at is None:
        return text
    lines = _lines(text)
    line = lines.pop(at)
    changed = draw.choice((line, line.strip("[]") and f"[{line.strip('[]')}]", f"[{line}]", f"[x.{line.strip('[]')}]"))
    lines.insert(draw.choice((at, draw.randrange(len(lines) + 1))), changed)
    return "\n".join(lines)


def letters(text: str, draw: random.Random) -> str:
    """Change some letters of the text."""
    for _ in range(draw.randint(1, 4)):
        at = draw.randrange(len(text))
        new = draw.choice(
            ("", "[", "]", "{", "}", '"', "'", "=", ",", "\n", "#", ".", "\\", "\0", "\u202e", "é", "0", "e")
        )
        text = text[:at] + new + text[at + draw.randint(0, 1) :]
    return text


def cut(text: str, draw: random.Random) -> str:
    """End the text too soon, or repeat a part of it."""
    first, last = sorted(draw.randrange(len(text)) for _ in range(2))
    return draw.choice((text[:last], text[first:], text[:last] + text[first:]))


CHANGES: tuple[tuple[Callable[[str, random.Random], str], int], ...] = (
    (number, 6), (scaled, 6), (value, 6), (dropped, 2), (doubled, 2), (renamed, 2), (shortened, 3), (moved, 2),
    (letters, 2), (cut, 1),
)  # fmt: skip


def mutant(seed: int) -> tuple[str, str, bytes]:
    """Return the name of what a mutant was made of, what was done, and its content."""
    draw = random.Random(seed)
    name, text = draw.choice(sorted(_SOURCES.items()))
    if name == "claims":
        text = text.replace("NAME", draw.choice(_computations()))
    done = []
    for _ in range(draw.choice((1, 1, 1, 2, 3))):
        (change,) = draw.choices([each for each, _ in CHANGES], [weight for _, weight in CHANGES])
        text = change(text or " ", draw)
        done.append(change.__name__)
    content = text.encode("utf-8", "surrogatepass")
    if draw.random() < 0.01:
        at = draw.randrange(len(content) + 1)
        content, done = content[:at] + b"\xff\xfe" + content[at:], [*done, "bytes"]
    return name, "+".join(done), content


def _computations() -> list[str]:
    from casadi_gnc.fidelity.computations import COMPUTATIONS

    return sorted(COMPUTATIONS)


_SOURCES = sources()
