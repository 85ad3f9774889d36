"""Wrap a package as a functional mock-up unit: FMI 2.0 or 3.0 co-simulation, sources and a binary for this machine."""

from __future__ import annotations

import hashlib
import platform
import sys
import zipfile
from pathlib import Path
from typing import Any

from casadi_gnc.embedded.controller import Controller, Options
from casadi_gnc.embedded.host import FLAGS
from casadi_gnc.embedded.members import access
from casadi_gnc.embedded.package import flight_files, put
from casadi_gnc.embedded.source import access_tunable
from casadi_gnc.errors import PackageError
from casadi_gnc.signals import Layout
from casadi_gnc.system import compilers
from casadi_gnc.system.templates import template

#: A date for every file of the archive: the same unit has the same bytes on another day.
_DATE = (1980, 1, 1, 0, 0, 0)


def fmu_files(controller: Controller, options: Options, version: str, stop: float, fmi: int = 2) -> dict[str, str]:
    """Return `modelDescription.xml` and the sources: path in the archive -> text; `fmi` is 2 or 3."""
    package = flight_files(controller, options)
    sources = {path: text for path, text in package.items() if path.endswith((".c", ".h"))}
    guid = hashlib.sha256("".join(sources.values()).encode()).hexdigest()[:32]
    parameters = [place for one in controller.tunables for place in access_tunable(one, "")]
    wrapper = template("fmu.c.j2" if fmi == 2 else "fmi3.c.j2").render(
        fmi=f"fmi{fmi}",
        name=options.name,
        title=controller.title,
        guid=guid,
        period=f"{controller.period:g}",
        period_double=Options(options.name).constant(controller.period),
        inputs=access(controller.measured, "input."),
        outputs=access(controller.outputs, "output."),
        parameters=parameters,
    )  # fmt: skip
    units = ["fmu.c", *(path for path in sources if path.endswith(".c"))]
    xml = template("fmu.xml.j2" if fmi == 2 else "fmi3.xml.j2").render(
        name=options.name,
        title=controller.title,
        description=f"scheme {controller.scheme}{', ' + controller.source if controller.source else ''}",
        guid=guid,
        version=version,
        period=repr(controller.period),
        stop=repr(stop),
        sources=units,
        variables=_variables(controller),
        units=sorted({one["unit"] for one in _variables(controller) if one["unit"]}),
    )
    files = {f"sources/{path}": text for path, text in {"fmu.c": wrapper, **sources}.items()}
    if fmi == 3:
        build = template("fmi3_build.xml.j2").render(name=options.name, sources=units)
        files["sources/buildDescription.xml"] = build
    return {"modelDescription.xml": xml, **files, "documentation/LICENSE": package["LICENSE"]}


def _variables(controller: Controller) -> list[dict[str, Any]]:
    """Return the scalar variables in the order of their value references."""
    rows = _elements(controller.measured, "input", "discrete", "measured")
    bounds = [*zip(controller.lower, controller.upper, strict=True)]
    outputs = _elements(controller.outputs, "output", "discrete", "held from sample to sample; 0 before the first")
    for row, (low, high) in zip(outputs, bounds, strict=False):  # the actuators come first
        row |= {"low": min(repr(low), repr(0.0), key=float), "high": max(repr(high), repr(0.0), key=float)}
    rows += outputs
    rows.append(_variable("status", "output", "discrete", "bits of the status; 0: nothing unusual", "", "Integer", "0"))
    for one in controller.tunables:
        layout_names = (
            [one.name] if len(one.default) == 1 else [f"{one.name}[{i + 1}]" for i in range(len(one.default))]
        )
        for name, value in zip(layout_names, one.default, strict=True):
            rows.append(_variable(name, "parameter", "tunable", one.note, one.unit, "Real", repr(value)))
    names = [row["name"] for row in rows]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise PackageError(
            f"the unit would have two variables {twice[0]!r}, as input, output or parameter; rename one of the signals"
        )
    for i, row in enumerate(rows, 1):
        row["index"] = i
    return rows


def _elements(layout: Layout, causality: str, variability: str, note: str) -> list[dict[str, Any]]:
    rows = []
    for signal in layout.signals:
        names = [signal.name] if signal.size == 1 else [f"{signal.name}[{i + 1}]" for i in range(signal.size)]
        about = f"{note}, {signal.frame} frame" if signal.frame else note
        rows += [_variable(name, causality, variability, about, signal.unit, "Real", "0") for name in names]
    return rows


def _variable(
    name: str, causality: str, variability: str, note: str, unit: str, kind: str, start: str
) -> dict[str, Any]:
    return {
        "name": name,
        "causality": causality,
        "variability": variability,
        "initial": {"input": "", "output": "calculated"}.get(causality, "exact"),
        "description": note,
        "unit": "" if unit == "-" else unit,
        "type": kind,
        "start": None if causality == "output" else start,
        "low": None,
        "high": None,
    }


def platform_folder(fmi: int = 2) -> str:
    """Return the folder that FMI names for binaries of this machine; raise `PackageError` if it names none."""
    system = {"linux": "linux", "darwin": "darwin", "win32": "win"}.get(sys.platform)
    processor = {"x86_64": "x86_64", "amd64": "x86_64", "arm64": "aarch64", "aarch64": "aarch64"}.get(
        platform.machine().lower()
    )
    if system is None or sys.maxsize <= 2**32 or processor is None:
        raise PackageError(f"FMI {fmi}.0 names no folder for binaries of {platform.platform()}")
    return f"{system}64" if fmi == 2 else f"{processor}-{'windows' if system == 'win' else system}"


def pack(files: dict[str, str], options: Options, workshop: Path, target: Path, fmi: int = 2) -> None:
    """Compile the sources and write the archive.

    Raises
    ------
    NoCompilerError, CompilerError
        Where there is no compiler, or it refuses the sources.
    """
    put(workshop, files)
    compiler, folder = compilers.find(), platform_folder(fmi)
    library = workshop / "binaries" / folder / f"{options.name}{'.dll' if sys.platform == 'win32' else '.so'}"
    library.parent.mkdir(parents=True)
    sources = [str(path) for path in sorted((workshop / "sources").glob("*.c"))]
    include = f"-I{workshop / 'sources'}"
    words = [*FLAGS, "-O2", "-fPIC", "-shared", "-fvisibility=hidden", include, "-o", str(library), *sources, "-lm"]
    compilers.compile_in(workshop, compiler, words, "the unit")
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in sorted(path for path in workshop.rglob("*") if path.is_file()):
            entry = zipfile.ZipInfo(path.relative_to(workshop).as_posix(), _DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, path.read_bytes())
