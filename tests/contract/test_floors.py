"""The house: imports go downward only, and public names are documented."""

import ast
import importlib
import inspect
import pkgutil
import subprocess
import sys
from pathlib import Path

import pytest

import casadi_gnc

ROOT = Path(casadi_gnc.__file__).parent
#: Single modules at the top are the language of the house; every room stands on those with smaller numbers.
FLOORS = {
    **{path.stem: 0 for path in ROOT.glob("*.py") if path.stem not in ("__init__", "testing")},
    "mathematics": 1,
    "system": 1,
    "mechanics": 2,
    "laws": 3,
    "allocation": 3,
    "synthesis": 3,
    "embedded": 4,
    "tables": 4,
    "missions": 5,
    "checking": 6,
    "vehicles": 7,
    "problem_files": 8,
    "reports": 9,
    "delivery": 9,
    "benchmarks": 10,
    "fidelity": 10,
    "starters": 10,
    "testing": 10,
    "cli": 11,
}
MODULES = sorted(ROOT.rglob("*.py"))


def room(path: Path) -> str:
    return path.relative_to(ROOT).parts[0].removesuffix(".py")


def imported_rooms(path: Path) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("casadi_gnc"):
            parts = node.module.split(".")
            found.update([parts[1]] if len(parts) > 1 else [alias.name for alias in node.names])
        elif isinstance(node, ast.Import):
            found.update(alias.name.split(".")[1] for alias in node.names if alias.name.startswith("casadi_gnc."))
    return found


@pytest.mark.parametrize("path", MODULES, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_imports_go_down(path):
    if path.parent == ROOT and path.name == "__init__.py":
        return  # the front door opens rooms lazily
    own = room(path)
    for other in imported_rooms(path):
        assert other in FLOORS, f"{other} has no floor"
        # Rooms of one floor above the ground do not import each other.
        assert other == own or FLOORS[other] < FLOORS[own] or FLOORS[own] == 0 == FLOORS[other], (
            f"{own} imports {other}"
        )


@pytest.mark.parametrize("path", MODULES, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_files_stay_one_idea_long(path):
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 400


@pytest.mark.parametrize("folder", sorted(path.parent for path in ROOT.rglob("__init__.py")), ids=lambda p: p.name)
def test_every_room_has_a_public_face(folder):
    name = ".".join(["casadi_gnc", *folder.relative_to(ROOT).parts])
    face = importlib.import_module(name)
    assert face.__doc__
    for each in face.__all__:
        assert getattr(face, each) is not None, f"{name}.{each}"


def test_the_front_door_leads_somewhere():
    for name in casadi_gnc.__all__:
        assert getattr(casadi_gnc, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'flyy'"):
        casadi_gnc.flyy  # noqa: B018


def test_package_imports_lazily():
    """Neither the package nor the command line's help loads what takes long to load."""
    script = (
        "import sys, casadi_gnc, casadi_gnc.cli.main; "
        "heavy = ('casadi', 'numpy', 'scipy', 'matplotlib', 'qpsolvers', 'clarabel', 'pydantic'); "
        "print([name for name in heavy if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_every_public_name_is_documented():
    for module in pkgutil.walk_packages([str(ROOT)], "casadi_gnc."):
        loaded = importlib.import_module(module.name)
        assert loaded.__doc__ or not loaded.__file__, module.name
        for name, thing in vars(loaded).items():
            if inspect.isfunction(thing) and thing.__module__ == module.name and not name.startswith("_"):
                assert thing.__doc__, f"{module.name}.{name}"
