import os
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
    first = compilers.build(SOURCE, include=INCLUDE)
    stamp = first.stat().st_mtime_ns
    assert compilers.build(SOURCE, include=INCLUDE) == first
    assert first.stat().st_mtime_ns == stamp
    assert compilers.build(SOURCE + "\n", include=INCLUDE) != first
    assert compilers.build(SOURCE, include=INCLUDE, flags=("-O0",)) != first


def test_refused_source_is_told_and_leaves_nothing(folder):
    with pytest.raises(CompilerError, match="refused the generated source: .*error"):
        compilers.build("int broken(void) { return", include=INCLUDE)
    assert list(folder.iterdir()) == []


def test_interrupted_compiler_leaves_no_entry(folder, fake, tmp_path):
    """A compiler that dies half way through its output: the half file is not taken for a library."""
    killed = fake('while [ "$1" != "-o" ]; do shift; done; printf half > "$2"; kill -9 $$')
    with pytest.raises(CompilerError):
        compilers.build(SOURCE, include=INCLUDE, compiler=killed)
    assert [path.name for path in folder.iterdir()] == ["fakecc"]
    assert compilers.build(SOURCE, include=INCLUDE).stat().st_size > 1000


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
    assert compilers.build(SOURCE, include=INCLUDE).exists()


def test_two_processes_may_build_at_once(folder):
    script = (
        "from pathlib import Path; from casadi_gnc.system import compilers; "
        f"print(compilers.build({SOURCE!r}, include=Path({str(INCLUDE)!r})))"
    )
    runs = [
        subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, env=dict(os.environ)) for _ in range(2)
    ]
    paths = {run.communicate()[0] for run in runs}
    assert all(run.returncode == 0 for run in runs)
    assert len(paths) == 1
