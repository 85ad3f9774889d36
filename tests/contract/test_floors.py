"""The house: imports go downward only and in no circle, and public names are documented."""

import ast
import importlib
import inspect
import pkgutil
import re
import subprocess
import sys
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import casadi_gnc

ROOT = Path(casadi_gnc.__file__).parent
#: Single modules at the top are the language of the house; every room stands on those with smaller numbers.
FLOORS = {
    **{path.stem: 0 for path in ROOT.glob("*.py") if path.stem != "__init__"},
    "mathematics": 1,
    "system": 1,
    "mechanics": 2,
    "laws": 3,
    "navigation": 3,
    "allocation": 3,
    "synthesis": 3,
    "embedded": 4,
    "tables": 4,
    "missions": 5,
    "campaigns": 6,
    "checking": 6,
    "vehicles": 7,
    "problem_files": 8,
    "reports": 9,
    "delivery": 9,
    "tuning": 9,
    "benchmarks": 10,
    "fidelity": 10,
    "starters": 10,
    "testing": 10,
    "cli": 11,
}
MODULES = sorted(ROOT.rglob("*.py"))


def room(path: Path) -> str:
    return path.relative_to(ROOT).parts[0].removesuffix(".py")


def name_of(path: Path) -> str:
    parts = ["casadi_gnc", *path.relative_to(ROOT).with_suffix("").parts]
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


NAMES = {name_of(path): path for path in MODULES}


def imports(tree: ast.AST, package: str, *, typing: bool) -> Iterator[str]:
    """Yield what a module imports from the house, in functions too; what only types need where that is wanted."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.split(".")[0] == "casadi_gnc")
        elif isinstance(node, ast.ImportFrom):
            above = package.rsplit(".", node.level - 1)[0] if node.level else ""
            home = ".".join(filter(None, (above, node.module)))
            if home.split(".")[0] == "casadi_gnc":
                inner = (f"{home}.{alias.name}" for alias in node.names)
                yield from (name if name in NAMES else home for name in inner)
        elif isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING") and not typing:
            yield from imports(ast.Module(node.orelse, []), package, typing=typing)
        else:
            yield from imports(node, package, typing=typing)


def imported(path: Path, *, typing: bool) -> set[str]:
    package = name_of(path) if path.name == "__init__.py" else name_of(path).rpartition(".")[0]
    return set(imports(ast.parse(path.read_text(encoding="utf-8")), package, typing=typing))


def imported_rooms(path: Path) -> set[str]:
    return {name.split(".")[1] for name in imported(path, typing=True) if "." in name}


def test_every_room_has_a_floor_and_every_floor_is_of_a_room():
    rooms = {room(path) for path in MODULES if path.parent != ROOT}
    assert set(FLOORS) - {path.stem for path in ROOT.glob("*.py")} == rooms


def test_the_house_is_as_contributors_are_told():
    text = (ROOT.parent / "CONTRIBUTING.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (\d+) \| (.*) \|$", text, re.MULTILINE)
    assert {name: int(floor) for floor, names in rows for name in re.findall(r"`(\w+)/?`", names)} == FLOORS


def test_imports_are_seen_wherever_they_stand():
    text = """
from __future__ import annotations
import casadi_gnc.laws._law, casadi
from casadi_gnc import errors
from . import mission
if TYPE_CHECKING:
    from casadi_gnc.missions.scheme import Scheme
else:
    from ..tables.part import Part
def late():
    try:
        from casadi_gnc.laws import Law
    finally:
        from .loop import Loop
"""
    seen = ["laws._law", "errors", "missions.mission", "tables.part", "laws", "missions.loop"]
    tree, package = ast.parse(text), "casadi_gnc.missions"
    assert list(imports(tree, package, typing=False)) == [f"casadi_gnc.{name}" for name in seen]
    assert "casadi_gnc.missions.scheme" in imports(tree, package, typing=True)


def test_no_circle_between_files():
    """What runs is loaded in one order; imports for types alone may look back."""
    graph = {name: imported(path, typing=False) - {name} for name, path in NAMES.items()}
    assert not set().union(*graph.values()) - set(graph), "imports of modules that do not exist"
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail("a circle of imports: " + " <- ".join(error.args[1]))


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
