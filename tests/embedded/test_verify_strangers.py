"""Packages that somebody changed so that all of it fits together: `verify` believes the problem, not the package.

Truth: what was changed, and a file that only foreign code could have written.
"""

import hashlib
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from packages import copied, made, run

import casadi_gnc
from casadi_gnc.delivery import verifying
from casadi_gnc.delivery.vectors import read_vectors
from casadi_gnc.delivery.verifying import verify
from casadi_gnc.embedded import package
from casadi_gnc.embedded.host import HostPackage
from casadi_gnc.errors import PackageError
from casadi_gnc.system import apart, compilers

PLAIN = ("huang2020/slew", "pd_pinv", "float64", (), "", 40)


@pytest.fixture
def folder(tmp_path):
    return copied(made(*PLAIN), tmp_path)


@pytest.fixture(autouse=True)
def one_compiler(monkeypatch):
    """A second one takes time and shows nothing more here."""
    monkeypatch.setattr(compilers, "available", lambda: [_first()])


def _first():
    found = compilers._probe(("gcc",))
    assert found is not None
    return found


def signed(folder, **changes):
    """Give a package a manifest that fits it, as its maker would have."""
    before = json.loads((folder / "manifest.json").read_text())
    about, listed = {**before, **changes}, {*before["files"], *changes.get("files", ())}
    about["files"] = {
        path: hashlib.sha256((folder / path).read_bytes()).hexdigest() for path in listed if (folder / path).is_file()
    }
    (folder / "manifest.json").write_text(json.dumps(about, indent=2) + "\n")
    return folder


def with_vectors(folder, inputs, outputs):
    """Write other words into the vectors of a package."""
    rows = iter([*package._rows(inputs), *package._rows(outputs)])
    path = folder / "test" / "vectors.c"
    path.write_text(re.sub(r"\{0x.*\}", lambda _: f"{{{next(rows)}}}", path.read_text()))


def replayed(folder, inputs):
    return HostPackage(folder, "slew").replay(inputs, read_vectors(folder, "float64")[1].shape[1])


def test_a_sound_package_is_sound(folder):
    found = verify(folder)
    assert found["is_sound"]
    assert (found["words"], found["edited"], found["not_regenerated"]) == (0, [], [])
    assert [one["what"] for one in found["comparisons"]][1:] == [
        "made again from slew.toml, against the shipped flight",
        "flown again in closed loop, against the shipped flight",
        "host with the C library's functions against CasADi's machine",
    ]


def test_a_gain_that_is_not_the_problems(folder):
    """Five percent on one gain, with vectors and hashes that fit: the package contradicts only its problem."""
    source = folder / "slew.c"
    problem = (folder / "problem.toml").read_text()
    other = made_of(folder, problem.replace("rate_gain = 0.5 }", "rate_gain = 0.525 }", 1))
    assert other != source.read_text()
    source.write_text(other)
    inputs, outputs = read_vectors(folder, "float64")
    found = replayed(folder, inputs)
    assert (found != outputs).any()
    with_vectors(folder, inputs, found)
    assert run("make", "-s", "test", folder=signed(folder)).returncode == 0
    told = verify(folder)
    by = {one["what"].split(",")[0]: one["words"] for one in told["comparisons"]}
    assert by["made again from slew.toml"] > 0
    assert by["flown again in closed loop"] > 0
    assert all(words == 0 for what, words in by.items() if what.startswith("host"))
    assert (told["edited"], told["not_regenerated"], told["is_sound"]) == ([], ["slew.c"], False)


def made_of(folder, problem):
    """Return the C of another problem."""
    (folder.parent / "slew.toml").write_text(problem)
    text = (made(str(folder.parent / "slew.toml"), *PLAIN[1:]) / "slew.c").read_text()
    (folder.parent / "slew.toml").unlink()
    return text


@pytest.mark.slow
def test_vectors_that_show_nothing(folder):
    """True words of the true C, but of measurements at rest, under which a changed gain would not be seen."""
    inputs, _ = read_vectors(folder, "float64")
    inputs = inputs.copy()
    inputs[:, 1:] = 0
    with_vectors(folder, inputs, replayed(folder, inputs))
    told = verify(signed(folder))
    words = {one["what"].split(",")[0]: one["words"] for one in told["comparisons"]}
    assert words.pop("flown again in closed loop") > 0
    assert set(words.values()) == {0}
    assert not told["is_sound"]


