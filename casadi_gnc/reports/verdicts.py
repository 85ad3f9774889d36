"""The verdict on flights in words: what flew, what fails, what to look at."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from casadi_gnc.reports.records import Flown, Record

Gravity = Literal["bad", "warn", "note"]
#: Statuses after which a flight cannot be trusted, or has broken what it was asked.
_BAD = {
    "DIVERGED": "it diverged",
    "FUNNEL_LEFT": "it left its funnel",
    "KEEP_OUT_ENTERED": "it entered the keep-out sphere",
    "ALLOCATION_FAILED": "an allocation found no usable answer",
}
#: Statuses that belong to most flights.
_COMMON = ("COMMAND_LIMITED",)


def gravity(status: str) -> Gravity:
    """Return how grave a status is for whoever reads of a flight."""
    return "bad" if status in _BAD else "note" if status in _COMMON else "warn"


@dataclass(frozen=True)
class Look:
    """One thing that a reader must look at.

    Parameters
    ----------
    gravity : how grave it is.
    text : one sentence.
    whose : of each scheme that it is about, its title and what is told of it there.
    at : when it first began, [s], None for no time.
    """

    gravity: Gravity
    text: str
    whose: tuple[tuple[str, str], ...]
    at: float | None = None


@dataclass(frozen=True)
class Verdict:
    """What a page says first.

    Parameters
    ----------
    gravity : of the whole, "good" where nothing is wrong.
    word : in one or two words.
    sentences : what flew, what fails.
    looks : what to look at, the gravest first.
    """

    gravity: Literal["good", "warn", "bad"]
    word: str
    sentences: list[str]
    looks: list[Look]


def judged(flown: Flown) -> Verdict:
    """Return the verdict on the flights of a mission."""
    looks = _joined([look for record in flown.records for look in _looks(record)])
    known = [record for record in flown.records if record.summary is not None]
    failing = {record.title: _failed(record) for record in known}
    broken = [name for name, why in failing.items() if why]
    asked = max((len(record.summary.requirements) for record in known if record.summary), default=0)
    sentences = [_flew(flown)]
    if asked:
        met = {
            one.title: sum(each.verdict == "met" for each in one.summary.requirements) for one in known if one.summary
        }
        sentences += [f"{title} meets {count} of {asked} requirements." for title, count in met.items()]
    elif known:
        sentences.append("The mission states no requirement: what is below is measured, not judged.")
    if broken:
        word = "Fails" if len(broken) == len(known) else f"{len(broken)} of {len(known)} schemes fail"
        sentences += [f"{name} fails: {listed(why)}." for name, why in failing.items() if why]
        return Verdict("bad", word, sentences, looks)
    if not known:
        return Verdict("warn", "Not judged", [*sentences, "No summary was kept, so nothing can be judged."], looks)
    if asked:
        return Verdict("good", "Meets its requirements", sentences, looks)
    grave = any(look.gravity != "note" for look in looks)
    return Verdict("warn" if grave else "good", "Flown; look below" if grave else "Flown", sentences, looks)


def _met(record: Record) -> int:
    return sum(one.verdict == "met" for one in record.summary.requirements) if record.summary else 0


def _flew(flown: Flown) -> str:
    names = [record.title for record in flown.records]
    ends = [float(record.time[-1]) for record in flown.records if record.signals]
    span = f" for {max(ends):g} s" if ends else ""
    what = "One scheme flew" if len(names) == 1 else f"{len(names)} schemes flew"
    return f"{what}{span}: {listed(names)}."


def _failed(record: Record) -> list[str]:
    """Return why a flight fails: what it broke, and what it does not meet."""
    if record.summary is None:
        return []
    raised = {one.status for one in record.summary.statuses}
    why = [told for status, told in _BAD.items() if status in raised]
    return why + [f"{one.id} is not met" for one in record.summary.requirements if one.verdict != "met"]


def _looks(record: Record) -> list[Look]:
    """Return what to look at in one flight."""
    if record.summary is None:
        return []
    found = [
        Look("bad", f"{one.id} is not met: {one.text or one.asked}", ((record.title, f"margin {one.robustness:.4g}"),))
        if isinstance(one.robustness, float)
        else Look("bad", f"{one.id} is not met: {one.text or one.asked}", ((record.title, ""),))
        for one in record.summary.requirements
        if one.verdict != "met"
    ]
    for one in record.summary.statuses:
        told = f"{one.samples} samples, first at {one.first_s:g} s"
        found.append(Look(gravity(one.status), one.meaning, ((record.title, told),), one.first_s))
    return found + [
        Look("warn", note.replace("_", " ")[:1].upper() + note.replace("_", " ")[1:], ((record.title, ""),))
        for note in record.summary.notes
    ]


def _joined(looks: list[Look]) -> list[Look]:
    """Return what several schemes share as one, the gravest first."""
    by_text: dict[tuple[Gravity, str], list[Look]] = {}
    for look in looks:
        by_text.setdefault((look.gravity, look.text), []).append(look)
    joined = [
        replace(
            same[0],
            whose=tuple(one for look in same for one in look.whose),
            at=min((look.at for look in same if look.at is not None), default=None),
        )
        for same in by_text.values()
    ]
    return sorted(joined, key=lambda look: ("bad", "warn", "note").index(look.gravity))


def listed(names: list[str]) -> str:
    """Return names as a sentence lists them; with semicolons where a name has a comma."""
    if any("," in name for name in names[1:]) or ("," in names[0] and len(names) > 1):
        return f"{'; '.join(names[:-1])}; and {names[-1]}"
    return " and ".join([*[", ".join(names[:-1])] * (len(names) > 1), names[-1]])
