"""What all commands share: examples that parse, headings, quiet, completion, near names."""

import subprocess
import sys
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from casadi_gnc.cli.commands import COMMANDS, app
from casadi_gnc.cli.manners import page
from casadi_gnc.errors import ReportError
from casadi_gnc.system import assets

GROUP = typer.main.get_command(app)
EXAMPLES = [(entry.name or entry.run.__name__, line) for entry in COMMANDS for line in entry.examples]


def answer(*words: str, **environment: str):
    return CliRunner().invoke(app, list(words), env={"COLUMNS": "120", **environment}, prog_name="casadi-gnc")


@pytest.mark.parametrize(("name", "line"), EXAMPLES, ids=[line for _, line in EXAMPLES])
def test_examples_of_the_help_parse_and_name_what_is_shipped(name, line):
    words = line.split(" > ")[0].split()
    assert words[0] == name
    GROUP.commands[name].make_context(name, words[1:])
    for word in words[1:]:
        if "/" in word and word.split("/")[0] in {known.split("/")[0] for known in assets.problems()}:
            assert word in assets.problems()


def test_every_command_stands_under_a_heading_with_its_sentence_whole():
    told = answer("--help").output
    for entry in COMMANDS:
        assert f"{entry.heading}:" in told
        assert entry.short in " ".join(told.split())
        name = entry.name or entry.run.__name__
        shown = GROUP.commands[name].get_help(GROUP.commands[name].make_context(name, [], resilient_parsing=True))
        assert "Examples:" in shown
        assert "--quiet" in shown
    assert {command.rich_help_panel for command in GROUP.commands.values()} == {entry.heading for entry in COMMANDS}


@pytest.mark.parametrize(
    ("words", "results", "written"),
    [
        ("tune m.toml --free k --out new/tuned.toml --report", "new/tuned.toml", "new/tuned.html"),
        ("tune m.toml --report --free k --out tuned.toml", "tuned.toml", "tuned.html"),
        ("tune m.toml --free k --out tuned.toml --report page.html --seed 1", "tuned.toml", "page.html"),
        ("tune m.toml --free k --out tuned.toml", "tuned.toml", None),
        ("fly m.toml --report --quiet", "out/m", "out/m.html"),
        ("fly m.toml --report=a.html", "out/m", "a.html"),
        ("check m.toml --report --json", "m-checks", "m-checks.html"),
        ("campaign show mc/ --report", "mc/", "mc.html"),
        ("verify flight/m --report", "flight/m", "flight/m.html"),
    ],
)
def test_a_page_without_a_name_stands_beside_the_results(words, results, written):
    name, *rest = words.split()
    given = GROUP.commands[name].make_context(name, rest).params["report"]
    assert page(given, Path(results)) == (None if written is None else Path(written))


def test_a_page_that_is_named_ends_as_one(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert page(GROUP.commands["check"].make_context("check", ["m", "--report"]).params["report"], Path()) == (
        tmp_path.with_name(f"{tmp_path.name}.html")
    )
    with pytest.raises(ReportError, match=r"page\.txt has the ending '\.txt'"):
        page(Path("page.txt"), Path("out"))


def test_quiet_leaves_data_and_errors_alone():
    assert answer("crafts", "--quiet", "--show", "satellite").output == ""
    assert answer("crafts", "--quiet", "--show", "satellite", "--json").output.startswith("{")
    assert answer("schema", "huang2020/detumble", "--quiet").output.startswith("{")
    command = [sys.executable, "-m", "casadi_gnc.cli.main", "fly", "--quiet", "nothing.toml"]
    failed = subprocess.run(command, capture_output=True, text=True, check=False)
    assert failed.returncode == 2
    assert failed.stdout == ""
    assert "no problem file 'nothing.toml'" in failed.stderr


@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("ch", ["check"]),
        ("fly --sch", ["--scheme"]),
        ("fly huang2020/detumble", ["huang2020/detumble", "huang2020/detumble_chaser_model"]),
        ("check huang2020/detumble --scheme obs", ["observer_pinv", "observer_robust"]),
        ("verify flight --target host,cortex-m7", ["host,cortex-m7"]),
        ("margins nothing.toml --scheme a", []),
        ("fly ./my", []),
    ],
)
def test_the_shell_is_offered_what_fits(line, offered):
    words = f"casadi-gnc {line}"
    place = str(len(words.split()) - 1)
    told = answer(COMP_WORDS=words, COMP_CWORD=place, _CASADI_GNC_COMPLETE="complete_bash")
    assert told.output.split() == offered, told.output


@pytest.mark.parametrize(
    ("words", "near"),
    [
        (("fyl",), "Did you mean 'fly'?"),
        (("fly", "huang2020/detumble", "--shceme", "x"), "--scheme"),
        (("bench", "alocation"), "Did you mean 'allocation'?"),
        (("fly", "huang2020/detumbel"), '"huang2020/detumble"'),
        (("margins", "huang2020/detumble", "--scheme", "observer_pin"), "'observer_pinv'"),
        (("campaign", "huang2020/detumble", "--plan", "sobel"), "'sobol'"),
        (("reproduce", "huang2021"), "'huang2020'"),
        (("crafts", "--show", "satelite"), "'satellite'"),
        (("problems", "copy", "satellites/slw", "."), "'satellites/slew'"),
        (("laws", "mrp_feedback"), "`casadi-gnc laws --show mrp_feedback`"),
        (("crafts", "satellite"), "`casadi-gnc crafts --show satellite`"),
    ],
)
def test_near_names_are_offered(words, near):
    failed = answer(*words)
    assert near in f"{failed.output}{failed.exception}"
