"""The deepest stack of a call, from the compiler's own frames and call graph.

gcc's `-fcallgraph-info=su` writes for each object file its functions, the bytes of their frames and
whom they call. Without recursion the functions form a tree of finite depth, and the largest sum of
frames on a way down is a bound for every input. Functions of the compiler's library have no frame
there; they count as nothing and are named.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from casadi_gnc.errors import TargetError

_NODE = re.compile(r'^node: \{ title: "(?P<name>[^"]+)" label: "[^"]*\\n(?P<bytes>\d+) bytes \((?P<kind>[^)]*)\)')
_EDGE = re.compile(r'^edge: \{ sourcename: "(?P<caller>[^"]+)" targetname: "(?P<called>[^"]+)"')


@dataclass(frozen=True)
class Stack:
    """Hold the bound of one entry.

    Parameters
    ----------
    bytes : sum of frames on the deepest way.
    way : the functions on it, the entry first.
    unknown : functions that were called and whose frames are not known.
    """

    bytes: int
    way: tuple[str, ...]
    unknown: tuple[str, ...]


def deepest(reports: list[Path], entry: str) -> Stack:
    """Return the bound of a function.

    Parameters
    ----------
    reports : the .ci files of all objects.
    entry : name of the function.

    Raises
    ------
    TargetError
        If functions call each other in a circle, or a frame has no fixed size.
    """
    frames: dict[str, int] = {}
    calls: dict[str, set[str]] = {}
    for report in reports:
        for line in report.read_text(encoding="utf-8").splitlines():
            node, edge = _NODE.match(line), _EDGE.match(line)
            if node:
                if node["kind"] not in ("static", "dynamic,bounded"):
                    raise TargetError(f"{node['name']} has a frame without a fixed size")
                frames[node["name"]] = int(node["bytes"])
            elif edge:
                calls.setdefault(edge["caller"], set()).add(edge["called"])
    known: dict[str, tuple[int, tuple[str, ...]]] = {}
    unknown: set[str] = set()

    def visit(name: str, above: tuple[str, ...]) -> tuple[int, tuple[str, ...]]:
        if name in above:
            raise TargetError(f"recursion: {' calls '.join((*above[above.index(name) :], name))}")
        if name not in frames:
            unknown.add(name)
            return 0, ()
        if name not in known:
            below = [visit(called, (*above, name)) for called in sorted(calls.get(name, ()))]
            size, way = max(below, key=lambda found: found[0], default=(0, ()))
            known[name] = (frames[name] + size, (name, *way))
        return known[name]

    if entry not in frames:
        raise TargetError(f"the compiler reports no frame of {entry}")
    size, way = visit(entry, ())
    return Stack(size, tuple(one.rsplit(":", 1)[-1] for one in way), tuple(sorted(unknown)))
