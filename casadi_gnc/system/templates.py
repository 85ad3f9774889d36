"""The templates of `codegen/`, each with the writers of `casadi_gnc.system.text` for its language.

In XML and HTML every value is written as text of that language. In all others a value is put in as it is (most are C
that was printed here), and a text from a file goes through a filter: `{{ title | c_comment }}`.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import jinja2
from markupsafe import Markup

from casadi_gnc.system import assets, text

_FILTERS = (text.c_comment, text.c_string, text.line, text.markdown, text.markdown_code, text.make, text.cmake)


def _as_markup(value: Any) -> Any:
    """Return a value as markup in which texts mean nothing but themselves."""
    return Markup(text.xml(value)) if isinstance(value, str) and not isinstance(value, Markup) else value


@cache
def environment(markup: bool = False) -> jinja2.Environment:
    """Return the templates; `markup` for those that are XML or HTML."""
    codegen = assets.folder("codegen")
    made = jinja2.Environment(
        loader=jinja2.FileSystemLoader([codegen / "templates", codegen / "frames", codegen / "report"]),
        undefined=jinja2.StrictUndefined,
        keep_trailing_newline=True,
        autoescape=markup,
        finalize=_as_markup if markup else None,
    )
    made.filters.update({writer.__name__: writer for writer in _FILTERS})
    return made


def template(name: str) -> jinja2.Template:
    """Return a template by its file's name."""
    return environment(name.endswith((".xml.j2", ".html.j2"))).get_template(name)
