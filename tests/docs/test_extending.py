"""docs/extending.md: every recipe as it stands there, by file, by package and by object."""

import tomllib

import pytest
from running_pages import ROOT, run, sections

PAGE = "extending.md"
SECTIONS = [
    pytest.param(section.title, marks=[pytest.mark.tools(*section.tools)] if section.tools else [])
    for section in sections(PAGE)
]


def installed(folder):
    """Write what an installer would of the page's package; return the folder to find it in."""
    (project,) = [
        tomllib.loads(block.text)["project"]
        for section in sections(PAGE)
        for block in section.blocks
        if block.file.endswith("pyproject.toml")
    ]
    about = folder / "lab" / f"{project['name']}-{project['version']}.dist-info"
    about.mkdir(parents=True)
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n")
    groups = project["entry-points"].items()
    lines = [line for group, points in groups for line in (f"[{group}]", *(f"{k} = {v}" for k, v in points.items()))]
    (about / "entry_points.txt").write_text("\n".join(lines) + "\n")
    return about.parent


@pytest.mark.slow  # first_law is the page that the fast tests run
@pytest.mark.parametrize("section", SECTIONS)
def test_section(section, tmp_path):
    packages = {"PYTHONPATH": str(installed(tmp_path))} if section == "As a package" else {}
    run(PAGE, section, tmp_path, **packages)


def test_every_kind_has_a_registry_of_its_own():
    """The groups of the table are those that the library asks for."""
    from casadi_gnc.allocation import backends
    from casadi_gnc.embedded import boards as targets
    from casadi_gnc.laws import REGISTRY as LAWS
    from casadi_gnc.missions import checks, craft, engines
    from casadi_gnc.problem_files import synthesis_recipes
    from casadi_gnc.synthesis import backends as lmi_backends

    homes = (backends, targets, checks, craft, engines, synthesis_recipes, lmi_backends)
    groups = {LAWS.group, *(home.REGISTRY.group for home in homes)}
    page = (ROOT / "docs" / PAGE).read_text(encoding="utf-8")
    assert all(f"`{group}`" in page and f'entry-points."{group}"]' in page for group in groups)
