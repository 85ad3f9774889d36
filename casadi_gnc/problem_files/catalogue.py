"""What there is: laws and crafts with their gains and keys, and which law fits which craft, or why it does not."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, get_args, get_origin

from casadi_gnc.errors import GncError, ProblemError
from casadi_gnc.laws import REGISTRY as LAWS
from casadi_gnc.laws import Law, gains_of
from casadi_gnc.missions import fitting
from casadi_gnc.missions.craft import REGISTRY as CRAFTS
from casadi_gnc.missions.craft import Craft
from casadi_gnc.missions.parts import Parts
from casadi_gnc.problem_files.document import Document, read_kind
from casadi_gnc.problem_files.loading import craft_of, load
from casadi_gnc.signals import Layout
from casadi_gnc.tables.part import Part, own_tables


@dataclass(frozen=True, eq=False)
class Sample:
    """Hold one craft of a class, for what only an object can say."""

    measured: Layout
    read: Layout  # by laws: the measured signals, or those of a navigation
    effort: Layout
    belief: Any
    further: tuple[str, ...] = ()  # examples of the craft with other parts


@dataclass(frozen=True, eq=False)
class Named:
    """Hold a class by the name that a file uses, and the sentence about it."""

    name: str
    kind: Any

    @property
    def about(self) -> str:
        """First sentence of the docstring."""
        return " ".join((self.kind.__doc__ or "").strip().split("\n\n")[0].split())


def laws(problem: str | Path | None = None) -> list[Named]:
    """Return the laws that there are, and those that a mission file names beside them."""
    found = [Named(name, LAWS.find(name)) for name in LAWS.names()]
    if problem is None:
        return found
    document = read_kind(problem, "mission")
    schemes = document.at("scheme")
    for table in schemes if isinstance(schemes, list) else []:
        law = table.get("law") if isinstance(table, dict) else None
        name = law.get("type") if isinstance(law, dict) else None
        if isinstance(name, str) and name not in [one.name for one in found]:
            try:
                found.append(Named(name, LAWS.find(name, document.folder)))
            except GncError as error:
                raise ProblemError(str(error), document.path.name) from error
    return found


def crafts(problem: str | Path | None = None) -> list[Named]:
    """Return the crafts that there are, and the one that a mission file names."""
    found = [Named(name, CRAFTS.find(name)) for name in CRAFTS.names()]
    if problem is not None:
        document = read_kind(problem, "mission")
        name = document.at("spacecraft", "model")
        if name not in [one.name for one in found]:
            found.append(Named(str(name), craft_of(document)))
    return found


def sample_of(craft: Named, problem: str | Path | None = None) -> Sample | None:
    """Return what one craft of a class measures, makes and believes: that of its example, or of a mission file.

    None where a craft can be made of nothing that is known.
    """
    kind: type[Craft] = craft.kind if isinstance(craft.kind, type) else type(craft.kind)
    try:
        if kind.example is not None:
            return replace(_of_example(kind.example), further=kind.further_examples)
        if problem is not None and _names(read_kind(problem, "mission"), craft.name):
            mission = load(problem, strict=False)
            return _sample(mission.parts_asked, mission.schemes[0].actuation.effort)
        made = kind()
        return _sample(Parts(made), made.actuation().effort)
    except GncError:
        return None


@lru_cache(maxsize=16)
def _of_example(name: str) -> Sample:
    mission = load(name, strict=False)
    return _sample(mission.parts_asked, mission.schemes[0].actuation.effort)


def _sample(parts: Parts, effort: Layout) -> Sample:
    return Sample(parts.plant.measurement, parts.readable, effort, parts.belief)


def _names(document: Document, craft: str) -> bool:
    return document.at("spacecraft", "model") == craft


def fits(law: Named, sample: Sample | None) -> list[str] | None:
    """Return why a law does not fit a craft as in its example, nothing where it fits, there or as in a further one.

    None where nobody can say.
    """
    if sample is None:
        return None
    why = list(fitting.misfits(law.kind, sample.read, sample.belief, sample.effort))
    return [] if why and fits_as(law, sample) else why


def fits_as(law: Named, sample: Sample | None) -> str:
    """Return the further example of a craft in which a law fits that does not fit the first; else nothing."""
    if sample is None or not any(fitting.misfits(law.kind, sample.read, sample.belief, sample.effort)):
        return ""
    for name in sample.further:
        other = _of_example(name)
        if not any(fitting.misfits(law.kind, other.read, other.belief, other.effort)):
            return name
    return ""


def gains(law: type[Law]) -> Iterator[dict[str, Any]]:
    """Yield name, symbol, unit, size, default and meaning of each gain and option of a law."""
    for name, declared in gains_of(law).items():
        about = declared.metadata
        least, above = about.get("minimum"), about.get("above")
        yield {
            "name": name,
            "symbol": about["symbol"],
            "unit": about["unit"],
            "size": about.get("size", 1),
            "range": f"> {above:g}" if above is not None else f">= {least:g}" if least is not None else "",
            "choices": list(about.get("choices", ())),
            "default": None if declared.default is dataclasses.MISSING else declared.default,
            "required": declared.default is dataclasses.MISSING,
            "meaning": about["note"],
        }


def keys(craft: type[Craft]) -> Iterator[dict[str, Any]]:
    """Yield the keys of [spacecraft], of the craft's own tables, and what it adds to a [[scheme]]."""
    own = own_tables(craft)
    for name, field in craft.model_fields.items():
        if name not in own:
            yield _key("[spacecraft]", name, field)
            continue
        tables = list(_tables(name, field.annotation))
        if not tables:
            yield _key(f"[{name}]", name, field)
        for where, kind in tables:
            yield from (_key(where, key, inner) for key, inner in kind.model_fields.items() if key != _TAG)
    for name, field in craft.scheme_keys.model_fields.items():
        yield _key("[[scheme]]", name, field)


