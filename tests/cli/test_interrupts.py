"""Ctrl-C before a command has begun its work: one sentence and exit code 130, wherever in an import it comes.

No clock is looked at: the process interrupts itself at its k-th import.
"""

import subprocess
import sys

import pytest

PROGRAM = """
import signal, sys

signal.signal(signal.SIGINT, signal.default_int_handler)
left = int(sys.argv.pop(1))

class Interrupting:
    def find_spec(self, *_):
        global left
        left -= 1
        if left == 0:
            signal.raise_signal(signal.SIGINT)

from casadi_gnc.cli.entry import main

sys.meta_path.insert(0, Interrupting())
main()
"""
CHECK = ["check", "huang2020/detumble", "--json"]
OTHERS = (
    ["fly", "huang2020/detumble", "--out", "unused"],
    ["synthesize", "shi2020/synthesis"],
    ["allocate", "huang2020/allocation", "--commands", "none.csv"],
    ["campaign", "huang2020/detumble"],
    ["generate", "huang2020/slew", "--out", "unused"],
    ["reproduce", "huang2020"],
    ["attainable", "huang2020/allocation"],
    ["doctor"],
)


def interrupted_at(place: int, words: list[str], folder) -> None:
    command = [sys.executable, "-c", PROGRAM, str(place), *words]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120)
    assert done.stderr == "casadi-gnc: interrupted; files already complete were kept\n"
    assert (done.returncode, done.stdout) == (130, "")
    assert not list(folder.iterdir())


@pytest.mark.parametrize("place", [1, 40])
def test_while_the_command_line_is_imported(place, tmp_path):
    interrupted_at(place, CHECK, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("place", [2, 10, 90, 200, 350, 500, 650, 800])
def test_while_the_libraries_are_imported(place, tmp_path):
    interrupted_at(place, CHECK, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("words", OTHERS, ids=lambda words: words[0])
def test_of_every_command(words, tmp_path):
    interrupted_at(250, words, tmp_path)
