"""Answer claims: fly what is needed, compute the rest, in parallel, and remember the answers.

Claims that ask the same flight are flown once. An answer is kept in the user's cache folder under
the hash of the question and of everything that could change it: problem files, this package, the C.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Future, as_completed
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError

import casadi_gnc
from casadi_gnc.errors import GncError
from casadi_gnc.fidelity.claims import ClaimModel, ClaimsFile
from casadi_gnc.fidelity.computations import COMPUTATIONS
from casadi_gnc.fidelity.verdict import Answer
from casadi_gnc.problem_files.document import read
from casadi_gnc.problem_files.mission_tables import MetricAsked
from casadi_gnc.status import StepStatus
from casadi_gnc.system import assets, compilers, processes
from casadi_gnc.system.files import write_beside

Progress = Callable[[int, int], None]

#: Flights of so many samples at most are flown on CasADi's virtual machine: to compile takes longer.
_SHORT = 10_000


@dataclass(frozen=True)
class Question:
    """One flight with all metrics asked of it, or one computation.

    `key` orders by content: equal questions have equal keys.
    """

    kind: str
    content: str

    def key(self, surroundings: str) -> str:
        """Return the hash of the question and of all that could change its answer."""
        return hashlib.sha256(f"{self.kind}\n{self.content}\n{surroundings}".encode()).hexdigest()


class _Kept(BaseModel):
    """What a file of the cache holds: numbers by name, None where a flight gives none."""

    model_config = ConfigDict(extra="forbid", strict=True)

    values: dict[str, float | None]


def _surroundings() -> str:
    """Return the hash of this package, the C sources, the problem files and the versions below."""
    digest = hashlib.sha256()
    folders = (Path(casadi_gnc.__file__).parent, assets.folder("codegen"), assets.folder("problems"))
    for folder in folders:
        for path in sorted(folder.rglob("*")):
            if path.suffix in (".py", ".c", ".h", ".j2", ".toml", ".csv") and path.name != "claims.toml":
                digest.update(path.relative_to(folder).as_posix().encode())
                digest.update(path.read_bytes())
    for package in sorted(metadata.distributions(), key=lambda each: each.name):
        digest.update(f"{package.name} {package.version}".encode())
    return digest.hexdigest()


def _questions(claims: list[ClaimModel]) -> dict[Question, list[tuple[str, str]]]:
    """Return the questions with, for each, (id of the claim, name of the number in the answer)."""
    asked: dict[Question, list[tuple[str, str]]] = {}
    flights: dict[str, list[ClaimModel]] = {}
    for claim in claims:
        if claim.flight is not None:
            flights.setdefault(json.dumps(claim.flight.model_dump(), sort_keys=True), []).append(claim)
        for role, model in (("ours", claim.computation), ("bound", claim.bound)):
            if model is not None:
                question = Question("computation", json.dumps(model.model_dump(), sort_keys=True))
                asked.setdefault(question, []).append((claim.id, role))
    for flight, askers in flights.items():
        content = {
            "flight": json.loads(flight),
            "problem_sha256": _digest(json.loads(flight)["problem"]),
            "metric": [_named(claim, claim.metric) for claim in askers if claim.metric is not None],
            "status": {claim.id: claim.status.model_dump() for claim in askers if claim.status is not None},
        }
        question = Question("flight", json.dumps(content, sort_keys=True))
        asked[question] = [(claim.id, "ours") for claim in askers]
    return asked


def _named(claim: ClaimModel, metric: MetricAsked) -> dict[str, Any]:
    """Return a claim's metric as a mission file would have it, named by the claim."""
    return {"name": claim.id, **metric.model_dump(exclude_unset=True)}


def _digest(problem: str) -> str:
    """Return the hash of a problem file's text; of one that cannot be read, nothing: its flight says why."""
    try:
        return hashlib.sha256(read(problem).text.encode()).hexdigest()
    except GncError:
        return ""


