"""Exceptions of casadi-gnc: one base class, messages that say what to do."""

from __future__ import annotations

from collections.abc import Iterable


def offer(name: object, known: Iterable[str], more: str = "") -> str:
    """Return the end of a sentence about a name that leads nowhere: what is nearest to it, and what there is.

    Parameters
    ----------
    name : what was given.
    known : the names that there are, in order.
    more : what there is besides, with its comma or "and".
    """
    import difflib

    names = list(known)
    near = difflib.get_close_matches(str(name)[:100], names, 1)  # its time grows with the product of the lengths
    hint = f"did you mean {near[0]!r}? There" if near else "there"
    return f"{hint} is {', '.join(names) or 'none'}{more}"


class GncError(Exception):
    """Report anything a user can put right; the command line prints it and exits with 2."""


class ProblemError(GncError):
    """Report a defect of a problem file.

    Parameters
    ----------
    message : what was given, what was expected, what to do.
    place : where in the file, e.g. ``"detumble.toml, line 12, plant.inertia_kg_m2"``.
    """

    def __init__(self, message: str, place: str = "") -> None:
        self.place = place
        #: Each defect, (message, place); more than one where `several` made the error.
        self.told: list[tuple[str, str]] = [(message, place)]
        super().__init__(f"{place}: {message}" if place else message)

    @classmethod
    def several(cls, told: list[tuple[str, str]]) -> ProblemError:
        """Return one error that tells several defects, (message, place) each, a line each."""
        made = cls("\n".join(f"{place}: {message}" if place else message for message, place in told))
        made.place, made.told = told[0][1], told
        return made


class RegistryError(GncError):
    """Report a name that stands for nothing, for two things, or for one of another kind."""


class GuestError(GncError):
    """Report code of a user's own that cannot be found, run or used; its own lines are in the message."""


class PrinterError(GncError):
    """Report a symbolic function that cannot be printed as C."""


class CompilerError(GncError):
    """Report a C compiler that is missing or that refused the generated source."""


class NoCompilerError(CompilerError):
    """Report that no C compiler was found on this machine."""


class GpuError(GncError):
    """Report a GPU, its driver or its compiler that is missing or refuses."""


class AllocationError(GncError):
    """Report allocation data that cannot be used: shapes, bounds, weights."""


class LawError(GncError):
    """Report a gain outside its range, or a law, a plant or a craft whose method gives what cannot fly.

    `scheme` is the name of the scheme that it is about, "" if it is about all.
    """

    scheme: str = ""


class CheckError(GncError):
    """Report a check of a user's own that failed."""


class OutputError(GncError):
    """Report a folder or file that cannot be written."""


class FlightError(GncError):
    """Report a flight that cannot be flown as asked."""


class TuningError(GncError):
    """Report gains, a cost or constraints among which nothing can be sought."""


class CampaignError(GncError):
    """Report a plan, a dispersion or a statistic of a campaign that cannot be had as asked."""


class RequirementError(GncError):
    """Report a requirement that cannot be read, or that asks for what no flight has.

    `key` is the field of the requirement that it is about, "" if it is about all.
    """

    def __init__(self, message: str, key: str = "") -> None:
        self.key = key
        super().__init__(message)


class FaultHandlingError(FlightError):
    """Report what a mission cannot do with faults; `key` is the option that the sentence begins with."""

    def __init__(self, key: str, told: str) -> None:
        self.key = key
        super().__init__(f"{key} {told}")


class SynthesisError(GncError):
    """Report matrix inequalities that cannot be posed, or a gain asked for that is not certified."""


class BenchmarkError(GncError):
    """Report a benchmark that cannot be run, or results that cannot be read."""


class PackageError(GncError):
    """Report a flight package that cannot be written, read or verified as asked."""


class TargetError(GncError):
    """Report a target that is not known, lacks its tools, or did not run the program."""


class ReportError(GncError):
    """Report what no page can be made of."""
