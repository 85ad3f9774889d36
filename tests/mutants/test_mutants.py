"""Files that nobody meant end in a sentence or an answer: no traceback, no hang, no library's words."""

import pytest
from judging import WORDS, judge, wrong
from mutating import CHANGES, mutant, sources

#: What the quick tests run; the slow one goes on from there, the long one from that.
QUICK, MORE, ALL = 40, 200, 5000


@pytest.fixture
def path(tmp_path):
    return tmp_path / "mutant.toml"


def _no_faults(seeds, folder):
    judged = judge(seeds, folder)
    told = "\n".join(
        f"seed {seed}, {name}, {change}, {command}: {what}\n{text}"
        for seed, name, change, command, what, text in judged.faults
    )
    assert not judged.faults, f"{len(judged.faults)} faults in {judged.runs} runs\n{told[:20_000]}"
    # Mutants of both kinds: a fuzzer whose files are all refused, or all taken, looks at little.
    assert judged.runs > len(seeds) / 2
    assert 0 < judged.refused < judged.runs


@pytest.mark.slow
def test_mutants(tmp_path):
    _no_faults(range(QUICK), tmp_path)


@pytest.mark.slow
def test_more_mutants(tmp_path):
    _no_faults(range(QUICK, MORE), tmp_path)


@pytest.mark.long
def test_five_thousand_mutants(tmp_path):
    _no_faults(range(MORE, ALL), tmp_path)


def test_the_same_seed_is_the_same_mutant():
    assert [mutant(seed) for seed in range(50)] == [mutant(seed) for seed in range(50)]
    assert len({mutant(seed) for seed in range(200)}) > 150
    assert {change for seed in range(600) for change in mutant(seed)[1].split("+")} >= {
        each.__name__ for each, _ in CHANGES
    }
    assert {mutant(seed)[0] for seed in range(600)} == set(sources())


@pytest.mark.parametrize(
    ("code", "err", "what"),
    [
        (2, "casadi-gnc: mutant.toml, line 3, a: is 1, expected a text in quotes\n", None),
        (0, "", None),
        (1, 'Traceback (most recent call last):\n  File "x"\nValueError: bad\n', "traceback"),
        (2, "casadi-gnc: mutant.toml: Input should be a valid list\n", "a library's words: Input should"),
        (2, "casadi-gnc: mutant.toml: is None\n", "a library's words: None"),
        (2, "casadi-gnc: mutant.toml: " + "x" * 500 + "\n", "525 characters"),
        (2, "casadi-gnc: is wrong\n", "names no file"),
        (2, "", "no sentence"),
        (139, "", "exit code 139"),
        (0, "x.py:3: RuntimeWarning: overflow encountered in dot\n", "a library's words: RuntimeWarning"),
    ],
)
def test_the_judge_sees_each_fault(path, code, err, what):
    found = [each for each, _ in wrong({"code": code, "out": "", "err": err, "seconds": 1.0}, path)]
    assert found == [] if what is None else any(each.startswith(what[:12]) for each in found), found


def test_the_judge_sees_time_and_death(path):
    assert wrong(None, path) == [("hangs", "")]
    assert wrong({"died": -11}, path) == [("the process died", "-11")]
    assert wrong({"code": 0, "out": "", "err": "", "seconds": 21.0}, path) == [("takes 21 s", "")]
    assert WORDS.search("is not JSON serializable")
