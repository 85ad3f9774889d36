"""Write the pages of docs/catalogue from the code: laws, crafts, statuses, and what can be named where.

Sphinx calls `write` before it reads the pages, so no table of them can be out of date.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from casadi_gnc.allocation.answer import AllocationStatus
from casadi_gnc.allocation.backends import REGISTRY as BACK_ENDS
from casadi_gnc.laws import REGISTRY as LAWS
from casadi_gnc.missions.checks import REGISTRY as FAMILIES
from casadi_gnc.missions.craft import REGISTRY as CRAFTS
from casadi_gnc.missions.engines import REGISTRY as ENGINES
from casadi_gnc.problem_files import catalogue
from casadi_gnc.problem_files.synthesis_recipes import REGISTRY as RECIPES
from casadi_gnc.status import StepStatus
from casadi_gnc.synthesis.backends import REGISTRY as LMI_BACK_ENDS

KINDS = (
    ("laws", "`law.type` of a `[[scheme]]`", LAWS),
    ("crafts", "`model` of `[spacecraft]`", CRAFTS),
    ("families of checks", "`checks`", FAMILIES),
    ("engines of a flight", "`fly --engine`", ENGINES),
    ("allocation back ends", "`allocation.backend`, `--backend`", BACK_ENDS),
    ("recipes of gains", "`type` of a synthesis", RECIPES),
    ("back ends of matrix inequalities", "`synthesize --backend`", LMI_BACK_ENDS),
)


def pages() -> dict[str, Mapping[str, Any]]:
    """Return what each page's template is given, by the name of the page."""
    known, crafts = catalogue.laws(), catalogue.crafts()
    samples = {craft.name: catalogue.sample_of(craft) for craft in crafts}
    fitting = {
        craft.name: [law.name for law in known if catalogue.fits(law, samples[craft.name]) == []] for craft in crafts
    }
    return {
        "laws": {
            "laws": [catalogue.law_data(law, samples) for law in known],
            "crafts": [craft.name for craft in crafts],
        },
        "crafts": {
            "crafts": [catalogue.craft_data(craft, samples[craft.name], fitting[craft.name]) for craft in crafts]
        },
        "statuses": {"steps": list(StepStatus), "allocations": list(AllocationStatus)},
        "names": {"kinds": KINDS},
    }


def write(folder: Path) -> None:
    """Write every page that is not yet as the code is; the others keep their dates, so that builds stay short."""
    templates = Environment(
        loader=FileSystemLoader(Path(__file__).parent / "catalogue_templates"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    folder.mkdir(exist_ok=True)
    for name, content in pages().items():
        text = templates.get_template(f"{name}.md.j2").render(content).lstrip()
        page = folder / f"{name}.md"
        if not page.exists() or page.read_text(encoding="utf-8") != text:
            page.write_text(text, encoding="utf-8")
