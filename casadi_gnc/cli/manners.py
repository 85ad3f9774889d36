"""What all commands share: headings in the help, examples, `--quiet`, and messages that name the problem file."""

from __future__ import annotations

import contextlib
import inspect
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import wraps
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from casadi_gnc.cli import progress

_Quiet = Annotated[
    bool, typer.Option("--quiet", help="Print warnings and errors only, and what --json or a table asks for.")
]


class Ending(str, Enum):
    """Kinds of pictures."""

    png = "png"
    svg = "svg"
    pdf = "pdf"


#: The two options of every command that draws.
Figures = Annotated[Path | None, typer.Option("--figures", help="Draw pictures into this folder.")]
Format = Annotated[Ending, typer.Option("--format", help="Of the pictures.")]
#: The option of every command that writes a page; `page` says which file is meant.
Report = Annotated[
    Path | None,
    typer.Option(
        "--report", metavar="[FILE]", help="Write a page to look at (.html); without a name beside the results."
    ),
]
#: What stands for the name of a page that was not given.
_NAMELESS = "<beside the results>"


def page(report: Path | None, results: Path) -> Path | None:
    """Return the page to write: the one that is named, or one beside results, called as they are; None for none.

    Raises
    ------
    ReportError
        For an ending that is no page's.
    """
    from casadi_gnc.reports.endings import check_page

    if report is not None and str(report) == _NAMELESS:
        whole = results if results.name else results.resolve()
        return whole.with_name(f"{whole.name.removesuffix('.toml')}.html")
    if report is not None:
        check_page(report)
    return report


class Paged(TyperCommand):
    """A command that takes `--report` with the name of a page or without."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse, a bare `--report`, the last word or before another option, with a name that stands for none."""
        words, told = list(args), "--report"
        ends = words.index("--") if "--" in words else len(words)
        if any(told in one.opts for one in self.params):
            for i in range(ends - 1, -1, -1):
                if words[i] == told and (i + 1 >= ends or words[i + 1].startswith("-")):
                    words.insert(i + 1, _NAMELESS)
        return super().parse_args(ctx, words)


@dataclass(frozen=True)
class Entry:
    """One command.

    Parameters
    ----------
    run : function of the command; its docstring is the help.
    heading : under which it stands in the list of commands.
    short : what it does, in that list.
    examples : command lines, without the program's name; they are shown, and a test parses them.
    name : on the command line; the function's if left out.
    is_about_a_file : whether errors must name the file given as `problem`.
    gives_data : whether standard output is what was asked for even without --json.
    """

    run: Callable[..., None]
    heading: str
    short: str
    examples: tuple[str, ...]
    name: str = ""
    is_about_a_file: bool = False
    gives_data: bool = False

    def add_to(self, app: typer.Typer, program: str) -> None:
        """Make this a command of a program."""
        command = _named(self.run) if self.is_about_a_file else self.run
        app.command(
            self.name or self.run.__name__,
            cls=Paged,
            short_help=self.short,
            rich_help_panel=self.heading,
            epilog="\b\nExamples:\n" + "\n".join(f"  {program} {line}" for line in self.examples),
        )(quietly(command, gives_data=self.gives_data))


class Grouped(TyperGroup):
    """A list of commands under headings, in the order in which they were added."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the commands, none cut."""
        headings: dict[str, list[tuple[str, str]]] = {}
        for name in self.list_commands(ctx):
            command = self.get_command(ctx, name)
            if command is not None and not command.hidden:
                heading = getattr(command, "rich_help_panel", None)
                row = (name, command.get_short_help_str(formatter.width))
                headings.setdefault(heading if isinstance(heading, str) else "Commands", []).append(row)
        widest = max(len(name) for rows in headings.values() for name, _ in rows)
        for heading, rows in headings.items():
            with formatter.section(heading):
                formatter.write_dl([(name.ljust(widest), told) for name, told in rows])


def _named(command: Callable[..., None]) -> Callable[..., None]:
    """Return a command that names its problem file in whatever is wrong."""

    @wraps(command)
    def named(*arguments: Any, **options: Any) -> None:
        from casadi_gnc.problem_files.boundary import about

        with about(options["problem"]):
            command(*arguments, **options)

    return named


def quietly(command: Callable[..., None], *, gives_data: bool = False) -> Callable[..., None]:
    """Return a command that takes `--quiet` too."""

    @wraps(command)
    def heard(*arguments: Any, quiet: bool = False, **options: Any) -> None:
        is_data = gives_data or bool(options.get("json"))
        with (
            progress.silenced() if quiet else contextlib.nullcontext(),
            unheard() if quiet and not is_data else contextlib.nullcontext(),
        ):
            command(*arguments, **options)

    signature = inspect.signature(command, eval_str=True)
    told = inspect.Parameter("quiet", inspect.Parameter.KEYWORD_ONLY, default=False, annotation=_Quiet)
    heard.__signature__ = signature.replace(parameters=[*signature.parameters.values(), told])  # type: ignore[attr-defined]
    heard.__annotations__ = {name: one.annotation for name, one in heard.__signature__.parameters.items()}  # type: ignore[attr-defined]
    return heard


@contextlib.contextmanager
def unheard() -> Iterator[None]:
    """Throw away what is printed on standard output."""
    with open(os.devnull, "w", encoding="utf-8") as nothing, contextlib.redirect_stdout(nothing):
        yield


def tell(sentence: str, *, aside: bool = True) -> None:
    """Print what a user may want to know; aside: on standard error, since standard output has the data."""
    if not aside:
        typer.echo(sentence)
    elif not progress.is_silenced():
        typer.echo(sentence, err=True)


def print_json(content: Any) -> None:
    """Print plain data as JSON on standard output; what is no number JSON has none for."""
    import json

    typer.echo(json.dumps(content, indent=2, allow_nan=False))


def tell_written(paths: Sequence[Path], *, json: bool) -> None:
    """Print which files were written."""
    if json:
        print_json({"wrote": [str(path) for path in paths]})
    else:
        typer.echo(f"wrote {', '.join(map(str, paths))}")
