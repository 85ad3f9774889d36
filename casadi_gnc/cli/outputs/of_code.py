"""What commands about flight C print."""

from __future__ import annotations

from typing import Any, NotRequired

from pydantic import ConfigDict, with_config
from typing_extensions import TypedDict

_TOLD = with_config(ConfigDict(use_attribute_docstrings=True))


@_TOLD
class Generated(TypedDict):
    """A package or a unit that was written."""

    wrote: list[str]
    """The folder of a package, or the file of a unit."""
    manifest: dict[str, Any] | None
    """Of a package: what stands in its manifest.json."""
    warnings: list[str]


@_TOLD
class SignalWords(TypedDict):
    """Differences of one output."""

    signal: str
    unit: str
    count: int
    words: int
    """That differ."""
    ulp: float
    """Largest difference, in units in the last place."""
    absolute: float
    relative: float
    """Of the largest value."""


@_TOLD
class Comparison(TypedDict):
    """Two runs word by word."""

    what: str
    exact: bool
    """Whether words must be the same."""
    words: int
    of: int
    signals: list[SignalWords]


@_TOLD
class Target(TypedDict):
    """Measures on an emulated target."""

    target: str
    title: str
    steps: int
    instructions_median: int
    instructions_worst: int
    instructions_first: int
    instructions_init: int
    instructions_bound: int | None
    """None takes more; null where none is proved, and the next key says why."""
    instructions_bound_missing: str
    instructions_climbed: int | None
    """The dearest step that a search found."""
    instructions_climbed_steps: int
    stack_step_bytes: int
    stack_init_bytes: int
    stack_step_bound_bytes: int | None
    stack_deepest_calls: list[str]
    stack_not_counted: list[str]
    state_bytes: int
    params_bytes: int
    text_bytes: int
    data_bytes: int
    bss_bytes: int
    compiler: str


@_TOLD
class Verification(TypedDict):
    """A package against what it was made of, other compilers and targets."""

    package: str
    title: str
    scheme: str | None
    real: str
    steps: int
    edited: list[str]
    warnings: list[str]
    not_regenerated: list[str]
    """Files that this version writes otherwise."""
    made_by_this_version: bool
    comparisons: list[Comparison]
    targets: list[Target]
    not_installed: dict[str, list[str]]
    words: int
    """That differ where none may."""
    is_sound: bool
    problem: NotRequired[str]
