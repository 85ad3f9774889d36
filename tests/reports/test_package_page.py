"""The page of a verified package."""

import re

import pytest
from looking import keep, legible, opened

from casadi_gnc.reports.package_page import of_verification

SIGNAL = {"signal": "force", "unit": "N", "count": 12288, "words": 0, "ulp": 0.0, "absolute": 0.0, "relative": 0.0}
TARGET = {
    "title": "Cortex-M7", "compiler": "gcc 12", "instructions_median": 4321, "instructions_worst": 5000,
    "instructions_climbed": 5100, "instructions_bound": 6000,
    "instructions_first": 4400, "instructions_init": 900, "text_bytes": 7000, "data_bytes": 0, "bss_bytes": 8,
    "stack_step_bytes": 640, "stack_step_bound_bytes": 704, "state_bytes": 96, "params_bytes": 32,
}  # fmt: skip


def found(**changes):
    """What `verify` returns of a sound package, with changes."""
    whole = {"what": "host against the shipped flight", "exact": True, "words": 0, "of": 19456, "signals": [SIGNAL]}
    single = SIGNAL | {"words": 12, "ulp": 3.0}
    other = {"what": "float32 against float64", "exact": False, "words": 12, "of": 19456, "signals": [single]}
    return {
        "package": "slew", "title": "<i>Slew</i>" + chr(0x202E), "scheme": "pd", "real": "float64", "steps": 1024,
        "edited": [], "warnings": [], "not_regenerated": [], "comparisons": [whole, other], "targets": [TARGET],
        "not_installed": {"rv64": ["riscv64-unknown-elf-gcc"]}, "words": 0, "is_sound": True,
    } | changes  # fmt: skip


def shell(page):
    return re.sub(r"<(script|style).*?</\1>", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)


def test_what_agrees_and_what_it_costs(tmp_path):
    told = shell(of_verification(found(), tmp_path / "a.html"))
    assert "Verified" in told
    assert "No word differs where none may." in told
    assert all(str(value) in told for value in TARGET.values())
    assert "rv64 is not installed here (riscv64-unknown-elf-gcc)." in told
    assert "&lt;i&gt;Slew&lt;/i&gt;&lt;U+202E&gt;" in told
    assert "float32 against float64" in told


def test_what_does_not_agree_comes_first(tmp_path):
    bad = found()["comparisons"][0] | {"words": 7, "signals": [SIGNAL | {"words": 7, "ulp": 1.0}]}
    changes = {"comparisons": [bad], "words": 7, "edited": ["slew.c"], "is_sound": False, "warnings": ["unsigned"]}
    told = shell(of_verification(found(**changes), tmp_path / "a.html"))
    assert told.index("Not verified") < told.index("7 words differ where none may.") < told.index('id="words"')
    assert "Edited since it was generated: slew.c." in told
    assert "Unsigned" in told


@pytest.mark.tools("chromium")
@pytest.mark.packages("playwright")
@pytest.mark.parametrize(("width", "scheme"), [(1280, "dark"), (400, "light")])
def test_quiet_and_legible(browser, tmp_path, width, scheme):
    page = of_verification(found(), tmp_path / "a.html")
    with opened(browser, page, width=width, scheme=scheme) as sheet:
        legible(sheet, width)
        assert sheet.locator("h1").text_content() == "<i>Slew</i><U+202E>"
        assert sheet.locator("main i").count() == 0
        keep(sheet, f"package-{width}-{scheme}")
