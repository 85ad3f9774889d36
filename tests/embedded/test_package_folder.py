"""What is refused, and what stays as it was when something is."""

import dataclasses
import json
import re
import subprocess

import casadi as ca
import pytest
from packages import copied, made, run

import casadi_gnc
from casadi_gnc.delivery import packaging
from casadi_gnc.delivery.packaging import generate
from casadi_gnc.delivery.verifying import read_vectors, verify
from casadi_gnc.embedded import boards, package, targets
from casadi_gnc.embedded.names import check_name, check_package, check_parameter
from casadi_gnc.errors import CompilerError, OutputError, PackageError, PrinterError, TargetError
from casadi_gnc.laws import REGISTRY
from casadi_gnc.missions.onboard import describe

PLAIN = ("huang2020/slew", "pd_pinv")


def listing(folder):
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("switch", "keyword"),
        ("class", "keyword"),
        ("3axis", "identifier"),
        ("two words", "identifier"),
        ("a-b", "identifier"),
        ("", "identifier"),
        ("_hidden", "reserved"),
        ("a__b", "reserved"),
        ("x" * 40, "longer"),
        ("ünicode", "identifier"),
        ("memcpy", "belongs to the library"),
        ("sqrt", "belongs to the library"),
        ("sqrtf", "belongs to the library"),
        ("mtx", "belongs to the library"),
        ("pulse_t", "belongs to the library"),
        ("main", "belongs to the library"),
        ("string", "hide the system's header <string.h>"),
        ("stdint", "hide the system's header <stdint.h>"),
        ("gnc", "belongs to the runtime"),
        ("gnc_math", "belongs to the runtime"),
        ("slew_alloc", "belongs to the allocator of a package 'slew'"),
        ("slew_allocate_point", "belongs to the allocator of a package 'slew'"),
        ("slew_monitor", "belongs to the monitor of a package 'slew'"),
        ("SLEW", "has capital letters: .* take --name slew$"),
        ("Memcpy", "has capital letters"),
        ("slew_", "ends with an underscore"),
        ("test", "taken in the package's own builds"),
        ("all", "taken in the package's own builds"),
        ("edit_cache", "taken in the package's own builds"),
        ("replay", "taken in the package's own builds"),
        ("replay_word", "taken in the package's own builds"),
        ("nul", "device on Windows"),
        ("com1", "device on Windows"),
        ("linux", "macro"),
        ("errno", "macro"),
    ],
)
def test_names_that_c_refuses(name, reason, tmp_path):
    with pytest.raises(PackageError, match=reason):
        generate("huang2020/slew", tmp_path / "out", name=name)
    assert not list(tmp_path.iterdir())


def test_names_that_c_takes():
    for name in ("slew", "Slew2", "a", "x" * 31):
        assert check_name(name) == name


def test_files_of_other_names_are_refused_too(tmp_path):
    """The name of a mission's file is the package's where no other is given."""
    text = (casadi_gnc.system.assets.folder("problems") / "huang2020" / "slew.toml").read_text()
    for file in ("test.toml", "two words.toml", "Slew.toml", "string.toml"):
        (tmp_path / file).write_text(text)
        with pytest.raises(PackageError, match="the name '"):
            generate(tmp_path / file, tmp_path / "out")
        generate(tmp_path / file, tmp_path / "out", name="slew", scheme="pd_pinv", steps=40)
        (tmp_path / "out").rename(tmp_path / file.replace(".toml", "_out"))


NAMES_THAT_BUILD = ["tomato", "strong", "island", "structure", "status", "input", "sample", "unit"]


@pytest.mark.parametrize("name", NAMES_THAT_BUILD)
def test_names_that_build(name, tmp_path):
    """Beside words that are refused there are many that look like them."""
    folder = made("huang2020/slew", "funnel_robust", "float64", (), name=name, steps=40)
    assert run("make", "-s", "test", folder=copied(folder, tmp_path)).returncode == 0


@pytest.mark.parametrize("name", NAMES_THAT_BUILD)
@pytest.mark.tools("g++")
def test_names_that_build_as_cpp(name):
    folder = made("huang2020/slew", "funnel_robust", "float64", (), name=name, steps=40)
    language = ["g++", "-std=c++17", "-x", "c++", f"-I{folder}", "-Wall", "-Wextra", "-Werror", "-fsyntax-only"]
    for source in [*folder.glob("*.c"), *folder.glob("test/*.c")]:
        done = run(*language, source)
        assert done.returncode == 0, done.stderr[:1000]


