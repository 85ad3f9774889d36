"""A page that is one file: its styles, scripts and numbers are in it, and its policy forbids all else.

Scripts and styles are allowed by their hashes, so that nothing that a file smuggled in could run even if a text were
not escaped. Libraries are built files, see `codegen/report/vendor/README.md`.
"""

from __future__ import annotations

import base64
import hashlib
import json
import re
from collections.abc import Sequence
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from markupsafe import Markup

from casadi_gnc.reports.endings import check_page
from casadi_gnc.reports.packed import Packed
from casadi_gnc.system import assets
from casadi_gnc.system.files import prepare_folder, write_beside
from casadi_gnc.system.templates import template
from casadi_gnc.system.text import json_in_html


def render(
    name: str, context: dict[str, Any], data: Any = None, packed: Packed | None = None, scripts: Sequence[str] = ()
) -> str:
    """Return a page.

    Parameters
    ----------
    name : of the template.
    context : what the template asks for; texts in it may be anything.
    data, packed : for the scripts.
    scripts : files of `codegen/report`, in their order; none for a page that only tells.
    """
    code = [_file(one) for one in scripts]
    styles = [_file("vendor/uplot.min.css"), _file("page.css")] if scripts else [_file("page.css")]
    return template(name).render(
        **context,
        policy=Markup(policy(code, styles)),
        styles=[Markup(each) for each in styles],
        scripts=[Markup(each) for each in code],
        notices=[_notice(one) for one in scripts if one.startswith("vendor/")],
        in_space=any("three" in one for one in scripts),
        counts=Markup(json.dumps([] if packed is None else packed.counts, separators=(",", ":"))),
        columns=Markup("" if packed is None else packed.letters()),
        data=Markup(json_in_html(data)),
        version=metadata.version("casadi-gnc"),
    )


def policy(scripts: Sequence[str], styles: Sequence[str]) -> str:
    """Return the content-security policy of a page with these scripts and styles, and nothing else."""
    allowed = {"script-src": scripts, "style-src": styles}
    told = ["default-src 'none'", "img-src data:", "base-uri 'none'", "form-action 'none'"]
    for key, texts in allowed.items():
        hashes = [base64.b64encode(hashlib.sha256(each.encode()).digest()).decode() for each in texts]
        told.append(" ".join([key, *(f"'sha256-{each}'" for each in hashes)] if hashes else [key, "'none'"]))
    return "; ".join(told)


@cache
def _file(name: str) -> str:
    return (assets.folder("codegen") / "report" / name).read_text(encoding="utf-8").replace("\r\n", "\n")


def _notice(script: str) -> str:
    """Return the line of copyright of a library."""
    name = Path(script).name.split(".")[0]
    found = re.search(r"Copyright .*", _file(f"vendor/LICENSE.{name}"))
    return f"{name}, {found[0].strip()}" if found else name


def write(target: Path, page: str) -> Path:
    """Write a page, whole or not at all, and return its path; raise `ReportError` where it is to be no page."""
    check_page(target)
    prepare_folder(target.parent)
    write_beside(target, lambda place: place.write_text(page, encoding="utf-8"))
    return target
