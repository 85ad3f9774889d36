"""`casadi-gnc doctor`: what is installed, what is missing, and what that costs."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from casadi_gnc.cli.manners import print_json

#: Packages of the core, then of extras: package, module to look for, extra, what it gives.
_CORE = ("casadi", "numpy", "scipy", "proxsuite", "qpsolvers", "matplotlib", "clarabel", "daqp", "pydantic", "typer")
_EXTRAS = (
    ("scs", "scs", "solvers", "a second conic solver"),
    ("piqp", "piqp", "solvers", "a QP solver for the non-robust allocation"),
    ("osqp", "osqp", "solvers", "a QP solver for the non-robust allocation"),
    ("highspy", "highspy", "solvers", "a QP solver for the non-robust allocation"),
    ("ziglang", "ziglang", "zig", "a C compiler from a wheel, for machines without one"),
)


def doctor(json: Annotated[bool, typer.Option("--json", help="Print as JSON.")] = False) -> None:
    """Print versions, compilers, solvers, the cache folder, what is missing and what that costs."""
    report = examine()
    if json:
        print_json(report)
        return
    typer.echo(f"casadi-gnc {report['casadi_gnc']}, Python {report['python']}, {report['platform']}")
    typer.echo("packages   " + ", ".join(f"{name} {version}" for name, version in report["packages"].items()))
    typer.echo("compilers  " + (", ".join(f"{c['command']} ({c['version']})" for c in report["compilers"]) or "none"))
    typer.echo("solvers    " + ", ".join(report["solvers"]))
    typer.echo("targets    " + ", ".join(f"{name} ({'ready' if not lacks else 'lacks ' + ' and '.join(lacks)})"
                                         for name, lacks in report["targets"].items()))  # fmt: skip
    typer.echo(f"cache      {report['cache']['folder']} ({report['cache']['libraries']} compiled libraries)")
    for missing in report["missing"]:
        typer.echo(f"missing    {missing['what']}: {missing['cost']}")
    if not report["missing"]:
        typer.echo("missing    nothing")


def _names_in_the_way() -> list[str]:
    """Return a sentence for each name that an installed package offers in vain."""
    from casadi_gnc import laws
    from casadi_gnc.allocation import backends
    from casadi_gnc.embedded import boards
    from casadi_gnc.missions import checks, craft, engines
    from casadi_gnc.problem_files import synthesis_recipes
    from casadi_gnc.synthesis import backends as lmi_backends

    registries = [laws.REGISTRY, craft.REGISTRY, checks.REGISTRY, engines.REGISTRY, boards.REGISTRY]
    registries += [backends.REGISTRY, lmi_backends.REGISTRY, synthesis_recipes.REGISTRY]
    return [sentence for each in registries for sentence in each.problems()]


def examine() -> dict[str, Any]:
    """Return what the doctor finds, as plain data."""
    import platform
    from importlib import metadata, util

    from casadi_gnc.allocation import backends
    from casadi_gnc.embedded import boards
    from casadi_gnc.system import compilers

    packages, missing = {}, []
    for name in _CORE:
        try:
            packages[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            missing.append({"what": name, "cost": f"a required package; pip install {name}"})
    for name, module, extra, gives in _EXTRAS:
        if util.find_spec(module) is None:
            missing.append({"what": name, "cost": f'without it you lack {gives}; pip install "casadi-gnc[{extra}]"'})
        else:
            packages[name] = metadata.version(name)
    found = compilers.available()
    if not found:
        missing.append(
            {"what": "C compiler", "cost": "flights run on CasADi's virtual machine, some hundred times slower"}
        )
    missing += [{"what": "a name", "cost": sentence} for sentence in _names_in_the_way()]
    folder = compilers.cache_folder()
    libraries = len(list(folder.glob("*.so")) + list(folder.glob("*.dll"))) if folder.is_dir() else 0
    return {
        "casadi_gnc": metadata.version("casadi-gnc"),
        "python": platform.python_version(),
        "platform": platform.platform(),
        "packages": packages,
        "compilers": [{"command": " ".join(c.command), "version": c.version} for c in found],
        "solvers": backends.available(),
        "targets": {name: boards.find(name).missing() for name in boards.names()},
        "cache": {"folder": str(folder), "libraries": libraries},
        "missing": missing,
    }
