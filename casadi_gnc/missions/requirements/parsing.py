"""Read the text of a formula.

    formula     = alternative [ "implies" formula ]
    alternative = conjunction { "or" conjunction }
    conjunction = span { "and" span }
    span        = negation [ "until" [ interval ] negation ]
    negation    = "not" negation | comparison
    comparison  = sum { ( "<" | "<=" | ">" | ">=" | "==" | "!=" ) sum }
    sum         = term { ( "+" | "-" ) term }
    term        = factor { ( "*" | "/" ) factor }
    factor      = [ "-" | "+" ] factor | primary
    primary     = number | signal [ "[" element "]" ] | function "(" formula { "," formula } ")"
                | ( "always" | "eventually" | "held" ) [ interval ] "(" formula ")"
                | "raised" "(" status ")" | "[" sum { "," sum } "]" | "(" formula ")"
    interval    = "[" [ first "," ] ( last | "end" ) "]"

Values and conditions share parentheses, so what a part is follows from what was read, and a wrong one is told by
what it is and what was expected.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable
from typing import TypeVar

from casadi_gnc.errors import RequirementError
from casadi_gnc.missions.requirements import syntax
from casadi_gnc.missions.requirements.syntax import Condition, Interval, Part, Value
from casadi_gnc.missions.requirements.tokens import Cursor, shortened
from casadi_gnc.status import StepStatus

#: Parts inside parts, operations and characters beyond which a text is no formula that anyone reads.
_DEEPEST, _MOST, _LONGEST = 30, 200, 4000
_COMPARISONS = ("<", "<=", ">", ">=", "==", "!=")

_Kind = TypeVar("_Kind", bound=Part)


def parse(text: str) -> Condition:
    """Return the condition that a formula says.

    Parameters
    ----------
    text : of the formula.

    Raises
    ------
    RequirementError
        Where it is none: at which character, what was expected and what was found.

    Examples
    --------
    >>> parse("always[0, 600](norm(rate) <= 0.01)").word
    'always'
    """
    if len(text) > _LONGEST:
        raise RequirementError(
            f"the formula has {len(text)} characters, expected at most {_LONGEST}; split it", "formula"
        )
    reader = _Reader(text)
    found = reader.condition(reader.formula(), "the formula")
    reader.finish()
    if not any(isinstance(part, (syntax.Temporal, syntax.Until)) for part in found.walk()):
        raise RequirementError(
            f"the formula {shortened(text)} says nothing of when it must hold; write always(...), "
            "eventually[0, 60](...), ... until ...",
            "formula",
        )
    return found


class _Reader(Cursor):
    """Read parts of a formula from where the cursor stands."""

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._depth = self._operations = 0

    # What a part is.

    def condition(self, part: Part, what: str) -> Condition:
        """Return a part that is a condition; refuse a value."""
        return self._of_kind(part, Condition, f"{what} is a value, expected a condition such as norm(rate) <= 0.01")

    def value(self, part: Part, what: str) -> Value:
        """Return a part that is a value; refuse a condition."""
        return self._of_kind(part, Value, f"{what} is a condition, expected a value such as norm(rate)")

    def _of_kind(self, part: Part, kind: type[_Kind], told: str) -> _Kind:
        if isinstance(part, kind):
            return part
        raise self.misplaced(part.place, told)

    # The grammar, from what binds loosest.

    def formula(self) -> Part:
        """Read one formula, or one value where that is what stands there."""
        self._depth += 1
        if self._depth > _DEEPEST:
            raise self.misplaced(self.next.place, f"expected at most {_DEEPEST} parts inside each other")
        left = self._joined(False)
        place = self.next.place
        if self.takes("implies"):
            premise = self.condition(left, "what stands before implies")
            then = self.condition(self.formula(), "what stands after implies")
            left = syntax.Junction(place, False, (syntax.Not(premise.place, premise), then))
        self._depth -= 1
        return left

    def _joined(self, every: bool) -> Part:
        word = "and" if every else "or"
        parts = [self._span() if every else self._joined(True)]
        place = self.next.place
        while self.takes(word):
            parts.append(self._span() if every else self._joined(True))
        if len(parts) == 1:
            return parts[0]
        return syntax.Junction(place, every, tuple(self.condition(part, f"a part of {word}") for part in parts))

    def _span(self) -> Part:
        keep, place = self._negation(), self.next.place
        if not self.takes("until"):
            return keep
        interval = self._interval("until")
        goal = self.condition(self._negation(), "what stands after until")
        return syntax.Until(place, interval, self.condition(keep, "what stands before until"), goal)

    def _negation(self) -> Part:
        place = self.next.place
        if self.is_next("not"):
            count = 0
            while self.takes("not"):
                count += 1
            part = self.condition(self._comparison(), "what stands after not")
            return syntax.Not(place, part) if count % 2 else part
        return self._comparison()

    def _comparison(self) -> Part:
        left, found = self._sum(), []
        while self.is_next(*_COMPARISONS):
            sign = self.take()
            right = self._sum()
            values = (
                self.value(left, f"what is left of {sign.text}"),
                self.value(right, f"what is right of {sign.text}"),
            )
            found.append(syntax.Comparison(sign.place, sign.text, *values))
            left = right
        if not found:
            return left
        return found[0] if len(found) == 1 else syntax.Junction(found[0].place, True, tuple(found))

    def _sum(self) -> Part:
        return self._operated(("+", "-"), self._term)

    def _term(self) -> Part:
        return self._operated(("*", "/"), self._factor)

    def _operated(self, signs: tuple[str, ...], operand: Callable[[], Part]) -> Part:
        left = operand()
        while self.is_next(*signs):
            sign, self._operations = self.take(), self._operations + 1
            if self._operations > _MOST:
                raise self.misplaced(sign.place, f"expected at most {_MOST} operations; split the formula")
            sides = (
                self.value(left, f"what is left of {sign.text}"),
                self.value(operand(), f"what is right of {sign.text}"),
            )
            left = syntax.Arithmetic(sign.place, sign.text, *sides)
        return left

    def _factor(self) -> Part:
        place, minus, signs = self.next.place, False, 0
        while self.is_next("-", "+"):
            minus, signs = minus != (self.take().text == "-"), signs + 1
        part = self._primary()
        if not signs:
            return part
        value = self.value(part, "what has a sign")
        if isinstance(value, syntax.Number):
            return syntax.Number(place, -value.number if minus else value.number)
        return syntax.Arithmetic(place, "-", syntax.Number(place, 0.0), value) if minus else value

    def _primary(self) -> Part:
        token = self.next
        if token.kind == "number":
            return self._number()
        if token.text in syntax.TEMPORAL:
            return self._temporal()
        if token.text in syntax.FUNCTIONS:
            return self._call()
        if self.takes("raised"):
            return self._raised(token.place)
        if self.takes("("):
            part = self.formula()
            self.expect(")", 'for the "(" before')
            return part
        if self.takes("["):
            elements = self._listed("an element of the vector")
            self.expect("]", "at the end of the vector")
            return syntax.Vector(token.place, elements)
        if token.kind == "name" and token.text not in syntax.WORDS:
            return self._named()
        raise self.unexpected('a signal, a number, a function or "("')

    def _number(self) -> syntax.Number:
        token = self.take()
        number = float(token.text)
        if not number < float("inf"):
            raise self.misplaced(token.place, f"{token.text} is beyond the largest number there is")
        return syntax.Number(token.place, number)

    def _named(self) -> syntax.Named:
        token = self.take()
        if self.is_next("("):
            near = difflib.get_close_matches(
                token.text.lower(), (*syntax.FUNCTIONS, *syntax.TEMPORAL, "raised"), 1, 0.5
            )
            hint = (
                f"; did you mean {near[0]}?"
                if near
                else f"; there is {', '.join((*syntax.FUNCTIONS, *syntax.TEMPORAL))}"
            )
            raise self.misplaced(token.place, f"there is no function {token.text!r}{hint}")
        if not self.takes("["):
            return syntax.Named(token.place, token.text)
        number = self.next
        if not number.text.isdecimal() or int(number.text) < 1:
            raise self.unexpected(f"the number of an element of {token.text}, counted from 1")
        self.take()
        self.expect("]", f"after the element of {token.text}")
        return syntax.Named(token.place, token.text, int(number.text))

    def _listed(self, what: str) -> tuple[Value, ...]:
        values = [self.value(self.formula(), what)]
        while self.takes(","):
            values.append(self.value(self.formula(), what))
        return tuple(values)

    def _call(self) -> syntax.Call:
        token = self.take()
        self.expect("(", f"after {token.text}")
        arguments = self._listed(f"an argument of {token.text}")
        self.expect(")", f"after the arguments of {token.text}")
        return syntax.Call(token.place, token.text, arguments)

    def _raised(self, place: int) -> syntax.Raised:
        self.expect("(", "after raised")
        token = self.next
        if token.text not in StepStatus.__members__:
            near = difflib.get_close_matches(token.text.upper(), StepStatus.__members__, 1)
            hint = f"did you mean {near[0]}?" if near else f"there is {', '.join(StepStatus.__members__)}"
            raise self.misplaced(token.place, f"there is no status {token.text!r}; {hint}")
        self.take()
        self.expect(")", "after the status")
        return syntax.Raised(place, token.text)

    def _temporal(self) -> syntax.Temporal:
        token = self.take()
        interval = self._interval(token.text)
        if token.text == "held" and (interval.last is None or interval.first):
            raise self.misplaced(token.place, "held takes for how long, in seconds: held[60](...)")
        self.expect("(", f"after {token.text} and its interval")
        part = self.formula()
        self.expect(")", f"at the end of {token.text}(...)")
        part = self.condition(part, f"what stands in {token.text}(...)")
        return syntax.Temporal(token.place, token.text, interval, part)

    def _interval(self, word: str) -> Interval:
        """Read [first, last], [last] or [first, end], where one stands."""
        place = self.next.place
        if not self.takes("["):
            return Interval()
        numbers = [self._second(word)]
        if self.takes(","):
            numbers.append(self._second(word))
        self.expect("]", f"at the end of the interval of {word}")
        first, last = (0.0, numbers[0]) if len(numbers) == 1 else numbers
        if first is None:
            raise self.misplaced(place, f"the interval of {word} begins at the end; expected a time in seconds")
        if last is not None and last < first:
            raise self.misplaced(place, f"the interval of {word} ends at {last:g} s, before it begins at {first:g} s")
        return Interval(first, last)

    def _second(self, word: str) -> float | None:
        if self.takes("end"):
            return None
        if self.next.kind != "number":
            raise self.unexpected(f'a time in seconds, not negative, or "end", in the interval of {word}')
        return self._number().number
