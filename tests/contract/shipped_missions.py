"""The shipped missions, one scheme for each law that they fly: what the contract tests run over."""

from functools import cache

import casadi_gnc
from casadi_gnc.laws import REGISTRY, Law
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.scheme import Scheme
from casadi_gnc.problem_files.document import read, shipped


@cache
def missions() -> dict[str, Mission]:
    """Return all shipped missions by name, loaded once."""
    return {name: casadi_gnc.load(name, strict=False) for name in shipped() if read(name).data["kind"] == "mission"}


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
