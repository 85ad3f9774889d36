"""Write the table of docs/check.md from docs/check_cases.toml: `python docs/check_cases.py`."""

import tomllib
from pathlib import Path

HERE = Path(__file__).parent
BEGIN, END = "<!-- begin of the table of check_cases.py -->\n", "<!-- end of the table -->\n"


def told(changes: dict) -> str:
    """Return changed values as a user would write them; the file as it is shipped where there are none."""
    if not changes:
        return "as shipped"
    return "<br>".join(
        f"`{key} = {value if not isinstance(value, str) else repr(value)}`" for key, value in changes.items()
    )


def shown(shows: dict) -> str:
    """Return what tells a bad flight from a good one."""
    if "status" in shows:
        return f"`{shows['status']}`"
    if "metric" in shows:
        return f"no `{shows['metric']}`"
    if "at_least" in shows:
        return f"`{shows['signal']}` below {shows['at_least']:g}"
    return f"`{shows['signal']}` above {shows['at_most']:g} after {shows['after_s']:g} s"


def table(cases: list[dict]) -> str:
    """Return the rows."""
    lines = ["| check | mission | fails | passes | the failing flight shows |", "|---|---|---|---|---|"]
    for case in cases:
        cells = [f"`{case['check']}`", f"`{case['problem']}` {case['scheme']}"]
        cells += [told(case["fails"]), told(case["passes"]), shown(case["shows"])]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def rendered(page: str, cases: list[dict]) -> str:
    """Return the page with its table made anew."""
    before, rest = page.split(BEGIN)
    return before + BEGIN + table(cases) + END + rest.split(END)[1]


if __name__ == "__main__":
    page = HERE / "check.md"
    cases = tomllib.loads((HERE / "check_cases.toml").read_text(encoding="utf-8"))["case"]
    page.write_text(rendered(page.read_text(encoding="utf-8"), cases), encoding="utf-8")
