"""Run a mutant through the commands that take its kind, and tell what must not be."""

import json
import random
import re
import select
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

from mutating import mutant

#: Processor time [s] beyond which a command counts as hanging, and the time for which one that says nothing is waited.
MOST, PATIENCE = 20.0, 200.0
#: Most characters of a message.
LONGEST = 500
#: What only libraries, Python and compilers say.
WORDS = re.compile(
    r"pydantic|[Ii]nput should|validation error|[nN]um[pP]y|ndarray|inhomogeneous|broadcast|LinAlg|[Ss]ingular matrix|"
    r"could not convert|invalid literal|unsupported operand|JSON serializable|has no attribute|object is not|"
    r"positional argument|keyword argument|\bdict\b|[A-Z][a-z]+Error\b|list index|out of range|unhashable|Warning:|"
    r"\[Errno|tomllib|\(at line \d+, column|Expected '=' after|datetime\.|CasADi - |casadi::|\.[ch]pp:|HiGHS|"
    r"did not converge|math domain|cannot convert|infs or NaNs|\bTrue\b|\bFalse\b|\bNone\b|NoneType|must be real|"
    r"not iterable|division by zero|overflow encountered|codec can't|Traceback|[Aa]ssertion|recursion depth"
)


@dataclass
class Judged:
    """Count runs and keep what was wrong: (seed, source, change, command, what, text)."""

    runs: int = 0
    refused: int = 0
    faults: list = field(default_factory=list)
    slowest: tuple = (0.0, 0, "")


class Server:
    """Hold the process that runs commands; a new one takes the place of one that hangs or dies."""

    def __init__(self) -> None:
        self._process = None

    def ask(self, words: list[str]) -> dict | None:
        """Return what a command did, None where it hangs; {"died": code} where the process ended."""
        if self._process is None or self._process.poll() is not None:
            self._start()
        self._process.stdin.write(json.dumps(words) + "\n")
        self._process.stdin.flush()
        return self._answer(PATIENCE)

    def _start(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, str(Path(__file__).with_name("serving.py"))],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
        )  # fmt: skip
        assert self._answer(120.0) == {"ready": True}

    def _answer(self, seconds: float) -> dict | None:
        if not select.select([self._process.stdout], [], [], seconds)[0]:
            self.close()
            return None
        line = self._process.stdout.readline()
        return json.loads(line) if line else {"died": self._process.wait()}

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            for stream in (self._process.stdin, self._process.stdout):
                stream.close()
            self._process = None


def commands(name: str, path: Path, seed: int, folder: Path) -> list[list[str]]:
    """Return the commands that take a mutant of a source; costly ones for some seeds only."""
    file, draw, out = str(path), random.Random(-seed), str(folder / "out")
    kind = "synthesis" if name in ("feedback", "ellipsoid") else "allocation" if name in ("matrices", "wheels") else ""
    if kind == "synthesis" or "synthesis" in name:
        return [["synthesize", file], *([["check", file]] if draw.random() < 0.2 else [])]
    if kind == "allocation" or "allocation" in name:
        table = folder / "u.csv"
        table.write_text("u1,u2,u3\n0.01,0.02,0.03\n0,0,0\n")
        first = "u1,u2\n0.01,0.02\n" if name == "matrices" else None
        if first:
            table.write_text(first)
        return [["attainable", file, "--samples", "5"], ["allocate", file, "--commands", str(table), "--json"]]
    if "claims" in name:
        return [["read-claims", file]]
    if name.startswith("benchmarks/"):
        return [["read-benchmark", file]]
    found = [["check", file]]
    if draw.random() < 0.1:
        found.append(["fly", file, "--out", out, "--decimation", "1000"])
    if draw.random() < 0.1:
        found.append([draw.choice(("schema", "laws", "crafts")), *([file] if draw.random() < 0.8 else [])])
    return found


def wrong(found: dict | None, path: Path) -> list[tuple[str, str]]:
    """Return what must not be in what a command did, each with the text that shows it."""
    if found is None:
        return [("hangs", "")]
    if "died" in found:
        return [("the process died", str(found["died"]))]
    if found["seconds"] > MOST:
        return [(f"takes {found['seconds']:.0f} s", "")]
    told = [line for line in found["err"].splitlines() if line.strip()]
    faults = []
    if found["code"] not in (0, 1, 2):
        faults.append((f"exit code {found['code']}", found["err"][-2000:]))
    if "Traceback" in found["err"] + found["out"]:
        return [*faults, ("traceback", found["err"][-3000:])]
    for line in told:
        if len(line) > LONGEST + len("casadi-gnc: "):
            faults.append((f"{len(line)} characters", line))
        if said := WORDS.search(line):
            faults.append((f"a library's words: {said[0]}", line))
    if found["code"] == 2:
        begin = next((k for k, line in enumerate(told) if line.startswith("casadi-gnc: ")), None)
        if begin is None:
            faults.append(("no sentence", found["err"][-2000:]))
        # Before it there may be warnings, and what takes long.
        sentences = told[begin:]
        faults += [
            ("names no file", line) for line in sentences if path.name not in line and str(path.parent) not in line
        ]
    if said := re.search(r"CasADi - |Warning:", found["out"]):
        faults.append((f"a library's words: {said[0]}", found["out"][:2000]))
    return faults


def judge(seeds: range, folder: Path, each=None) -> Judged:
    """Run the mutants of some seeds."""
    judged, server = Judged(), Server()
    try:
        for seed in seeds:
            name, change, content = mutant(seed)
            path = folder / "mutant.toml"
            path.write_bytes(content)
            for words in commands(name, path, seed, folder):
                found = server.ask(words)
                judged.runs += 1
                judged.refused += bool(found) and found.get("code") == 2
                if found and found.get("seconds", 0) > judged.slowest[0]:
                    judged.slowest = (found["seconds"], seed, words[0])
                for what, text in wrong(found, path):
                    judged.faults.append((seed, name, change, words[0], what, text))
                    if each:
                        each(judged.faults[-1])
    finally:
        server.close()
    return judged
