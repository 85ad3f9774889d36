"""Settings of the documentation."""

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

project = "casadi-gnc"
author = "The casadi-gnc developers"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.mathjax"]
html_theme = "furo"
myst_heading_anchors = 2
myst_enable_extensions = ["dollarmath", "colon_fence"]
exclude_patterns = ["_build"]
autodoc_member_order = "bysource"


def setup(app):
    """Write the catalogues from the code before any page is read."""
    import catalogue_pages

    app.connect("builder-inited", lambda _: catalogue_pages.write(HERE / "catalogue"))
