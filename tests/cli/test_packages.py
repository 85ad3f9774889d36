"""The commands `generate` and `verify` as a user types them."""

import json
import os
import subprocess
import sys

import pytest
from packages import copied, made, needs_target, run


def command(*words, **environment):
    return subprocess.run(
        [sys.executable, "-m", "casadi_gnc.cli.main", *map(str, words)],
        capture_output=True,
        text=True,
        env={**os.environ, **environment},
    )


@pytest.mark.slow
def test_generate_make_verify(tmp_path):
    folder = tmp_path / "flight"
    done = command(
        "generate",
        "huang2020/slew",
        "--out",
        folder,
        "--scheme",
        "funnel_pinv",
        "--tunable",
        "attitude_gain, rate_gain",
    )
    assert done.returncode == 0, done.stderr
    assert "scheme funnel_pinv, float64: wrote" in done.stdout
    assert run("make", "-s", "test", folder=folder).returncode == 0
    page = tmp_path / "report" / "verify.html"
    done = command("verify", folder, "--json", "--report", page)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["words"] == 0
    assert any("CasADi's machine" in one["what"] for one in found["comparisons"])
    assert all(one["of"] > 10_000 for one in found["comparisons"])
    text = page.read_text()
    assert "No word differs where none may." in text
    assert text.endswith("</html>\n")


@needs_target("cortex-m4f")
def test_verify_on_a_target(tmp_path):
    page = tmp_path / "verify.html"
    folder = made("huang2020/slew", "funnel_pinv", "float32")
    done = command("verify", folder, "--target", "host,cortex-m4f", "--report", page)
    assert done.returncode == 0, done.stderr
    assert "cortex-m4f against the shipped flight: 0 of" in done.stdout
    assert "instructions a step" in done.stdout
    assert "float32 against float64" in done.stdout
    assert "Cortex-M4F" in page.read_text()


@needs_target("cortex-m7")
def test_numbers_of_a_target_reach_the_readme(tmp_path):
    folder = tmp_path / "flight"
    done = command("generate", "huang2020/slew", "--out", folder, "--target", "cortex-m7")
    assert done.returncode == 0, done.stderr
    row = next(line for line in (folder / "README.md").read_text().splitlines() if line.startswith("| cortex-m7 |"))
    numbers = [int(cell.split()[0]) for cell in row.split("|")[2:-1]]
    assert len(numbers) == 10
    assert 100 < numbers[0] <= numbers[1] <= numbers[2] < 2000  # median, worst of the flight, bound of any


@pytest.mark.slow
def test_words_that_differ_end_with_1(tmp_path):
    folder = copied(made("huang2020/slew", "pd_pinv"), tmp_path)
    source = folder / "slew.c"
    text = source.read_text()
    constant = "0.0037499999999999999"
    assert constant in text
    source.write_text(text.replace(constant, "0.00125"))
    done = command("verify", folder)
    assert done.returncode == 1
    assert "edited since it was generated: slew.c (changed)" in done.stdout
    assert "force:" in done.stdout


def test_fmu(tmp_path):
    done = command("generate", "huang2020/slew", "--out", tmp_path / "slew.fmu", "--format", "fmu")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "slew.fmu").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("generate", "huang2020/slew", "--name", "while"), "'while' is a keyword of C or C++"),
        (("generate", "shi2020/synthesis"), "kind is \"synthesis\"|kind is 'synthesis'"),
        (("generate", "huang2020/slew", "--tunable", "mass"), "'mass' is no gain"),
        (("generate", "huang2020/slew", "--target", "z80"), "no target 'z80'"),
        (("verify", "."), "is no package"),
        (("verify", "nowhere"), "is no package"),
    ],
)
def test_bad_input_is_one_sentence(words, sentence, tmp_path, monkeypatch):
    import re

    monkeypatch.chdir(tmp_path)
    done = command(*words)
    assert done.returncode == 2
    assert done.stdout == ""
    assert re.search(sentence, done.stderr)
    assert done.stderr.startswith("casadi-gnc: ")
    assert done.stderr.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_host_alone_says_what_is_missing(tmp_path):
    """A path with a host compiler and nothing else: the words of the host, and the names of what is not there."""
    import shutil

    for tool in ("gcc", "as", "ld", "cc1", "collect2"):
        if shutil.which(tool):
            (tmp_path / tool).symlink_to(shutil.which(tool))
    done = command("verify", made("huang2020/slew", "pd_pinv"), PATH=str(tmp_path), CC="")
    assert done.returncode == 0, done.stderr
    assert "0 of" in done.stdout
    assert "cortex-m7: not installed here (arm-none-eabi-gcc, qemu-system-arm); make targets installs it" in done.stdout


def test_missing_target_is_one_sentence(tmp_path):
    done = command("verify", made("huang2020/slew", "pd_pinv"), "--target", "host,rv64", PATH=str(tmp_path))
    assert done.returncode == 2
    assert "rv64 needs riscv64-unknown-elf-gcc and qemu-system-riscv64" in done.stderr
    assert "make targets" in done.stderr


@pytest.mark.slow
def test_texts_of_strangers_do_not_reach_the_terminal(tmp_path):
    """A package's manifest comes with the package, and may have been written by anybody."""
    folder = copied(made("huang2020/slew", "pd_pinv"), tmp_path)
    manifest = folder / "manifest.json"
    about = json.loads(manifest.read_text())
    manifest.write_text(json.dumps({**about, "title": "\x1b[2Jevil\u202e"}))
    page = tmp_path / "page.html"
    done = command("verify", folder, "--report", page)
    assert "<U+001B>[2Jevil<U+202E>, scheme pd_pinv" in done.stdout
    for said in (done.stdout, page.read_text()):
        assert "\x1b" not in said
        assert "\u202e" not in said


def test_a_terminal_of_few_letters(tmp_path):
    """A title in another script at a terminal that cannot show it: the letters' numbers, no traceback."""
    from casadi_gnc.system import assets

    text = (assets.folder("problems") / "huang2020" / "slew.toml").read_text(encoding="utf-8")
    lines = ['title = "\u59ff\u52e2"' if line.startswith("title =") else line for line in text.splitlines()]
    (tmp_path / "slew.toml").write_text("\n".join(lines), encoding="utf-8")
    words = ("--scheme", "pd_pinv", "--steps", 40, "--out", tmp_path / "my dir")
    done = command("generate", tmp_path / "slew.toml", *words, PYTHONIOENCODING="latin-1", PYTHONUTF8="0")
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("\\u59ff\\u52e2, scheme pd_pinv")
    line = done.stdout.splitlines()[-1].removeprefix("next: ").split("; ")[0]
    assert run("sh", "-c", line).returncode == 0  # a folder with a space in its name, as printed


def test_a_folder_that_looks_like_an_option_is_printed_as_a_folder(tmp_path):
    command = [sys.executable, "-m", "casadi_gnc.cli.main", "generate", "huang2020/detumble", "--out", "./-dash"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, timeout=300)
    assert done.returncode == 0, done.stderr
    assert "next: make -C ./-dash test; casadi-gnc verify ./-dash" in done.stdout
    assert (tmp_path / "-dash" / "Makefile").is_file()
