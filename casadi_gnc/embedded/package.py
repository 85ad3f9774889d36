"""Make a package of a controller: a folder that an embedded project takes as it is.

A folder that was made before is replaced only if nobody changed a file of it since: `manifest.json`
holds the hash of each. Everything is written beside the folder and put in its place at one moment, so nothing is half
done and nobody else's file is ever anywhere but where it was.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.embedded.controller import Controller, Options
from casadi_gnc.embedded.manifest import BUILD, MANIFEST, digest, edited, read_manifest
from casadi_gnc.embedded.members import access
from casadi_gnc.embedded.monitor_source import monitor_files
from casadi_gnc.embedded.source import allocator_files, render_header, render_source, runtime_files
from casadi_gnc.errors import OutputError
from casadi_gnc.system import assets, temporary
from casadi_gnc.system.exchange import replace_folder
from casadi_gnc.system.templates import template


def flight_files(controller: Controller, options: Options) -> dict[str, str]:
    """Return the files that fly: path inside the package -> text."""
    name = options.name
    source = render_source(controller, options)
    files = {f"{name}.h": render_header(controller, options, digest(source)), f"{name}.c": source}
    files |= allocator_files(controller, options)
    files |= monitor_files(controller, options)
    runtime = assets.folder("codegen") / "runtime"
    files |= {file: (runtime / file).read_text(encoding="utf-8") for file in runtime_files(controller, options)}
    files["LICENSE"] = (assets.folder("codegen") / "LICENSE").read_text(encoding="utf-8")
    return files


def replay_header(controller: Controller, options: Options, steps: int) -> str:
    """Return `test/replay.h`, which names the words of inputs and outputs."""
    watched = [one.name for one in controller.monitor.watched] if controller.monitor is not None else []
    outputs = access(controller.outputs, "output->step." if watched else "output->")
    for i in range(len(watched)):
        outputs += [f"output->seen[{i}].robustness", f"({options.name}_real)output->seen[{i}].verdict"]
    return template("package_replay.h.j2").render(
        name=options.name,
        bits=64 if options.real == "double" else 32,
        steps=steps,
        inputs=["input->time", *access(controller.measured, "input->")],
        outputs=outputs,
        watched=watched,
        status="output->step.status" if watched else "output->status",
    )  # fmt: skip


def replay_files(
    controller: Controller, options: Options, inputs: np.ndarray, outputs: np.ndarray, spoiled: int
) -> dict[str, str]:
    """Return the replay program, its vectors (rows of words) and the files that build it."""
    units = [f"{options.name}.c", *allocator_files(controller, options)]
    units += [file for file in monitor_files(controller, options) if file.endswith(".c")]
    header = replay_header(controller, options, len(inputs))
    what = "a closed loop with the simulated craft"
    what += f", the last {spoiled} with bad measurements" if spoiled else ""
    return replay_texts(options, units, header, inputs, outputs, what)


def replay_texts(
    options: Options, units: list[str], header: str, inputs: np.ndarray, outputs: np.ndarray, what: str
) -> dict[str, str]:
    """Return the replay program of any package; `what` says what its vectors are samples of."""
    about = {"name": options.name, "units": units, "bits": 64 if options.real == "double" else 32}
    vectors = {"inputs": _rows(inputs), "outputs": _rows(outputs), "steps": len(inputs)}
    return {
        "test/replay.h": header,
        "test/replay.c": template("package_replay.c.j2").render(**about),
        "test/vectors.c": template("package_vectors.c.j2").render(**about, **vectors, what=what),
        "Makefile": template("package_makefile.j2").render(**about),
        "CMakeLists.txt": template("package_cmake.j2").render(**about),
    }


def _rows(words: np.ndarray) -> list[str]:
    ending = "u" if words.dtype == np.uint32 else "ull"
    return [", ".join(f"0x{int(word):x}{ending}" for word in row) for row in words]


def manifest(files: dict[str, str], about: dict[str, Any]) -> str:
    """Return the text of the manifest: what the package was made of, and the hash of each file. No date."""
    hashes = {path: digest(text) for path, text in sorted(files.items())}
    return json.dumps({"format": 1, **about, "files": hashes}, indent=2) + "\n"


def check_room(folder: Path, force: bool = False) -> None:
    """Raise `OutputError` if a package may not be written there; called before any work is done."""
    if not folder.exists():
        return
    if not folder.is_dir():
        raise OutputError(f"{folder} is a file; choose another --out")
    if not any(folder.iterdir()):
        return
    if not (folder / MANIFEST).is_file():
        raise OutputError(f"{folder} is not empty and is no package; choose a new folder with --out")
    # A file that was added is the user's own and stays; only what would be lost is in the way.
    changes = [change for change in edited(folder) if not change.endswith("(added)")]
    if changes and not force:
        more = f" and {len(changes) - 3} more" if len(changes) > 3 else ""
        raise OutputError(
            f"{folder} was edited since it was generated: {', '.join(changes[:3])}{more}; "
            "move your changes away, or use --force to overwrite (files of your own are kept)"
        )


def write(folder: Path, build: Callable[[Path], dict[str, str]], *, force: bool = False) -> None:
    """Write a package.

    Parameters
    ----------
    folder : replaced as a whole; files of the user's own stay in it.
    build : called on an empty workshop beside `folder`; returns path -> text of all files.
    force : overwrite files that were edited.

    Raises
    ------
    OutputError
        Where the folder is something else, was edited, or cannot be written; it is left as it was.
    """
    check_room(folder, force)
    folder = folder.resolve()
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with temporary.folder(folder.parent, folder.name) as place:
            workshop, fresh = place / "work", place / "new"
            workshop.mkdir()
            files = build(workshop)
            put(fresh, files)
            exists = folder.exists() and any(folder.iterdir())
            ours = set(read_manifest(folder).files) if exists else set()
            if exists:
                ours |= {path.relative_to(folder).as_posix() for path in (folder / BUILD).rglob("*")} | {BUILD}
            replace_folder(fresh, folder, ours, MANIFEST)
    except OSError as error:
        raise OutputError(f"cannot write {folder}: {error.strerror or error}; choose another --out") from error


def put(folder: Path, files: dict[str, str]) -> None:
    """Write texts under a folder."""
    for path, text in files.items():
        target = folder / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(text, encoding="utf-8", newline="\n")
