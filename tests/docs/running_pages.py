"""Pages of the documentation, run section by section as they stand.

A fenced block of a page is

* a file, where the line before it ends with its name: "`pid.py`:". With "at the end of `cube.toml`:" or "at the top of
  `cube.toml`:" the block is added to what stands there;
* commands, where it is marked `sh`: each ends with 0, or as its comment says: "# exit code 2";
* a script, where it is marked `python` and is no file;
* what the commands or the script before it print, where it is marked `text`: each line is among what came out, blanks
  aside; a line of dots stands for any others.

Blocks marked `bash` install software, or read what only a user has, and are not run. A section stands on those before
it: their files are written, and their commands run that write more.
"""

import os
import re
import shutil
import subprocess
import sys
import textwrap
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).parents[2]
#: Longest that one command may take.
PATIENCE_S = 300
#: Commands by which a section makes what later ones stand on.
_MAKES = re.compile(r"^(casadi-gnc (new|problems copy|generate)|mkdir|cp|mv|sed|printf) ")
#: Warnings are errors. Said in Python: at the option -W error pyparsing, below Matplotlib, warns of its own innards.
_STRICT = "import warnings; warnings.simplefilter('error')\n"
_BLOCK = re.compile(r"^( *)```(\w*)\n(.*?)^ *```", re.DOTALL | re.MULTILINE)
_FILE = re.compile(r"`([\w./-]+\.\w+)`:$")


@dataclass
class Block:
    """One fenced block, and the file that it is or is added to."""

    language: str
    text: str
    file: str = ""
    place: str = "whole"


@dataclass
class Section:
    """What stands under one heading of the second level."""

    title: str
    blocks: list[Block] = field(default_factory=list)

    @property
    def tools(self) -> list[str]:
        """Programs of the flight targets that its commands need."""
        text = "".join(block.text for block in self.blocks if block.language in ("sh", "python"))
        needed = re.search(r"--target \S*(cortex-m7|\./board\.toml)|check_target", text)
        return ["arm-none-eabi-gcc", "qemu-system-arm"] if needed else []


def sections(page: str) -> list[Section]:
    """Return the sections of a page in docs/ that have blocks."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    found = []
    for part in re.split(r"^## ", text, flags=re.MULTILINE):
        section = Section(part.split("\n", 1)[0])
        for match in _BLOCK.finditer(part):
            said = part[: match.start()].rstrip().rsplit("\n", 1)[-1]
            named = _FILE.search(said)
            place = "end" if "at the end of" in said else "top" if "at the top of" in said else "whole"
            content = textwrap.dedent(match[3])
            section.blocks.append(Block(match[2], content, named[1] if named else "", place))
        if section.blocks:
            found.append(section)
    return found


def run(page: str, title: str, folder: Path, **environment: str) -> None:
    """Run one section of a page in an empty folder that has the examples, after what those before it write."""
    shutil.copytree(ROOT / "examples", folder / "examples", dirs_exist_ok=True)
    for section in sections(page):
        last = section.title == title
        said = None
        for block in section.blocks:
            if block.file:
                _write(block, folder)
            elif block.language == "sh":
                commands = [line for line in _lines(block.text) if last or _makes(line)]
                said = "".join(_command(line, folder, environment) for line in commands)
            elif block.language == "python" and last:
                said = _told([sys.executable, "-c", _STRICT + block.text], 0, folder, environment)
            elif block.language == "text" and last:
                assert said is not None, f"nothing ran before {block.text!r}"
                _compare(block.text, said)
        if last:
            return
    raise AssertionError(f"no section {title!r} in {page}")


def _write(block: Block, folder: Path) -> None:
    path = folder / block.file
    path.parent.mkdir(parents=True, exist_ok=True)
    before = path.read_text(encoding="utf-8") if block.place != "whole" else ""
    path.write_text(block.text + before if block.place == "top" else before + block.text, encoding="utf-8")


def _makes(line: str) -> bool:
    """Return whether later sections stand on what a command writes."""
    return bool(_MAKES.match(line)) and "--target" not in line and "# exit code" not in line


def _lines(text: str) -> list[str]:
    joined = text.replace("\\\n", " ")
    return [line for line in joined.splitlines() if line.strip() and not line.startswith("#")]


def _command(line: str, folder: Path, environment: dict[str, str]) -> str:
    expected = re.search(r"# exit code (\d+)$", line.rstrip())
    return _told(["bash", "-c", line], int(expected[1]) if expected else 0, folder, environment)


def _told(command: list[str], expected: int, folder: Path, environment: dict[str, str]) -> str:
    """Return all that a command printed; its programs are those beside this Python, its library this tree."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    library = os.pathsep.join(filter(None, [str(ROOT), environment.get("PYTHONPATH", "")]))
    done = subprocess.run(
        command,
        cwd=folder,
        env={**os.environ, "COLUMNS": "160", **environment, "PATH": path, "PYTHONPATH": library},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=PATIENCE_S,
    )
    assert done.returncode == expected, f"{command[-1]}\nended with {done.returncode}:\n{done.stdout}"
    return done.stdout


def _compare(expected: str, said: str) -> None:
    """Raise where a line that the page prints did not come out."""
    flat = " ".join(said.split())
    for line in expected.splitlines():
        wanted = " ".join(line.split())
        assert wanted == "..." or wanted in flat, f"not printed: {wanted!r}; what was:\n{said}"
