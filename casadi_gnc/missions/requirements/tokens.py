"""The words of a formula, and a hand that moves over them.

Nothing here knows the grammar: see `casadi_gnc.missions.requirements.parsing`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from casadi_gnc.errors import RequirementError

_TOKEN = re.compile(
    r"(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|(?P<name>[A-Za-z_][A-Za-z0-9_]*)|(?P<sign><=|>=|==|!=|[-+*/<>()\[\],])"
)
#: Signs of other languages, and what is written here.
_MEANT = {"=": "==", "&": "and", "|": "or", "!": "not", "~": "not"}


@dataclass(frozen=True)
class Token:
    """One word: a number, a name, a sign or the end, and the character at which it begins, from 0."""

    kind: str
    text: str
    place: int


def shortened(text: str) -> str:
    """Return a text in quotes, on one line, its end cut where it is long."""
    line = " ".join(text.split())
    return f'"{line if len(line) <= 60 else line[:57] + "..."}"'


def misplaced(text: str, place: int, told: str) -> RequirementError:
    """Return an error that says where in a formula something is wrong."""
    before = " ".join(text[:place].split())
    cut = before if len(before) <= 24 else f"...{before[-22:]}"
    after = f', after "{cut}"' if before else ""
    return RequirementError(f"at character {place + 1} of the formula{after}: {told}", "formula")


def _tokens(text: str) -> list[Token]:
    found, place = [], 0
    while place < len(text):
        if text[place].isspace():
            place += 1
            continue
        match = _TOKEN.match(text, place)
        if match is None:
            hint = f"; write {_MEANT[text[place]]}" if text[place] in _MEANT else ""
            raise misplaced(text, place, f"{text[place]!r} is no sign of the language{hint}")
        found.append(Token(str(match.lastgroup), match[0], place))
        place = match.end()
    return [*found, Token("end", "the end", len(text))]


class Cursor:
    """Go through the words of a text once, from left to right."""

    def __init__(self, text: str) -> None:
        self.text, self._tokens, self._at = text, _tokens(text), 0

    @property
    def next(self) -> Token:
        """The word that comes next."""
        return self._tokens[self._at]

    def is_next(self, *texts: str) -> bool:
        """Return whether the next word is one of these."""
        return self.next.kind != "end" and self.next.text in texts

    def take(self) -> Token:
        """Take the next word; the end stays where it is."""
        token = self.next
        self._at += token.kind != "end"
        return token

    def takes(self, *texts: str) -> bool:
        """Take the next word if it is one of these; return whether it was."""
        if self.is_next(*texts):
            self._at += 1
            return True
        return False

    def expect(self, text: str, where: str) -> None:
        """Take a word that must come now."""
        if not self.takes(text):
            raise self.unexpected(f'"{text}" {where}')

    def misplaced(self, place: int, told: str) -> RequirementError:
        """Return an error that says where something is wrong."""
        return misplaced(self.text, place, told)

    def unexpected(self, expected: str) -> RequirementError:
        """Return an error that says what was expected in the place of the next word."""
        token = self.next
        found = token.text if token.kind == "end" else f'"{token.text}"'
        return self.misplaced(token.place, f"expected {expected}, found {found}")

    def finish(self) -> None:
        """Refuse what stands behind the formula."""
        if self.next.kind != "end":
            raise self.unexpected("the end, or a word that joins: and, or, implies, until, <=, ...")
