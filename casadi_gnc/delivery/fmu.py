"""Generate a functional mock-up unit (FMI 2.0 or 3.0, co-simulation) of a mission's controller."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import metadata
from pathlib import Path

from casadi_gnc.delivery.packaging import REALS, packed
from casadi_gnc.embedded import fmu
from casadi_gnc.embedded.controller import Options
from casadi_gnc.errors import OutputError, PackageError
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.onboard import sampled
from casadi_gnc.problem_files.by_name import mission_of
from casadi_gnc.system.files import prepare_folder, write_beside
from casadi_gnc.system.folders import workshop


def generate_fmu(
    problem: str | Path | Mission,
    out: str | Path | None = None,
    *,
    scheme: str | None = None,
    name: str | None = None,
    real: str = "float64",
    tunable: Sequence[str] = (),
    fmi: int = 2,
) -> Path:
    """Write the controller of a scheme as an .fmu; return its path.

    Parameters
    ----------
    problem : a mission, a mission file, or the name of a shipped one.
    out : the file; flight/<name>.fmu by default. An existing unit is replaced, another file is not.
    scheme, name, real, tunable : as for `casadi_gnc.delivery.packaging.generate`; tunable gains become parameters.
    fmi : version of the standard, 2 or 3.

    Raises
    ------
    GncError
        Where something given is not right; nothing is written then.
    """
    mission = sampled(mission_of(problem))
    if real not in REALS:
        raise PackageError(f"real is {real!r}, expected float64 or float32")
    if fmi not in (2, 3):
        raise PackageError(f"fmi is {fmi!r}, expected 2 or 3")
    options = Options(mission.name if name is None else name, REALS[real])  # type: ignore[arg-type]
    target = Path("flight") / f"{options.name}.fmu" if out is None else Path(out)
    if target.suffix != ".fmu" or target.is_dir():
        raise OutputError(f"{target} does not end in .fmu; name the file to write with --out")
    controller = packed(mission, scheme, tunable, monitored=False)
    files = fmu.fmu_files(controller, options, metadata.version("casadi-gnc"), mission.timing.duration, fmi)
    prepare_folder(target.parent)
    with workshop() as shop:
        write_beside(target, lambda place: fmu.pack(files, options, shop, place, fmi))
    return target
