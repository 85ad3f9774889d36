# SPDX-License-Identifier: MIT-0
"""cppcheck and its MISRA C:2012 add-on: no finding but those with a written deviation, and none of these in vain."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

from c_sources import CONFIGURATIONS, FILES, MATHS, RUNTIME, UNITS, Finding, GateError, defines, function_at, judge

#: The constants of <stdint.h> as a compiler sees them: cppcheck reads no system header.
MEANING = ("-DUINT64_C(c)=c##ULL", "-DUINT32_C(c)=c##U")
OPTIONS = (
    "--addon=misra", "--std=c99", "--quiet", "--enable=warning,style,performance,portability",
    "--suppress=missingIncludeSystem", "--template={file}:{line}: {id}: {message}",
)  # fmt: skip


def findings(folder: Path) -> list[Finding]:
    """Return what cppcheck finds, in every configuration together."""
    unit = folder / "maths.c"
    unit.write_text("".join(f'#include "{path.name}"\n' for path in MATHS))
    names, found = {path.name: path for path in FILES}, set()
    for *size, real in CONFIGURATIONS:
        files = [str(unit), *map(str, UNITS)]
        command = ["cppcheck", *OPTIONS, *MEANING, *defines(*size, real), f"-I{RUNTIME}", *files]
        done = subprocess.run(command, capture_output=True, text=True, cwd=folder)
        text = done.stdout + done.stderr
        if done.returncode or "Traceback" in text:
            raise GateError(f"cppcheck ended with {done.returncode}:\n{text[:2000]}")
        for file, line, rule, message in re.findall(r"^(.+?):(\d+): ([\w.-]+): (.*)$", text, re.MULTILINE):
            name = Path(file).name
            if name not in names:
                raise GateError(f"a finding in {file}:{line}: {rule} {message}")
            number = int(line)
            rule = rule.removeprefix("misra-c2012-")
            code = names[name].read_text().splitlines()[number - 1].strip()
            found.add(Finding(rule, name, function_at(names[name], number), number, code))
    return sorted(found)


def gate(folder: Path) -> str:
    """Raise `GateError` for what is found and not written down, or written down and not found."""
    return judge("misra", findings(folder))
