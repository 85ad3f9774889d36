"""Generate C from whatever can become C: the controller of a mission, a function, an allocator."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.delivery import packaging
from casadi_gnc.delivery.allocators import generate_allocator
from casadi_gnc.delivery.functions import generate_function
from casadi_gnc.errors import PackageError
from casadi_gnc.missions.fault_handling import FaultHandling
from casadi_gnc.missions.mission import Mission
from casadi_gnc.problem_files.document import read

#: Ending of files that CasADi's `Function.save` writes.
ENDING = ".casadi"


def generate(
    thing: str | Path | Mission | ca.Function,
    out: str | Path,
    *,
    name: str | None = None,
    real: str = "float64",
    target: Sequence[Any] = (),
    at_most_instructions: int | None = None,
    steps: int | None = None,
    force: bool = False,
    scheme: str | None = None,
    tunable: Sequence[str] = (),
    state: Mapping[str, str] | None = None,
    ports: Mapping[str, Any] | None = None,
    rate: float | None = None,
    fault_handling: FaultHandling | None = None,
    vectors: str | Path | np.ndarray | None = None,
    commands: str | Path | None = None,
    frame: str = "",
) -> dict[str, Any]:
    """Write a flight package; return what was made of what.

    Parameters
    ----------
    thing : a mission, a mission file or the name of a shipped one; a CasADi function, or a .casadi file; an allocation
        file or the name of a shipped one.
    out : folder of the package.
    name : prefix of every symbol; the mission's or the function's name by default.
    real : "float64" or "float32".
    target : targets to measure for the README.
    at_most_instructions : what a step may take on every one of these targets by its proved bound; anything if left out.
    steps : samples that are shipped as test vectors; 1024 by default.
    force : overwrite a package that was edited.
    scheme, tunable : of a mission, as for `casadi_gnc.delivery.packaging.generate`.
    state, ports, rate, fault_handling, vectors : of a function, as for
        `casadi_gnc.delivery.functions.generate_function`.
    frame : "basilisk", "ros2", "freertos", "timer", "simulink" or "xtce": files beside the package that put it there.
    commands : of an allocation file, as for `casadi_gnc.delivery.allocators.generate_allocator`.

    Raises
    ------
    GncError
        Where something given is not right, or no bound of a step is so small; the folder is left as it was.
    """
    common: dict[str, Any] = {"name": name, "real": real, "target": target, "force": force, "frame": frame}
    common["at_most_instructions"] = at_most_instructions
    of_missions = {"scheme": scheme, "tunable": tunable}
    of_functions: dict[str, Any] = {"state": state, "ports": ports, "rate": rate, "vectors": vectors}
    of_functions["fault_handling"] = fault_handling
    if isinstance(thing, ca.Function) or (not isinstance(thing, Mission) and Path(thing).suffix == ENDING):
        _refuse({**of_missions, "commands": commands}, "a function")
        return generate_function(thing, out, **common, **of_functions, steps=steps)
    if isinstance(thing, (str, Path)) and read(thing).data.get("kind") == "allocation":
        _refuse({**of_missions, **of_functions, "steps": steps}, "an allocation file")
        return generate_allocator(thing, out, **common, commands=commands)
    _refuse({**of_functions, "commands": commands}, "a mission")
    steps = packaging.STEPS if steps is None else steps
    return packaging.generate(thing, out, **common, scheme=scheme, tunable=tunable, steps=steps)


def _refuse(options: dict[str, Any], what: str) -> None:
    """Raise `PackageError` for the first of some options that was given."""
    for name, value in options.items():
        if value is not None and not (isinstance(value, Sequence) and not value):
            raise PackageError(f"{name} is not for {what}; leave it out")