def test_names_of_all_headers_of_this_machine_are_known():
    """Truth: the folder of the system's headers. Those of other libraries (curses, zlib) are not the system's."""
    public = ("stdio", "stdlib", "string", "math", "time", "pthread", "unistd", "wchar")
    text = "".join(f"#include <{one}.h>\n" for one in public)
    done = subprocess.run(["gcc", "-M", "-xc", "-"], input=text, capture_output=True, text=True, check=True)
    for folder, stem in re.findall(r"(\S+)/([a-z][a-z0-9]*)\.h\b", done.stdout):
        if folder.endswith("include"):
            with pytest.raises(PackageError):
                check_package(stem)


@pytest.mark.parametrize(("name", "reason"), [("derived", "member"), ("configured", "member"), ("NULL", "macro")])
def test_parameters_that_packages_have(name, reason):
    with pytest.raises(PackageError, match=reason):
        check_parameter(name)


@pytest.mark.parametrize(
    ("options", "error", "reason"),
    [
        (
            {"tunable": ["gain_of_nothing"]},
            PackageError,
            "no gain of scheme 'pd_pinv'; there is attitude_gain, rate_gain",
        ),
        ({"scheme": "nobody"}, casadi_gnc.errors.FlightError, "no scheme 'nobody'"),
        ({"real": "float16"}, PackageError, "expected float64 or float32"),
        ({"target": ["pdp11"]}, TargetError, "no target 'pdp11'; there is host, cortex-m4f"),
        ({"steps": 3}, PackageError, "expected more than"),
    ],
)
def test_options_that_are_refused(options, error, reason, tmp_path):
    with pytest.raises(error, match=reason):
        generate("huang2020/slew", tmp_path / "out", **options)
    assert not list(tmp_path.iterdir())


def test_scheme_that_cannot_fly(tmp_path):
    problem = tmp_path / "slew.toml"
    text = (casadi_gnc.system.assets.folder("problems") / "huang2020" / "slew.toml").read_text()
    problem.write_text(text.replace('method = "robust"', 'method = "robust", backend = "clarabel"'))
    with pytest.raises(PackageError, match="by a solver that does not fly"):
        generate(problem, tmp_path / "out", scheme="funnel_robust")


def test_operation_without_a_c_form(tmp_path, monkeypatch):

    law = REGISTRY.find("attitude_pd")
    command = law.command
    monkeypatch.setattr(law, "command", lambda self, t, y, m: ca.erfinv(command(self, t, y, m)))
    with pytest.raises(PrinterError, match="'erfinv' has no C form"):
        generate("huang2020/slew", tmp_path / "out", scheme="pd_pinv")
    assert not list(tmp_path.iterdir())


def test_constant_that_no_float_holds(tmp_path, monkeypatch):
    law = REGISTRY.find("attitude_pd")
    command = law.command
    monkeypatch.setattr(law, "command", lambda self, t, y, m: 1e-200 * command(self, t, y, m))
    with pytest.raises(PrinterError, match="1e-200 does not fit a float"):
        generate("huang2020/slew", tmp_path / "out", scheme="pd_pinv", real="float32")


def test_edited_package_is_refused_and_force_keeps_own_files(tmp_path):
    folder = copied(made(*PLAIN), tmp_path)
    before = listing(folder)
    generate(*PLAIN[:1], folder, scheme=PLAIN[1])  # untouched: replaced without a word
    assert listing(folder) == before
    (folder / "build").mkdir()
    (folder / "build" / "object.o").write_text("what make leaves behind is nobody's edit")
    generate(*PLAIN[:1], folder, scheme=PLAIN[1])
    (folder / "slew.c").write_text("/* mine */")
    (folder / "notes.txt").write_text("mine")
    (folder / "LICENSE").unlink()
    edited = listing(folder)
    with pytest.raises(OutputError, match=r"LICENSE \(missing\)|notes.txt \(added\), slew.c \(changed\)"):
        generate(*PLAIN[:1], folder, scheme=PLAIN[1])
    assert listing(folder) == edited
    generate(*PLAIN[:1], folder, scheme=PLAIN[1], force=True)
    after = listing(folder)
    assert after.pop(next(path for path in after if path.name == "notes.txt")) == b"mine"
    assert after == before
    assert [path.name for path in tmp_path.iterdir()] == ["copy"]


def test_folder_of_something_else_is_refused(tmp_path):
    (tmp_path / "letter.txt").write_text("dear")
    for force in (False, True):
        with pytest.raises(OutputError, match="not empty and is no package"):
            generate(*PLAIN[:1], tmp_path, scheme=PLAIN[1], force=force)
    with pytest.raises(OutputError, match="is a file"):
        generate(*PLAIN[:1], tmp_path / "letter.txt", scheme=PLAIN[1])
    assert [path.name for path in tmp_path.iterdir()] == ["letter.txt"]


