import os
import shutil
import stat
import subprocess
import sys

import pytest

from casadi_gnc.errors import CompilerError, NoCompilerError
from casadi_gnc.system import assets, compilers

SOURCE = "int answer(void);\nint answer(void) { return 42; }\n"
INCLUDE = assets.folder("codegen") / "runtime"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv(compilers.CACHE_VARIABLE, str(tmp_path))
    return tmp_path


@pytest.fixture
def fake(tmp_path):
    """Return a maker of compilers that are shell scripts."""

    def make(script: str) -> compilers.Compiler:
        path = tmp_path / "fakecc"
        path.write_text(f"#!/bin/sh\n{script}\n")
        path.chmod(path.stat().st_mode | stat.S_IEXEC)
        return compilers.Compiler((str(path),), "fake 1")

    return make


def test_second_build_is_the_cached_one(folder):
    first = compilers.compiled(SOURCE, include=INCLUDE)
    stamp = first.stat().st_mtime_ns
    assert compilers.compiled(SOURCE, include=INCLUDE) == first
    assert first.stat().st_mtime_ns == stamp
    assert compilers.compiled(SOURCE + "\n", include=INCLUDE) != first
    assert compilers.compiled(SOURCE, include=INCLUDE, flags=("-O0",)) != first


def test_refused_source_is_told_and_leaves_nothing(folder):
    with pytest.raises(CompilerError, match="refused the generated source: .*error"):
        compilers.compiled("int broken(void) { return", include=INCLUDE)
    assert list(folder.iterdir()) == []


def test_interrupted_compiler_leaves_no_entry(folder, fake, tmp_path):
    """A compiler that dies half way through its output: the half file is not taken for a library."""
    killed = fake('while [ "$1" != "-o" ]; do shift; done; printf half > "$2"; kill -9 $$')
    with pytest.raises(CompilerError):
        compilers.compiled(SOURCE, include=INCLUDE, compiler=killed)
    assert [path.name for path in folder.iterdir()] == ["fakecc"]
    assert compilers.compiled(SOURCE, include=INCLUDE).stat().st_size > 1000


def test_no_compiler(monkeypatch):
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(compilers, "_candidates", lambda: [("no-such-compiler",)])
    with pytest.raises(NoCompilerError, match=r"looked for \$CC, cc, gcc, clang"):
        compilers.find()


def test_chosen_compiler_comes_first(monkeypatch):
    monkeypatch.setenv("CC", "gcc -m64")
    assert compilers.find().command == ("gcc", "-m64")


def test_unwritable_cache_falls_back(monkeypatch, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    monkeypatch.setenv(compilers.CACHE_VARIABLE, str(blocked / "cache"))
    assert compilers.compiled(SOURCE, include=INCLUDE).exists()


def test_two_processes_may_build_at_once(folder):
    script = (
        "from pathlib import Path; from casadi_gnc.system import compilers; "
        f"print(compilers.compiled({SOURCE!r}, include=Path({str(INCLUDE)!r})))"
    )
    runs = [
        subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, env=dict(os.environ)) for _ in range(2)
    ]
    paths = {run.communicate()[0] for run in runs}
    assert all(run.returncode == 0 for run in runs)
    assert len(paths) == 1


def test_a_full_disk_is_told_from_a_refusal(folder, fake, monkeypatch):
    """What the linker says of a full disk is not the source's fault."""
    said = fake("echo 'ld: final link failed: No space left on device' >&2; echo 'error: ld returned 1' >&2; exit 1")
    with pytest.raises(
        CompilerError, match=f"{folder} has no space left; .*; set {compilers.CACHE_VARIABLE} or TMPDIR to"
    ):
        compilers.compiled(SOURCE, include=INCLUDE, compiler=said)


def test_a_library_that_may_not_run_names_its_folder(folder, monkeypatch):
    def forbidden(path):
        raise OSError(f"{path}: failed to map segment from shared object")

    monkeypatch.setattr(compilers.ctypes, "CDLL", forbidden)
    with pytest.raises(CompilerError, match=f"built in {folder} cannot be loaded: .*; set {compilers.CACHE_VARIABLE}"):
        compilers.load(SOURCE, include=INCLUDE)


def test_complaints_are_in_english(folder, fake):
    """They are looked through for their cause."""
    asking = fake('echo "error: $LC_ALL" >&2; exit 1')
    with pytest.raises(CompilerError, match="refused the generated source: error: C$"):
        compilers.compiled(SOURCE, include=INCLUDE, compiler=asking)


def compiler(*command, version):
    return compilers.Compiler(command, version)


def test_one_compiler_under_two_names_is_one():
    """As Debian, Fedora, macOS and ccache have them."""
    gcc = compiler("gcc", version="gcc (Debian 12.2.0-14) 12.2.0")
    cc = compiler("cc", version="cc (Debian 12.2.0-14) 12.2.0")
    path = compiler("/usr/bin/gcc-12", "-m64", version="gcc-12 (Debian 12.2.0-14) 12.2.0")
    newer = compiler("gcc-13", version="gcc-13 (Debian 13.1.0-2) 13.1.0")
    clang = compiler("clang", version="Debian clang version 14.0.6")
    apple = [compiler(name, version="Apple clang version 15.0.0 (clang-1500.3.9.4)") for name in ("cc", "gcc", "clang")]
    zig = compiler(sys.executable, "-m", "ziglang", "cc", version="clang version 18.1.6 (https://github.com/ziglang)")
    assert compilers.different([cc, gcc, path, newer, clang, zig]) == [cc, newer, clang, zig]
    assert compilers.different(apple) == apple[:1]


def test_compilers_that_tell_no_version_are_told_by_their_files(tmp_path):
    real, link, other = tmp_path / "real", tmp_path / "link", tmp_path / "other"
    for path in (real, other):
        path.write_text("#!/bin/sh\n")
        path.chmod(0o755)
    link.symlink_to(real)
    found = [compiler(str(path), version="unknown version") for path in (real, link, other)]
    assert compilers.different(found) == [found[0], found[2]]


def test_the_compilers_of_this_machine_are_witnesses_once():
    """Truth: the files behind the names."""
    found = compilers.different(compilers.available())
    files = [(os.path.realpath(shutil.which(one.command[0])), one.version.removeprefix(one.name)) for one in found]
    assert len(set(files)) == len(files)