@pytest.mark.slow
def test_text_that_this_version_does_not_write(folder):
    (folder / "Makefile").write_text((folder / "Makefile").read_text() + "\ntest: evil\nevil:\n\techo evil\n")
    told = verify(signed(folder))
    assert (told["words"], told["edited"], told["not_regenerated"]) == (0, [], ["Makefile"])
    assert not told["is_sound"]
    told = verify(signed(folder, made_by={"casadi_gnc": "0.0.1", "casadi": "3.8.0"}))
    assert told["not_regenerated"] == ["Makefile"]
    assert told["is_sound"]  # another version may write otherwise; its words are the same


CODE = """
#include <stdio.h>
__attribute__((constructor)) static void evil(void)
{
    FILE *file = fopen("%s", "w");
    if (file) fclose(file);
}
"""


STRANGE = [
    "string.h",
    "evil.c",
    "slew_allocate_evil.c",
    "test/evil.h",
    "GNUmakefile",
    "Evil.SO",
    "sub/sitecustomize.py",
]


@pytest.mark.parametrize(
    ("name", "is_listed"), [*((name, False) for name in STRANGE), ("string.h", True), ("slew_allocate_evil.c", True)]
)
def test_files_that_no_package_has(name, is_listed, folder, tmp_path):
    """A header that hides the system's, a further unit, a library: refused before anything of them runs."""
    trace = tmp_path / "trace"
    text = CODE % trace
    (folder / name).parent.mkdir(exist_ok=True)
    (folder / name).write_text(f"#include_next <string.h>\n{text}" if name == "string.h" else text)
    if is_listed:
        signed(folder, files={name: ""})
    with pytest.raises(PackageError, match=f"has the file {name!r}, which is no part of such a package"):
        verify(folder)
    assert not trace.exists()


@pytest.mark.slow
def test_notes_of_a_user_are_told_and_no_fault(folder):
    (folder / "notes.txt").write_text("mine")
    told = verify(folder)
    assert told["edited"] == ["notes.txt (added)"]
    assert told["is_sound"]