def answer(
    file: ClaimsFile, *, processes: int = 2, progress: Progress | None = None, fresh: bool = False
) -> list[Answer]:
    """Return the answers to all claims of a file, in their order.

    Parameters
    ----------
    processes : that fly and compute side by side.
    progress : called as progress(questions answered, questions in all).
    fresh : answer anew what the cache knows.

    A question that cannot be answered becomes a row with its sentence; the rest goes on.
    """
    asked = _questions(file.claim)
    numbers: dict[str, dict[str, Any]] = {claim.id: {"ours": None} for claim in file.claim}
    for done, (question, found) in enumerate(_answered(asked, processes, fresh), 1):
        for claim, role in asked[question]:
            if "failure" in found:
                numbers[claim]["failure"] = found["failure"]
            else:
                numbers[claim][role] = found["values"][_name(question, claim)]
        if progress:
            progress(done, len(asked))
    return [Answer(claim, **numbers[claim.id]) for claim in file.claim]


def _name(question: Question, claim: str) -> str:
    """Return the name in a question's answer of the number for a claim."""
    return claim if question.kind == "flight" else "value"


def _answered(
    asked: dict[Question, list[tuple[str, str]]], count: int, fresh: bool
) -> Iterator[tuple[Question, dict[str, Any]]]:
    """Yield questions with their answers as they come, those in the cache first."""
    folder, surroundings, missing = compilers.cache_folder() / "claims", _surroundings(), []
    for question, askers in asked.items():
        known = None if fresh else _remembered(folder / f"{question.key(surroundings)}.json")
        if known is not None and not {_name(question, claim) for claim, _ in askers} <= set(known["values"]):
            known = None
        if known is None:
            missing.append(question)
        else:
            yield question, known
    if not missing:
        return
    with processes.pool(min(count, len(missing))) as pool:
        running: dict[Future, Question] = {pool.submit(find, question): question for question in missing}
        for future in as_completed(running):
            question, found = running[future], _result(future)
            if "failure" not in found:
                _remember(folder / f"{question.key(surroundings)}.json", found)
            yield question, found


def _result(future: Future) -> dict[str, Any]:
    """Return what a process found; whatever ended it is the failure of its question alone."""
    try:
        return future.result()
    except GncError as error:
        return {"failure": str(error)}
    except BrokenExecutor:
        return {"failure": "the process that answered it ended before it had; is there enough memory?"}
    except Exception:  # whatever a computation does of numbers that it cannot take: a row, not the end
        return {"failure": "cannot be computed of these arguments: they overflow, or leave nothing to compute"}


def _remembered(path: Path) -> dict[str, Any] | None:
    """Return an answer that was kept, or None: of what is not as we write it nothing is taken."""
    try:
        return _Kept.model_validate_json(path.read_bytes()).model_dump()
    except (OSError, ValidationError):
        return None


def _remember(path: Path, found: dict[str, Any]) -> None:
    """Keep an answer for the next time, where the cache can be written."""
    with contextlib.suppress(OSError):
        for folder in (path.parent.parent, path.parent):  # the cache is its user's alone
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        write_beside(path, lambda place: place.write_text(json.dumps(found)))


def find(question: Question) -> dict[str, Any]:
    """Return {"values": numbers by name}; raise what keeps a question from being answered."""
    content = json.loads(question.content)
    if question.kind == "computation":
        return {"values": {"value": float(COMPUTATIONS[content["name"]](**content["arguments"]))}}
    return {"values": _fly(content["flight"], content["metric"], content["status"])}


def _fly(flight: dict[str, Any], metric: list[dict[str, Any]], status: dict[str, Any]) -> dict[str, float | None]:
    """Return the metrics and status numbers of a flight by the ids of the claims that ask them."""
    # The scheme alone: its flight may be asked for signals that the file's other schemes do not have.
    tables = read(flight["problem"]).data.get("scheme", [])
    own = [table for table in tables if isinstance(table, dict) and table.get("name") == flight["scheme"]] or tables
    mission = casadi_gnc.load(flight["problem"], {"scheme": own, **flight["changes"], "metric": metric})
    alone = mission.with_scheme(flight["scheme"])
    samples = mission.timing.samples
    engine = "vm" if samples <= _SHORT else "c"
    flown = casadi_gnc.fly(alone, engine=engine, mode=flight["mode"], decimation=samples)
    values = dict(flown.metrics)
    for claim, asked in status.items():
        samples, first = flown.statuses.get(StepStatus[asked["name"]], (0, None))
        values[claim] = float(samples) if asked["value"] == "samples" else first
    return values
