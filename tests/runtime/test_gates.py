# SPDX-License-Identifier: MIT-0
"""The quick share of `make gates`, and proof that each gate can fail."""

from pathlib import Path

import branch_coverage
import c_sources
import compilers
import fuzzing
import misra
import power_of_ten
import pytest
from c_sources import Finding, GateError

# ---- the code passes ---------------------------------------------------------------------------------------------


@pytest.mark.tools("cppcheck")
def test_misra_findings_are_written_deviations(tmp_path: Path):
    misra.gate(tmp_path)


@pytest.mark.tools("clang-tidy")
def test_clang_tidy_finds_nothing(tmp_path: Path):
    compilers.tidy(tmp_path)


@pytest.mark.slow
def test_gcc_analyzer_finds_nothing(tmp_path: Path):
    compilers.analyzer(tmp_path)


def test_power_of_ten():
    power_of_ten.gate()


@pytest.mark.slow
def test_every_branch_is_taken(tmp_path: Path):
    branch_coverage.gate(tmp_path)


@pytest.mark.slow
def test_chosen_cases_under_sanitizers(tmp_path: Path):
    assert "0 failures" in fuzzing.chosen(tmp_path, (4, 3, 1, 2, "double"))


@pytest.mark.slow
def test_fuzzed_allocator_under_sanitizers(tmp_path: Path):
    fuzzing.allocator(tmp_path, whole=False)


def test_fuzzed_maths_under_sanitizers(tmp_path: Path):
    fuzzing.maths(tmp_path, whole=False)


# ---- the gates can fail ------------------------------------------------------------------------------------------


def broken(monkeypatch: pytest.MonkeyPatch, path: Path, text: str) -> set[tuple[str, str]]:
    """Return rule and function of what the ten rules find in a C file."""
    path.write_text(text)
    monkeypatch.setattr(power_of_ten, "FILES", (path,))
    found, _ = power_of_ten.check()
    return {(finding.rule, finding.function) for finding in found}


@pytest.mark.parametrize(
    ("rule", "body"),
    [
        ("1", "    goto end;\nend:\n    return f(n);"),
        ("1", "    return f(n - 1);"),
        ("2", "    while (n > 0) {\n    }"),
        ("2", "    for (k = 0; k < n; ++k) {\n    }"),
        ("2", "    for (k = 0; k < N; ++k) {\n        k -= 1;\n    }"),
        ("2", "    for (k = 0; k < N; --k) {\n    }"),
        ("2", "    for (k = 0; f(k); ++k) {\n    }"),
        ("3", "    int *a = (int *)malloc(4);"),
        ("4", "    n += 1;\n" * 60),
        ("5", "    n += 1;\n" * 10),
        ("9", "    int **a = 0;"),
        ("9", "    return a->b->c;"),
        ("9", "    int (*call)(int) = 0;"),
    ],
)
def test_the_ten_rules_find_what_breaks_them(rule, body, monkeypatch, tmp_path):
    text = f"static int f(int n)\n{{\n    int k = 0;\n{body}\n    return k;\n}}\n"
    assert (rule, "f") in broken(monkeypatch, tmp_path / "f.c", text)


@pytest.mark.parametrize(
    "loop",
    [
        "for (k = 0; k < N + V; ++k) {",
        "for (k = N - 1; k >= 0; --k) {",
        "for (k = 0; k < V && n > 0; ++k) {",
        "for (k = 0; k < n; ++k) { /* GNC_ASSERT is above */",
        "for (k = 0; k < N; ++k) {\n        for (j = k; j >= 1; --j) {\n        }",
    ],
)
def test_counted_loops_pass(loop, monkeypatch, tmp_path):
    head = "static int f(int n)\n{\n    int k, j;\n    if (!GNC_ASSERT(n <= N)) {\n        return 0;\n    }\n"
    text = f"{head}    {loop}\n    }}\n    return 0;\n}}\n"
    assert not {found for found in broken(monkeypatch, tmp_path / "f.c", text) if found[0] == "2"}


def listed(monkeypatch: pytest.MonkeyPatch, folder: Path, where: str) -> None:
    row = f'[[deviation]]\ntool = "misra"\nrule = "15.5"\nwhere = [{where}]\nwhy = "a reason"\n'
    (folder / "deviations.toml").write_text(row)
    monkeypatch.setattr(c_sources, "RUNTIME", folder)


def test_a_finding_that_is_not_written_down_fails(monkeypatch, tmp_path):
    listed(monkeypatch, tmp_path, '"a.c: f"')
    known, new = Finding("15.5", "a.c", "f", 3), Finding("15.5", "a.c", "g", 9)
    c_sources.judge("misra", [known])
    with pytest.raises(GateError, match=r"a\.c:9 g"):
        c_sources.judge("misra", [known, new])


def test_a_deviation_that_no_longer_occurs_fails(monkeypatch, tmp_path):
    listed(monkeypatch, tmp_path, '"a.c: f", "b.c"')
    with pytest.raises(GateError, match=r"b\.c is a deviation that no longer occurs"):
        c_sources.judge("misra", [Finding("15.5", "a.c", "f", 3)])


def test_branches_of_several_builds_are_joined():
    assert branch_coverage.missing([[True, True, False], [True, False, True]]) == 0
    assert branch_coverage.missing([[True, True, False], [True, True, False]]) == 1
    assert branch_coverage.missing([[False]]) == 1
    # one build folds a branch away: the others must be complete
    assert branch_coverage.missing([[True, True, False, True, True], [True, True, True]]) == 1


def test_the_fuzzer_notices_a_force_outside_the_box(monkeypatch, tmp_path):
    """A planted fault: the last clip and its assertion are lost."""
    units = []
    for path in fuzzing.UNITS:
        text = path.read_text()
        if path.name == "gnc_allocate.c":
            assert text.count("const real force = work->force[i];") == 1
            text = text.replace("const real force = work->force[i];", "const real force = work->force[i] + (real)0.01;")
            text = text.replace("sound &= GNC_ASSERT(force == ", "(void)(force == ")
        units.append(tmp_path / path.name)
        units[-1].write_text(text)
    monkeypatch.setattr(fuzzing, "UNITS", tuple(units))
    program = fuzzing.build(tmp_path, (4, 3, 1, 2, "double"), ("-O1",))
    with pytest.raises(GateError, match="out of its box"):
        c_sources.run([str(program), "1000", "1"])
