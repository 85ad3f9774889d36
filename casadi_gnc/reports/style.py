"""How all our pictures look: colours, letters, frames, and how a picture gets into its file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from casadi_gnc.errors import ProblemError, ReportError
from casadi_gnc.system.files import write_beside

#: Okabe and Ito's colours, told apart with every kind of colour vision.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
#: Points; still legible when the picture is shown at half its width.
FONT = 12


def rows(count: int, height: float = 8.4) -> tuple[Any, Any]:
    """Return a figure of some inches height, and its panels from top to bottom, with one abscissa."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.2, height), dpi=120, layout="constrained")
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
        ncols=columns, loc="lower right", bbox_to_anchor=(1.0, 0.98), fontsize=FONT - 1, frameon=False,
        handlelength=1.4, columnspacing=1.2, borderaxespad=0.1,
    )  # fmt: skip


def check_ending(target: Path) -> None:
    """Raise `ProblemError` for an ending that is no picture's."""
    if target.suffix not in (".png", ".svg", ".pdf"):
        raise ProblemError(f"{target.name} has the ending {target.suffix!r}; a picture ends in .png, .svg or .pdf")


def check_page(target: Path) -> None:
    """Raise `ReportError` for an ending that is no page's."""
    if target.suffix not in (".html", ".htm"):
        raise ReportError(f"{target.name} has the ending {target.suffix!r}; a report ends in .html")


def save(figure: Any, target: Path) -> Path:
    """Write a figure into a file that nobody sees half of, and return its path."""
    write_beside(target, lambda path: figure.savefig(path))
    return target
