"""Cases whose whole records a campaign keeps: the worst of each metric, those that fail, and some at random.

They are chosen when all cases are flown, and flown again: a record is a function of the case, so the folder `kept` is
one of the campaign and of what is asked. `kept.json` says why each is there.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from casadi_gnc.campaigns.draws import Purpose, words
from casadi_gnc.errors import CampaignError
from casadi_gnc.missions.one_build import OneBuild
from casadi_gnc.status import StepStatus
from casadi_gnc.system.files import prepare_folder, write_beside

if TYPE_CHECKING:
    from casadi_gnc.campaigns.result import Campaign

#: Folder of the records, in that of the campaign.
FOLDER = "kept"


@dataclass(frozen=True)
class Keep:
    """Say how many records are kept.

    Parameters
    ----------
    worst : of each metric, the cases with the worst values.
    failed : of each requirement, those farthest from meeting it; and those that diverged.
    random : drawn from all that flew.
    """

    worst: int = 0
    failed: int = 0
    random: int = 0

    @classmethod
    def of(cls, text: str) -> Keep:
        """Return what a text such as "worst:20,failed:50,random:10" asks for; raise `CampaignError` for another."""
        known = [field.name for field in fields(cls)]
        found: dict[str, int] = {}
        for part in text.split(","):
            name, _, number = part.strip().partition(":")
            if name not in known or not number.isdecimal() or name in found:
                raise CampaignError(
                    f"what is kept is {text!r}; expected how many of {', '.join(known)}, each once: "
                    "worst:20,failed:50,random:10"
                )
            found[name] = int(number)
        return cls(**found)


def chosen(campaign: Campaign, keep: Keep) -> dict[int, list[str]]:
    """Return the cases that are kept, in their order, and why each is."""
    why: dict[int, list[str]] = {}

    def add(cases: np.ndarray, reason: str) -> None:
        for case in cases:
            why.setdefault(int(case), []).append(reason)

    numbers = campaign.column("case")[campaign.flew]
    for metric in campaign.metrics:
        add(campaign.ranked(metric.name)[: keep.worst], f"worst:{metric.name}")
    for one in campaign.cases.varied.nominal.requirements:
        margins = campaign.column(f"requirement.{one.id}")[campaign.flew]
        order = np.argsort(margins, kind="stable")[: keep.failed]
        add(numbers[order[margins[order] < 0]], f"failed:{one.id}")
    diverged = campaign.column(f"samples.{StepStatus.DIVERGED.name}")[campaign.flew] > 0
    add(numbers[diverged][: keep.failed], "failed:DIVERGED")
    order = np.argsort(words(campaign.cases.seed, Purpose.KEPT, numbers, 1)[:, 0], kind="stable")
    add(np.sort(numbers[order[: keep.random]]), "random")
    return dict(sorted(why.items()))


def keep_records(campaign: Campaign, keep: Keep) -> list[Path]:
    """Fly the chosen cases again and write `kept/case-17.npz` of each; return their paths.

    What is there already is not flown again, and records of cases that are no longer chosen go.
    """
    why = chosen(campaign, keep)
    folder = prepare_folder(campaign.folder / FOLDER)
    made = {case: folder / f"case-{case}.npz" for case in why}
    for place in folder.glob("case-*.npz"):
        if place not in made.values():
            place.unlink()
    build = OneBuild(campaign.cases.varied, maths=campaign.identity["maths"])
    for case, place in made.items():
        if not place.exists():
            campaign.case(case).fly(build=build).save_as(place)
    text = json.dumps({"keep": vars(keep), "cases": {str(case): reasons for case, reasons in why.items()}}, indent=2)
    write_beside(folder / "kept.json", lambda path: path.write_text(text + "\n", encoding="utf-8"))
    return list(made.values())
