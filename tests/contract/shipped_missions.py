"""The shipped missions, one scheme for each law that they fly: what the contract tests run over."""

from functools import cache

import pytest

import casadi_gnc
from casadi_gnc.laws import REGISTRY, Law
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.scheme import Scheme
from casadi_gnc.problem_files.document import read, shipped


@cache
def missions() -> dict[str, Mission]:
    """Return all shipped missions by name, loaded once."""
    return {name: casadi_gnc.load(name, strict=False) for name in shipped() if read(name).data["kind"] == "mission"}


def parametrized(cases: list[tuple[str, ...]]) -> list:
    """Return cases that begin with the name of a mission; all are slow but those of one mission of each paper."""
    names = sorted((name for name in missions() if "as_printed" not in name), reverse=True)
    fast = set({name.split("/")[0]: name for name in names}.values())
    return [pytest.param(*case, marks=[] if case[0] in fast else pytest.mark.slow) for case in cases]


@cache
def flown_by() -> dict[str, tuple[Mission, Scheme]]:
    """Return for each law, by its name in files, a mission and the first scheme that flies it uncorrected by errata."""
    found: dict[str, tuple[Mission, Scheme]] = {}
    for mission in missions().values():
        for scheme in mission.schemes:
            name = name_of(scheme.law)
            if name not in found or (found[name][1].law.printed and not scheme.law.printed):
                found[name] = (mission, scheme)
    return found


def name_of(law: Law) -> str:
    return REGISTRY.name_of(type(law))