@pytest.mark.parametrize("compiler", ["false", "/nonexistent/cc"])
def test_nothing_is_half_written(compiler, tmp_path, monkeypatch):
    folder = copied(made(*PLAIN), tmp_path)
    before = listing(folder)
    monkeypatch.setenv("CC", compiler)
    with pytest.raises(CompilerError):
        generate("huang2020/slew", folder, scheme="funnel_pinv")
    assert listing(folder) == before
    assert [path.name for path in tmp_path.iterdir()] == ["copy"]


def test_target_without_its_compiler(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    sentence = "cortex-m7 needs arm-none-eabi-gcc and qemu-system-arm, which .* `make targets`.*--target host works"
    with pytest.raises(TargetError, match=sentence):
        generate("huang2020/slew", tmp_path / "out", target=["cortex-m7"])
    with pytest.raises(TargetError, match=sentence):
        verify(made(*PLAIN), ["host", "cortex-m7"])
    assert not list(tmp_path.iterdir())


def test_manifest_says_what_it_was_made_of():
    folder = made(*PLAIN)
    about = json.loads((folder / "manifest.json").read_text())
    assert about["problem"]["sha256"] == package.digest((folder / "problem.toml").read_text())
    assert set(about["files"]) | {"manifest.json"} == {
        str(path) for path in listing(folder) if path.parts[0] != "build"
    }
    assert not re.search(r"20\d\d-\d\d-\d\d", (folder / "manifest.json").read_text())
    assert package.edited(folder) == []


@pytest.mark.parametrize(
    "text",
    ["", "[]", '{"format": 7}', '{"format": 1, "files": 3}', '{"format": 1, "files": {}, "name": 3}', "\\xff"],
)
def test_folder_that_is_no_package(text, tmp_path):
    with pytest.raises(PackageError, match="is no package"):
        verify(tmp_path)
    (tmp_path / "manifest.json").write_text(text)
    with pytest.raises(PackageError, match="is no package"):
        verify(tmp_path)


@pytest.mark.slow
def test_verify_notices_a_changed_constant(tmp_path):
    """A package whose C no longer does what its vectors say."""
    folder = copied(made(*PLAIN), tmp_path)
    assert verify(folder)["words"] == 0
    source = folder / "slew.c"
    text = source.read_text()
    place = text.index("const gnc_real", text.index("static void allocate"))
    constant = re.search(r"= (-?\d+\.\d{5,})", text[place:])
    assert constant is not None
    source.write_text(text[:place] + text[place:].replace(constant[1], f"{float(constant[1]) * 1.001!r}", 1))
    found = verify(folder)
    assert found["words"] > 0
    assert found["edited"] == ["slew.c (changed)"]
    assert found["not_regenerated"] == ["slew.c"]
    worst = max(line["relative"] for line in found["comparisons"][0]["signals"] if line["signal"] == "force")
    assert 1e-5 < worst <= 1e-3  # an entry of the pseudo-inverse moves by 1e-3, one part of a force with it


def test_verify_notices_vectors_that_are_none(tmp_path):
    folder = copied(made(*PLAIN), tmp_path)
    (folder / "test" / "vectors.c").write_text("int nothing;\n")
    with pytest.raises(PackageError, match="does not hold the vectors"):
        read_vectors(folder, "float64")


def test_a_continuous_mission_flies_sampled():
    """The controller of the file's sample period, whatever mode the file is flown in."""
    mission = casadi_gnc.load("huang2020/slew")
    continuous = describe(mission.with_timing(mode="continuous"), "funnel_pinv")
    sampled = describe(mission, "funnel_pinv")
    rows = [controller.tapes["before"].n_instructions() for controller in (continuous, sampled)]
    assert rows[0] == rows[1]
    assert continuous.period == 0.1


def test_float_package_warns_where_rounding_matters():
    """A measurement of 1e5 m rounds to 4 mm in a float; a law that reads it says so."""
    mission = casadi_gnc.load("huang2020/slew")
    assert packaging.warnings(mission, "funnel_pinv", "float64") == []
    stiff = mission.with_scheme("pd_pinv", attitude_gain=1e6)
    assert "numbers.float32" in packaging.warnings(stiff, "pd_pinv", "float32")[0]


def test_a_full_disk_is_no_fault_of_a_target(tmp_path):
    """What a cross compiler says of its disk names the folder and the variable, not the source."""
    fake = tmp_path / "fakecc"
    fake.write_text("#!/bin/sh\necho 'fatal error: error writing to /x/y.s: No space left on device' >&2\nexit 1\n")
    fake.chmod(0o755)
    board = dataclasses.replace(boards.find("cortex-m7"), compiler=str(fake), emulator=("true",))
    with pytest.raises(TargetError, match=r"target cortex-m7: \S+ has no space left; free some, or set TMPDIR to"):
        targets.measure(made(*PLAIN), "slew", board)