#: The key by which tables of one name are told apart.
_TAG = "kind"


def _tables(name: str, annotation: Any, several: bool = False) -> Iterator[tuple[str, type[Part]]]:
    """Yield the tables that a field of a craft stands for, and how each is written."""
    if isinstance(annotation, type) and issubclass(annotation, Part):
        where = f"[[{name}]]" if several else f"[{name}]"
        tag = annotation.model_fields.get(_TAG)
        words = get_args(tag.annotation) if tag is not None else ()
        yield where + (f' {_TAG} = "{words[0]}"' if words else ""), annotation
        return
    for inner in get_args(annotation):
        yield from _tables(name, inner, several or get_origin(annotation) is list)


def _key(where: str, name: str, field: Any) -> dict[str, Any]:
    meaning = field.description or _about(field.annotation)
    return {"table": where, "name": name, "required": field.is_required(), "meaning": meaning}


def _about(annotation: Any) -> str:
    """Return the first sentence about the table that a key holds, nothing where it holds numbers."""
    for kind in (annotation, *get_args(annotation)):
        if isinstance(kind, type) and issubclass(kind, Part):
            return " ".join((kind.__doc__ or "").strip().split("\n\n")[0].split())
    return ""


def law_data(law: Named, samples: dict[str, Sample | None]) -> dict[str, Any]:
    """Return all that is known of a law, as plain data."""
    kind: type[Law] = law.kind
    effort = kind.effort
    found = {name: fits(law, sample) for name, sample in samples.items()}
    return {
        "name": law.name,
        "class": f"{kind.__module__}.{kind.__qualname__}",
        "about": law.about,
        "reads": _reads(kind, samples),
        "commands": None if effort is None else list(effort.names),
        "models": getattr(kind.belief_kind(), "__name__", None),
        "funnels": dict(kind.funnels),
        "errata": dict(kind.errata),
        "gains": list(gains(kind)),
        "fits": [name for name, why in found.items() if why == []],
        "fits_as": {name: as_in for name, sample in samples.items() if (as_in := fits_as(law, sample))},
        "does_not_fit": {name: why for name, why in found.items() if why},
        "unknown": [name for name, why in found.items() if why is None],
    }


def _reads(kind: type[Law], samples: dict[str, Sample | None]) -> list[str]:
    """Return the names of the signals that a law reads; those of the first craft that it models, where they differ."""
    if isinstance(kind.inputs, Layout):
        return list(kind.inputs.names)
    belief = kind.belief_kind()
    fitting_one = next((s.belief for s in samples.values() if s is not None and isinstance(s.belief, belief)), None)
    return [] if fitting_one is None else list(kind.reads(fitting_one).names)


def craft_data(craft: Named, sample: Sample | None, fitting_laws: list[str]) -> dict[str, Any]:
    """Return all that is known of a craft, as plain data."""
    kind: type[Craft] = craft.kind
    return {
        "name": craft.name,
        "class": f"{kind.__module__}.{kind.__qualname__}",
        "about": craft.about,
        "example": kind.example,
        "measures": None if sample is None else _columns(sample.measured),
        "makes": None if sample is None else _columns(sample.effort),
        "believes": None if sample is None or sample.belief is None else type(sample.belief).__name__,
        "laws": fitting_laws,
        "keys": list(keys(kind)),
    }


def _columns(layout: Layout) -> list[dict[str, Any]]:
    return [{"name": s.name, "size": s.size, "unit": s.unit, "frame": s.frame} for s in layout.signals]
