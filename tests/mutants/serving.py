"""Run commands on files, one after the other, as the command line does; a line of JSON in, a line of JSON out.

The process that asks watches the clock: whatever hangs, or dies, is this process and not the test.
"""

import io
import json
import os
import sys
import tempfile
import traceback
from contextlib import suppress


def main() -> None:
    jobs, answers = os.fdopen(os.dup(0), "r"), os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    from casadi_gnc.cli import main as command_line

    command_line._say_what_code_runs = lambda: None  # once is enough
    print(json.dumps({"ready": True}), file=answers, flush=True)
    for line in jobs:
        words = json.loads(line)
        began = sum(os.times()[:4])
        with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
            os.dup2(out.fileno(), 1)
            os.dup2(err.fileno(), 2)
            # Streams of their own: what a command leaves in a buffer belongs to it.
            sys.stdout, sys.stderr = (io.TextIOWrapper(os.fdopen(os.dup(n), "wb")) for n in (1, 2))
            code = _run(words, command_line)
            for stream in (sys.stdout, sys.stderr):
                with suppress(ValueError, OSError):
                    stream.close()
            found = {"code": code, "seconds": sum(os.times()[:4]) - began}
            for name, file in (("out", out), ("err", err)):
                file.seek(0)
                found[name] = file.read(200_000).decode("utf-8", "replace")
        print(json.dumps(found), file=answers, flush=True)


def _run(words: list, command_line) -> int:
    """Return the exit code of a command, or of a reader that has no command of its own."""
    try:
        if words[0] in _READERS:
            from casadi_gnc.errors import GncError

            try:
                _READERS[words[0]](words[1])
            except GncError as error:
                print(f"casadi-gnc: {error}", file=sys.stderr)
                return 2
            return 0
        sys.argv = ["casadi-gnc", *words]
        command_line.main()
    except SystemExit as error:
        return error.code if isinstance(error.code, int) else 0 if error.code is None else 1
    except BaseException:
        traceback.print_exc()
        return 1
    return 0


def _read_claims(path: str) -> None:
    from casadi_gnc.fidelity import answering, read_claims

    answering._questions(read_claims(path).claim)


def _read_benchmark(path: str) -> None:
    from casadi_gnc.benchmarks import allocation, synthesis
    from casadi_gnc.problem_files.document import read

    contest = synthesis if read(path).data.get("contest") == "synthesis" else allocation
    contest.families([path], 2)


_READERS = {"read-claims": _read_claims, "read-benchmark": _read_benchmark}


if __name__ == "__main__":
    main()
