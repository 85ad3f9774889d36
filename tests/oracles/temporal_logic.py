"""Formulas over time, drawn at random, and what they mean by the definition: every instant and window written out.

A formula is a tuple: ("<=", signal, number) and the like, ("not", x), ("and", x, y), ("or", x, y), ("implies", x, y),
("always", first, last, x), ("eventually", first, last, x), ("held", length, x), ("until", first, last, x, y); times in
whole samples, None for the end of the record.
"""

import math

import numpy as np

COMPARISONS = ("<=", ">=", "<", ">")
SIGNALS = ("a", "b", "c")


def drawn(rng: np.random.Generator, depth: int, longest: int, words=("always", "eventually", "until", "held")) -> tuple:
    """Return a formula of at most so many parts inside each other, intervals up to `longest` samples."""
    if depth == 0 or rng.random() < 0.1:
        return (str(rng.choice(COMPARISONS)), str(rng.choice(SIGNALS)), round(float(rng.normal()), 3))
    kind = str(rng.choice(("not", "and", "or", "implies", *words, *words)))
    inner = lambda: drawn(rng, depth - 1, longest, words)  # noqa: E731
    if kind == "not":
        return (kind, inner())
    if kind in ("and", "or", "implies"):
        return (kind, inner(), inner())
    first, last = sorted(int(n) for n in rng.integers(0, longest + 1, 2))
    if kind == "held":
        return (kind, last, inner())
    window = (first, None if rng.random() < 0.15 else last)
    return (kind, *window, inner(), *([inner()] if kind == "until" else []))


def text(formula: tuple, period: float) -> str:
    """Return the formula as a problem file has it."""
    kind, *rest = formula
    if kind in COMPARISONS:
        return f"{rest[0]} {kind} {rest[1]!r}"
    parts = [f"({text(part, period)})" for part in rest if isinstance(part, tuple)]
    if kind == "not":
        return f"not {parts[0]}"
    if kind in ("and", "or", "implies"):
        return f"{parts[0]} {kind} {parts[1]}"
    if kind == "held":
        return f"held[{rest[0] * period!r}]{parts[0]}"
    window = f"[{rest[0] * period!r}, {'end' if rest[1] is None else repr(rest[1] * period)}]"
    return f"{parts[0]} until{window} {parts[1]}" if kind == "until" else f"{kind}{window}{parts[0]}"


def robustness(formula: tuple, signals: dict[str, np.ndarray], k: int = 0) -> float:
    """Return the robustness at sample k, by the definition."""
    kind, *rest = formula
    count = len(signals["a"])
    if kind in COMPARISONS:
        value, bound = float(signals[rest[0]][k]), rest[1]
        return bound - value if kind in ("<", "<=") else value - bound
    if kind == "not":
        return -robustness(rest[0], signals, k)
    if kind in ("and", "or", "implies"):
        left, right = (robustness(part, signals, k) for part in rest)
        return min(left, right) if kind == "and" else max(-left if kind == "implies" else left, right)
    if kind == "held":
        length, part = rest
        return min(robustness(part, signals, i) for i in range(k - length, k + 1)) if k >= length else -math.inf
    first, last, *parts = rest
    window = range(k + first, count if last is None else min(k + last + 1, count))
    if kind == "until":
        keep, goal = parts
        reached = [
            min([robustness(goal, signals, j), *(robustness(keep, signals, i) for i in range(k, j))]) for j in window
        ]
        return max(reached, default=-math.inf)
    values = [robustness(parts[0], signals, j) for j in window]
    return min(values, default=math.inf) if kind == "always" else max(values, default=-math.inf)


def holds(formula: tuple, signals: dict[str, np.ndarray], k: int = 0) -> bool:
    """Return whether the formula holds at sample k, without any robustness."""
    kind, *rest = formula
    count = len(signals["a"])
    if kind in COMPARISONS:
        value, bound = signals[rest[0]][k], rest[1]
        return {"<=": value <= bound, ">=": value >= bound, "<": value < bound, ">": value > bound}[kind]
    if kind == "not":
        return not holds(rest[0], signals, k)
    if kind in ("and", "or", "implies"):
        left, right = (holds(part, signals, k) for part in rest)
        return (left and right) if kind == "and" else (left or right) if kind == "or" else (not left or right)
    if kind == "held":
        return k >= rest[0] and all(holds(rest[1], signals, i) for i in range(k - rest[0], k + 1))
    first, last, *parts = rest
    window = range(k + first, count if last is None else min(k + last + 1, count))
    if kind == "until":
        return any(
            holds(parts[1], signals, j) and all(holds(parts[0], signals, i) for i in range(k, j)) for j in window
        )
    return (all if kind == "always" else any)(holds(parts[0], signals, j) for j in window)
