"""The pages made from the code hold what the code has."""

import re
import sys

import pytest
from running_pages import ROOT

from casadi_gnc.errors import ProblemError
from casadi_gnc.laws import REGISTRY as LAWS
from casadi_gnc.missions.craft import REGISTRY as CRAFTS
from casadi_gnc.problem_files import catalogue
from casadi_gnc.problem_files.document import read
from casadi_gnc.status import StepStatus


def test_pages_hold_every_law_craft_and_status(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    import catalogue_pages

    catalogue_pages.write(tmp_path / "catalogue")
    pages = {page.stem: page.read_text(encoding="utf-8") for page in (tmp_path / "catalogue").iterdir()}
    assert set(pages) == {"laws", "crafts", "statuses", "names"}
    headings = {
        name: [line[3:] for line in text.splitlines() if line.startswith("## ")] for name, text in pages.items()
    }
    assert headings["laws"] == LAWS.names()
    assert headings["crafts"] == CRAFTS.names()
    for bit in StepStatus:
        assert f"| `{bit.name}` | {bit.value} | {bit.sentences[0]} |" in pages["statuses"]
    assert "`rate_gain` | k2 | N m s/rad | > 0 |" in pages["laws"]
    stamps = {page: page.stat().st_mtime_ns for page in (tmp_path / "catalogue").iterdir()}
    catalogue_pages.write(tmp_path / "catalogue")
    assert stamps == {page: page.stat().st_mtime_ns for page in (tmp_path / "catalogue").iterdir()}
    sys.modules.pop("catalogue_pages")


def test_a_law_fits_a_craft_as_in_the_example_that_measures_what_it_reads():
    (satellite,) = [craft for craft in catalogue.crafts() if craft.name == "satellite"]
    (bdot,) = [law for law in catalogue.laws() if law.name == "bdot"]
    found = catalogue.law_data(bdot, {"satellite": catalogue.sample_of(satellite)})
    assert found["fits"] == ["satellite"]
    assert found["fits_as"] == {"satellite": "satellites/detumble_bdot"}
    (plain,) = [law for law in catalogue.laws() if law.name == "mrp_feedback"]
    assert not catalogue.law_data(plain, {"satellite": catalogue.sample_of(satellite)})["fits_as"]


def test_a_law_that_is_not_there_names_the_file(tmp_path):
    text = read("huang2020/slew").text
    (tmp_path / "mine.toml").write_text(re.sub(r'^type = ".*"', 'type = "nobodys"', text, count=1, flags=re.MULTILINE))
    with pytest.raises(ProblemError, match=r"^mine\.toml: no law 'nobodys'; "):
        catalogue.laws(tmp_path / "mine.toml")


@pytest.mark.parametrize("schemes", ["5", "[5, []]", '[{ law = 1.5 }, { law = ["x"] }, { law = { type = [1] } }]'])
def test_schemes_that_are_no_tables_name_no_law(tmp_path, schemes):
    """What lists laws for an editor reads files that `check` has not yet refused."""
    path = tmp_path / "half.toml"
    path.write_text(f'format = 1\nkind = "mission"\nscheme = {schemes}\n')
    assert [law.name for law in catalogue.laws(path)] == LAWS.names()
