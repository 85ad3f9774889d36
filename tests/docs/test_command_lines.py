"""Every command line that a page shows, in a block or between words: the command line takes it as it stands."""

import re
import shlex

import pytest
import typer
from running_pages import ROOT

from casadi_gnc.cli.commands import app

GROUP = typer.main.get_command(app)
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
_BLOCK = re.compile(r"^ *```\w*\n(.*?)^ *```|((?:^(?: {4}|\t).*\n)+)", re.DOTALL | re.MULTILINE)
_BETWEEN = re.compile(r"`(casadi-gnc [^`]+)`")


def lines(page):
    """Return the command lines of a page, without what the shell does with them."""
    text = page.read_text(encoding="utf-8").replace("\\\n", " ")
    blocks = "\n".join(one or two for one, two in _BLOCK.findall(text))
    found = re.findall(r"^(?:[^#\n]*?(?:&&|;|\|) *| *(?:\$ )?)(casadi-gnc [^\n]+)", blocks, re.MULTILINE)
    between = (" ".join(one.split()) for one in _BETWEEN.findall(_BLOCK.sub("", text)))
    # "casadi-gnc check" names a command and is no line to type, "casadi-gnc COMMAND --help" is any of them.
    found += [one for one in between if one.count(" ") > 1 and "COMMAND" not in one]
    return sorted({re.split(r"\s+#|\s*(?:&&|;|\||\d?>)", line)[0].strip() for line in found})


def refused(line):
    """Return why the command line does not take a line, or nothing."""
    words, command = shlex.split(line)[1:], GROUP
    while hasattr(command, "commands"):
        if not words or words[0] not in command.commands:
            return "" if not words or words[0].startswith("-") else f"no command {words[0]}"
        command, *words = command.commands[words[0]], *words[1:]
    try:
        command.make_context(line, list(words))
    except typer.Exit:  # --help
        return ""
    except Exception as error:
        return str(error) or type(error).__name__
    return ""


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_command_lines_are_taken(page):
    wrong = {line: why for line in lines(page) if (why := refused(line))}
    assert not wrong


def test_enough_is_looked_at():
    assert sum(len(lines(page)) for page in PAGES) > 150
    assert refused("casadi-gnc fly x.toml --plot y.png")
    assert refused("casadi-gnc flie x.toml")
