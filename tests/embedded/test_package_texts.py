"""Texts of a mission reach packages and units as texts, whatever they hold; invisible characters are refused.

The attack of old: a title with a backslash before a line's end joins `*` and `/`, the comment ends, and what follows is
compiled. Truth: compilers that know trigraphs, an XML parser, and an enumerator that must stay the only declaration.
"""

import dataclasses
import shutil
import subprocess
import xml.etree.ElementTree as ElementTree

import pytest
from markdown_it import MarkdownIt

import casadi_gnc
from casadi_gnc.delivery.fmu import generate_fmu
from casadi_gnc.delivery.packaging import generate
from casadi_gnc.embedded import fmu, package
from casadi_gnc.embedded.controller import Options
from casadi_gnc.embedded.readme import render_readme
from casadi_gnc.errors import ProblemError
from casadi_gnc.missions import tapes
from casadi_gnc.missions.engines import flight_source
from casadi_gnc.missions.onboard import describe
from casadi_gnc.signals import Layout
from casadi_gnc.system import assets

CODE = "int injected = 1;"
ATTACKS = {
    "a plain end": f"*/ {CODE} /*",
    "a spliced end, newline": f"x *\\\n/\n{CODE}\n/*",
    "a spliced end, carriage return": f"x *\\\r/\r{CODE}\r/*",
    "a spliced end, both": f"x *\\\r\n/\r\n{CODE}\r\n/*",
    "a spliced end, space before the newline": f"x *\\ \t\n/\n{CODE}\n/*",
    "a trigraph": f"x *??/\n/\n{CODE}\n/*",
    "two splices": f"x *\\\n\\\n??/\n/\n{CODE}\n/*",
    "a backslash at the end": "x \\",
    "a trigraph at the end": "x ??/",
    "half an end": "x *",
    "half a begin": "/",
    "a nested comment": "/*/ //",
    "directions of writing": "\u202e*/\u2066 int injected = 1; \u2069",
    "separators": f"x\u2028{CODE}\u2029\x85{CODE}",
    "markup": '"/><evil a="]]><!-- & &#0; <script>alert(1)</script>',
    "terminal": "\x1b]0;evil\x07\x1b[2J\x9b31m\0",
    "no text at all": "\ud800\ufffe\uffff",
}


def spoiled(controller, said):
    """Return a controller all of whose texts are `said`."""

    def units(layout):
        return Layout(tuple(dataclasses.replace(one, unit=said, frame=said) for one in layout.signals))

    names = ("measured", "memory", "wanted", "limited", "actuators", "report")
    tunables = tuple(dataclasses.replace(one, unit=said, note=said) for one in controller.tunables)
    return dataclasses.replace(
        controller,
        title=said,
        source=said,
        scheme=said,
        tunables=tunables,
        statuses={bit: (name, said) for bit, (name, _) in controller.statuses.items()},
        **{name: units(getattr(controller, name)) for name in names},
    )


@pytest.fixture(scope="module")
def controller():
    return describe(casadi_gnc.load("huang2020/slew"), "funnel_pinv", ["attitude_gain"])