@pytest.mark.parametrize(
    ("code", "sentence"),
    [
        ("abort();", "cannot be run as .*: its code, in a process of its own, was ended by SIGABRT"),
        pytest.param(
            "for (;;) {}", "its code, in a process of its own, did not end within 3 s", marks=pytest.mark.slow
        ),
        pytest.param(
            "exit(0);",
            "its code, in a process of its own, ended with code 0 and without an answer",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_code_that_crashes_or_hangs_is_told(code, sentence, folder, monkeypatch):
    """This process goes on, whatever a package does."""
    monkeypatch.setattr(verifying, "A_SAMPLE", 0.0)
    call = apart.call

    def quick(function, *arguments, limit):
        return call(function, *arguments, limit=3.0 if "replay" in function and "for" in code else limit)

    monkeypatch.setattr(verifying.apart, "call", quick)
    source = folder / "slew.c"
    begin = f"#include <stdlib.h>\n__attribute__((constructor)) static void evil(void) {{ {code} }}\n"
    source.write_text(begin + source.read_text())
    with pytest.raises(PackageError, match=sentence):
        verify(signed(folder))


LAW = """
import os
from casadi_gnc.laws import AttitudePD
with open(os.environ["TRACE"], "a") as file:
    file.write(f"{os.getpid()}\\n")
class Own(AttitudePD):
    pass
"""


def test_own_code_runs_in_another_process(tmp_path, monkeypatch, caplog):
    """The user's Python that a package keeps: said beforehand, and away from this process's memory."""
    trace = tmp_path / "trace"
    monkeypatch.setenv("TRACE", str(trace))
    (tmp_path / "own.py").write_text(LAW)
    text = (casadi_gnc.system.assets.folder("problems") / "huang2020" / "slew.toml").read_text()
    (tmp_path / "slew.toml").write_text(text.replace('type = "attitude_pd"', 'type = "./own.py:Own"'))
    casadi_gnc.generate(tmp_path / "slew.toml", tmp_path / "out", scheme="pd_pinv", steps=40)
    assert set(trace.read_text().split()) == {str(os.getpid())}
    trace.unlink()
    with caplog.at_level("INFO", "casadi_gnc"):
        assert verify(tmp_path / "out")["is_sound"]
    assert str(os.getpid()) not in trace.read_text().split()
    assert re.search(r"running the code of .*own.py \(sha256 \w{12}\), which the package keeps", caplog.text)


@pytest.mark.parametrize(
    "change",
    [
        {"files": {}},
        {"files": {"../slew.c": "0" * 64}},
        {"files": {"/etc/passwd": "0" * 64}},
        {"files": {"a/./b": "0" * 64}},
        {"files": {"a\\b": "0" * 64}},
        {"files": {"slew.c": "x"}},
        {"files": {"slew.c": None}},
        {"name": 3},
        {"steps": 10**9},
        {"steps": -1},
        {"real": "float16"},
        {"tunable": [1]},
        {"problem": {"sha256": "0" * 64, "code": {"../own.py": "0" * 64}}},
        {"made_by": "me"},
        {"format": True},
    ],
)
def test_a_manifest_that_is_none(change, folder):
    about = {**json.loads((folder / "manifest.json").read_text()), **change}
    (folder / "manifest.json").write_text(json.dumps(about))
    key = next(iter(change))
    with pytest.raises(PackageError, match=f"is no package of this version: its manifest.json .*'{key}"):
        verify(folder)


@pytest.mark.parametrize("name", ["slew;x", "../slew", "int", "SLEW"])
def test_a_name_that_is_none(name, folder):
    about = {**json.loads((folder / "manifest.json").read_text()), "name": name}
    (folder / "manifest.json").write_text(json.dumps(about))
    with pytest.raises(PackageError, match="the name"):
        verify(folder)


def narrow(rows):
    return [row[:-1] for row in rows]


def ragged(rows):
    return [*rows[:-1], [*rows[-1], "0x1ull"]]


def wide(rows):
    return [["0x1ffffffffffffffffull", *row[1:]] for row in rows]


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (narrow, "the vectors have 6 numbers in and 18 out a sample, the controller has 7 and 19"),
        (ragged, "does not hold the vectors of a flight"),
        (wide, "the vectors have 6 numbers in and 18 out"),
        (lambda rows: rows[:-1], "has vectors of 39 samples, its manifest says 40"),
        (lambda rows: [[] for _ in rows], "does not hold the vectors of a flight"),
    ],
)
def test_vectors_of_another_width(change, sentence, folder):
    """Found before the C reads past their end."""
    path = folder / "test" / "vectors.c"
    parts = re.split(r"(\] = \{\n)(.*?)(\n\};)", path.read_text(), flags=re.DOTALL)
    for k in (2, 6):
        rows = [re.findall(r"0x\w+", row) for row in parts[k].splitlines()]
        parts[k] = ",\n".join(f"    {{ {', '.join(row)} }}" for row in change(rows))
    path.write_text("".join(parts))
    with pytest.raises(PackageError, match=sentence):
        verify(signed(folder))


def test_the_host_refuses_other_widths(folder):
    inputs, outputs = read_vectors(folder, "float64")
    host = HostPackage(folder, "slew")
    for given, count in ((inputs[:, :-1], outputs.shape[1]), (inputs, outputs.shape[1] + 1), (inputs[0], 19)):
        with pytest.raises(PackageError, match="words in and"):
            host.replay(given, count)


def test_links_are_not_followed(folder, tmp_path):
    for name, told in (("slew.c", "slew.c"), ("problem.toml", "problem.toml")):
        (tmp_path / name).write_text((folder / name).read_text())
        (folder / name).unlink()
        (folder / name).symlink_to(tmp_path / name)
        with pytest.raises(PackageError, match=f"{told} cannot be read: it is a link"):
            verify(folder)
        (folder / name).unlink()
        (folder / name).write_text((tmp_path / name).read_text())


def test_a_pipe_does_not_hang(folder):
    (folder / "README.md").unlink()
    os.mkfifo(folder / "README.md")
    assert package.edited(folder) == ["README.md (changed)"]


@pytest.mark.slow
def test_the_command_ends_with_1(folder):
    signed(folder, title="another")
    command = [sys.executable, "-m", "casadi_gnc.cli.main", "verify", folder]
    done = subprocess.run(command, capture_output=True, text=True, cwd=Path(casadi_gnc.__file__).parents[1])
    assert done.returncode == 1
    assert "edited since it was generated: manifest.json (names another problem, title or scheme)" in done.stdout


def test_words_are_numbers_of_the_right_count(tmp_path):
    """Whatever a process leaves, it is read as so many words or not at all."""
    from casadi_gnc.delivery.rebuilding import put_words, take_words

    words = np.arange(6, dtype=np.uint64).reshape(2, 3)
    put_words(tmp_path, "a", words)
    assert (take_words(tmp_path, "a", (2, 3), words.dtype) == words).all()
    (tmp_path / "link.words").symlink_to(tmp_path / "a.words")
    for name, shape in (("a", (2, 4)), ("b", (2, 3)), ("link", (2, 3))):
        with pytest.raises(PackageError, match="left no"):
            take_words(tmp_path, name, shape, words.dtype)
