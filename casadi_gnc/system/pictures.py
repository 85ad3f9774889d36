"""How all our pictures look: colours, letters, frames, and how a picture gets into its file."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import Any

from casadi_gnc.errors import ProblemError
from casadi_gnc.system.files import write_beside
from casadi_gnc.system.text import picture

#: Okabe and Ito's colours, told apart with every kind of colour vision.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
#: Of a picture, and of a column where a page has two: there letters are 3.5 / 6.2 of what they are here, [in].
WIDTH = 6.2
COLUMN = 3.5
#: Of letters, [pt], and of the smallest of them: 6.2 pt in a column.
FONT = 12
SMALL = 11
#: Of the letters in a file that draws them; and what keeps the same picture the same file.
_AS_FILE: Any = {"svg.hashsalt": "casadi-gnc", "pdf.fonttype": 42}
_UNDATED = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}


def sheet(height: float) -> Any:
    """Return an empty figure of some inches height."""
    from matplotlib.figure import Figure

    return Figure(figsize=(WIDTH, height), dpi=140, layout="constrained")


def rows(count: int, height: float = 8.4) -> tuple[Any, Any]:
    """Return a figure of some inches height, and its panels from top to bottom, with one abscissa."""
    figure = sheet(height)
    panels = figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0]
    for panel in panels:
        plain(panel)
    return figure, panels


def plain(panel: Any) -> None:
    """Give a panel a light grid, no frame above and on the right, and legible letters."""
    panel.grid(color="0.9")
    panel.set_axisbelow(True)
    panel.spines[["top", "right"]].set_visible(False)
    panel.tick_params(labelsize=FONT)
    panel.xaxis.label.set_size(FONT)
    panel.yaxis.label.set_size(FONT)


def legend(panel: Any, columns: int) -> None:
    """Put the legend above the panel, where it hides nothing."""
    panel.legend(
        ncols=columns, loc="lower right", bbox_to_anchor=(1.0, 0.98), fontsize=SMALL, frameon=False,
        handlelength=1.4, columnspacing=1.2, borderaxespad=0.1,
    )  # fmt: skip


def titled(text: str) -> str:
    """Return a title as it is drawn, in lines that are no wider than the picture."""
    return "\n".join(part for line in text.split("\n") for part in textwrap.wrap(picture(line), 52) or [""])


def check_ending(target: Path) -> None:
    """Raise `ProblemError` for an ending that is no picture's."""
    if target.suffix not in (".png", ".svg", ".pdf"):
        raise ProblemError(f"{target.name} has the ending {target.suffix!r}; a picture ends in .png, .svg or .pdf")


def save(figure: Any, target: Path) -> Path:
    """Write a figure into a file that nobody sees half of, and return its path.

    The same picture is the same file: no date is in it. Raise `ProblemError` for an ending that is no picture's.
    """
    from matplotlib import rc_context

    check_ending(target)
    with rc_context(_AS_FILE):
        write_beside(target, lambda path: figure.savefig(path, metadata=_UNDATED.get(target.suffix)))
    return target