@pytest.mark.parametrize("attack", ATTACKS)
def test_texts_stay_in_their_comments(attack, controller, tmp_path):
    options, mean = Options("craft"), spoiled(controller, ATTACKS[attack])
    files = fmu.fmu_files(mean, options, "0", 1.0)
    package.put(tmp_path, files)
    mission = casadi_gnc.load("huang2020/slew")
    scheme = mission.scheme("pd_pinv")
    flight = flight_source(dataclasses.replace(mission, name=ATTACKS[attack]), scheme, tapes.tapes_of(mission, scheme))
    (tmp_path / "sources" / "flight.c").write_text(flight, encoding="utf-8")
    for source in ("craft.c", "fmu.c", "flight.c"):
        flags = ["-trigraphs", "-Wall", "-Wextra", "-Werror", "-I", str(assets.folder("codegen") / "runtime")]
        command = ["gcc", "-std=c99", *flags, "-c", str(tmp_path / "sources" / source), "-o", str(tmp_path / "a.o")]
        done = subprocess.run(command, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr[:1000]
        assert "injected" not in subprocess.run(["nm", str(tmp_path / "a.o")], capture_output=True, text=True).stdout
    header = tmp_path / "sources" / "craft.h"
    if shutil.which("g++"):
        command = [
            "g++",
            "-std=c++17",
            "-trigraphs",
            "-Wall",
            "-Wextra",
            "-Werror",
            "-fsyntax-only",
            "-include",
            str(header),
        ]
        done = subprocess.run([*command, "-x", "c++", "/dev/null"], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr[:1000]
    root = ElementTree.fromstring(files["modelDescription.xml"])
    assert {one.tag for one in root.iter()} <= {
        "fmiModelDescription", "CoSimulation", "SourceFiles", "File", "UnitDefinitions", "Unit", "DefaultExperiment",
        "ModelVariables", "ScalarVariable", "Real", "Integer", "ModelStructure", "Outputs", "InitialUnknowns",
        "Unknown",
    }  # fmt: skip


@pytest.mark.parametrize("attack", ATTACKS)
def test_texts_stay_texts_in_the_readme(attack, controller):
    def kinds(some):
        about = {"made_by": {"casadi_gnc": "0"}, "steps": 1}
        page = render_readme(some, Options("craft"), about, [], (1, 1))
        return [token.type for token in MarkdownIt("commonmark").enable("table").parse(page)]

    assert kinds(spoiled(controller, ATTACKS[attack])) == kinds(spoiled(controller, "plain"))


@pytest.mark.parametrize(
    "character", ["\r", "\0", "\x1b", "\x7f", "\x9b", "\u202e", "\u2067", "\u2028", "\u2029", "\ufeff"]
)
@pytest.mark.parametrize("key", ["title", "source"])
def test_a_file_with_invisible_characters_is_refused(key, character, tmp_path):
    text = (assets.folder("problems") / "huang2020" / "slew.toml").read_text(encoding="utf-8")
    number = next(k for k, line in enumerate(text.splitlines(), 1) if line.startswith(f"{key} ="))
    lines = text.splitlines()
    lines[number - 1] = f'{key} = "one\\u{ord(character):04x}two"'
    problem = tmp_path / "mean.toml"
    problem.write_text("\n".join(lines), encoding="utf-8")
    sentence = rf"^mean.toml, line {number}, {key}: holds the character U\+{ord(character):04X}, .*leave it out$"
    for make in (
        casadi_gnc.load,
        lambda file: generate(file, tmp_path / "out"),
        lambda file: generate_fmu(file, tmp_path / "a.fmu"),
    ):
        with pytest.raises(ProblemError, match=sentence):
            make(problem)
    assert [path.name for path in tmp_path.iterdir()] == ["mean.toml"]


@pytest.mark.parametrize("kind", ["mission", "allocation", "synthesis"])
def test_comments_of_files_are_looked_at_too(kind, tmp_path):
    """What a reviewer sees of a file is what the file says, whatever its kind."""
    problem = tmp_path / "mean.toml"
    problem.write_text(f'format = 1\nkind = "{kind}"\n# \u202eevil\n', encoding="utf-8")
    with pytest.raises(ProblemError, match=r"^mean.toml, line 3: holds the character U\+202E"):
        casadi_gnc.load(problem)


def test_texts_of_many_scripts_are_welcome(tmp_path):
    text = (assets.folder("problems") / "huang2020" / "slew.toml").read_text(encoding="utf-8")
    problem = tmp_path / "fine.toml"
    title = "Lageänderung, ориентация, 姿勢, מצב, ± 5 µm, θ\u200d"
    problem.write_text(
        "\n".join(f'title = "{title}"' if line.startswith("title =") else line for line in text.splitlines())
    )
    assert casadi_gnc.load(problem).title == title
