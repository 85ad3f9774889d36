"""Checks of a synthesis file: is there a gain, and does its certificate keep what it promises?"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from casadi_gnc.checks import Check
from casadi_gnc.problem_files.synthesis_file import load_synthesis, synthesize


def check(problem: str | Path) -> tuple[str, list[Check]]:
    """Return a title, and the checks of what the file's recipe finds."""
    case = load_synthesis(problem)
    found = synthesize(case)
    source = "eigenvalues computed from the data in the units of the file"
    if not found["certified"]:
        told = Check(
            "synthesis.feasible",
            0.0,
            1.0,
            "-",
            "fail",
            f"{found['sentence'].rstrip('.')}.",
            "Loosen the constraint that the sentence names, or change the data behind it.",
            "certificate of the conic problem, checked from the data",
            at_least=True,
        )
        return case.title or case.name, [told]
    checks = [_eigenvalue(constraint, source) for constraint in found["constraints"]]
    if found.get("norm") and found["promised_norm"] is not None:
        checks.append(
            Check(
                "synthesis.norm",
                found["norm"]["upper"],
                found["promised_norm"],
                "-",
                "fail",
                "The loop amplifies the disturbance more than the inequalities promise.",
                "Do not use these gains; look at how the disturbance and noise channels are modelled.",
                "H-infinity norm by the bounded-real lemma",
            )
        )
    if found.get("h2_norm"):
        checks.append(
            Check(
                "synthesis.h2_norm",
                found["h2_norm"]["upper"],
                found["h2_norm"]["promised"],
                "-",
                "fail",
                "The loop answers the disturbance with more energy than the inequalities promise.",
                "Do not use these gains; look at how the disturbance and what is priced are modelled.",
                "H2 norm by Lyapunov's equation, its residual included",
            )
        )
    for name, depth in found.get("pole_depths_rad_s", {}).items():
        checks.append(
            Check(
                f"synthesis.region.{name}",
                depth,
                0.0,
                "rad/s",
                "fail",
                "A pole of the closed loop leaves the region that was asked for.",
                "Do not use these gains.",
                "eigenvalues of the closed loop",
                at_least=True,
            )
        )
    if found.get("peak") and found["peak"]["limit"] is not None:
        checks.append(
            Check(
                "synthesis.peak_command",
                found["peak"]["bound"],
                found["peak"]["limit"],
                "",
                "fail",
                "From the worst start of the set the command exceeds its limit.",
                "Shrink the set of starts, or raise the limit.",
                "worst vertex of the initial set",
            )
        )
    slowest = max(pole[0] for pole in found["poles_rad_s"]) if found.get("poles_rad_s") else None
    if slowest is not None:
        checks.append(
            Check(
                "synthesis.poles",
                slowest,
                0.0,
                "rad/s",
                "fail",
                "The closed loop has a pole that does not decay.",
                "Do not use these gains.",
                "eigenvalues of the closed loop",
            )
        )
    return case.title or case.name, checks


def _eigenvalue(constraint: dict[str, Any], source: str) -> Check:
    return Check(
        f"synthesis.lmi.{constraint['name']}",
        constraint["smallest"],
        0.0,
        "-",
        "fail",
        "The inequality is violated: nothing that follows from it is true.",
        "Do not use these gains.",
        source,
        at_least=True,
    )
