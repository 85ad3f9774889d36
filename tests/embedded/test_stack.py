"""The bound of the stack, from call graphs known by hand."""

import pytest

from casadi_gnc.embedded.stack import deepest
from casadi_gnc.errors import TargetError


def node(name, size=None, kind="static"):
    told = rf"\n{size} bytes ({kind})" if size is not None else ""
    return rf'node: {{ title: "{name}" label: "{name}\nfile.c:3:1{told}" }}' + "\n"


def edge(a, b):
    return f'edge: {{ sourcename: "{a}" targetname: "{b}" label: "file.c:5:9" }}\n'


def report(tmp_path, text):
    path = tmp_path / "file.ci"
    path.write_text('graph: { title: "file.c"\n' + text + "}\n")
    return [path]


def test_deepest_way_wins_and_diamonds_count_once(tmp_path):
    text = node("step", 100) + node("a", 10) + node("b", 300) + node("c", 7) + node("memset")
    text += edge("step", "a") + edge("step", "b") + edge("a", "c") + edge("b", "c") + edge("c", "memset")
    found = deepest(report(tmp_path, text), "step")
    assert (found.bytes, found.way, found.unknown) == (407, ("step", "b", "c"), ("memset",))


def test_recursion_is_refused(tmp_path):
    text = node("step", 8) + node("a", 8) + edge("step", "a") + edge("a", "step")
    with pytest.raises(TargetError, match="recursion: step calls a calls step"):
        deepest(report(tmp_path, text), "step")


def test_frames_without_a_size_are_refused(tmp_path):
    with pytest.raises(TargetError, match="without a fixed size"):
        deepest(report(tmp_path, node("step", 8, "dynamic")), "step")
    with pytest.raises(TargetError, match="no frame of step"):
        deepest(report(tmp_path, node("other", 8)), "step")
