"""What a campaign says, printed: a table of percentiles, and a sentence for all else."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from casadi_gnc.campaigns.result import Campaign


def print_summary(found: Campaign, confidence: float) -> None:
    """Print the summary of a campaign."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    summary = found.summary(confidence)
    console = Console(soft_wrap=True)

    def say(sentence: str) -> None:
        console.print(sentence, highlight=False, markup=False)

    flew = summary["cases"] - summary["refused"]
    say(f"{summary['mission']}, {summary['scheme']}: {flew} flights of {summary['asked']} cases")
    for sentence in summary["damaged"]:
        say(f"left out: {sentence}; the command that flew it flies it again")
    for why, count in summary["why"].items():
        say(f"{count} cases refused: {why}")
    title = f"what a share of all flights stays within, with bounds that hold at {100 * confidence:g} %"
    table = Table(title=title, title_justify="left")
    for name in ("", "share", "within", "bounds"):
        table.add_column(name, justify="left" if name in ("", "bounds") else "right")
    for name, one in summary["metrics"].items():
        unit = f" [{one['unit']}]" if one["unit"] not in ("", "-") else ""
        if one.get("range"):
            table.add_row(escape(name.replace("_", " ") + unit), "all", "", "{:.4g} to {:.4g}".format(*one["range"]))
        for number, (share, found_one) in enumerate(one["percentiles"].items()):
            value, low, high = (_shown(found_one[part]) for part in ("value", "low", "high"))
            first = escape(name.replace("_", " ") + unit) if number == 0 else ""
            table.add_row(first, f"{share} %", value, f"{low} to {high}")
        table.add_section()
    if summary["metrics"]:
        console.print(table, soft_wrap=False)
    for name, one in summary["metrics"].items():
        if one["without"]:
            say(f"{one['without']} flights have no {name.replace('_', ' ')}, which counts as the worst")
    for name, one in summary["requirements"].items():
        shown = one["shown"]
        bounds = f"{_percent(shown['low'])} to {_percent(shown['high'])}"
        more = one.get("more_if_all_pass")
        todo = ""
        if one["verdict"] == "undecided":
            every = "; no number of flights shows that every one meets it: ask for a share below 1"
            todo = f"; {more} more flights that all pass would meet it" if more else every if one["share"] == 1 else ""
        say(
            f"{name}: {one['verdict']}: {one['asked']} in {one['met_by']} of {one['of']} flights, {bounds} of all, "
            f"asked of {_percent(one['share'])} with {_percent(one['confidence'])} confidence{todo}"
        )
    for one in summary["statuses"].values():
        share = one["share"]
        low, high = 100 * share["low"], 100 * share["high"]
        say(f"{one['flights']} flights ({low:.3g} to {high:.3g} % of all): {one['sentence']}")
    for name, one in summary["metrics"].items():
        drivers = [each for each in one.get("drivers", []) if abs(each["rank_correlation"]["value"]) >= 0.1][:3]
        if drivers:
            told = ", ".join(f"{each['key']} ({each['rank_correlation']['value']:+.2f})" for each in drivers)
            say(f"{name.replace('_', ' ')} goes with {told}")
    for name, one in summary["metrics"].items():
        for each in (one.get("sensitivity") or [])[:3]:
            first, total = each["first_order"], each["total"]
            say(
                f"{name.replace('_', ' ')}: {each['key']} alone explains {_part(first)} of its variance, "
                f"{_part(total)} with all that it acts with"
            )
        if "sensitivity" in one and one["sensitivity"] is None:
            say(f"{name.replace('_', ' ')} has no sensitivity indices: flights without a value, or all of one")
    worst = [f"{name} of case {one['worst'][0]['case']}" for name, one in summary["metrics"].items()]
    if worst:
        say(f"the worst: {', '.join(worst)}")
    say(f"kept in {found.folder}; a case again: casadi-gnc fly {found.folder} --case worst:METRIC")


def _part(found: dict[str, float | None]) -> str:
    """Return a share of a variance with its bounds."""
    value, low, high = (found[name] for name in ("value", "low", "high"))
    return "?" if value is None or low is None or high is None else f"{value:.2f} ({low:.2f} to {high:.2f})"


def _percent(share: float | None) -> str:
    return "?" if share is None else f"{100 * share:.6g} %"


def _shown(value: float | None) -> str:
    """Return a number; what has no value, or no bound, is beyond all numbers."""
    return "none" if value is None else f"{value:.4g}"
