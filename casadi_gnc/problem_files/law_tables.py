"""The table of a law: made from the gains and options that the law declares where it uses them."""

from __future__ import annotations

import dataclasses
from functools import lru_cache
from typing import Annotated, Any, Literal

from pydantic import Field, create_model

from casadi_gnc.laws import Law, gains_of
from casadi_gnc.tables.part import Part


@lru_cache(maxsize=256)
def law_table(law: type[Law]) -> type[Part]:
    """Return the model of a law's gains and options, without the key `type` that names the law."""
    fields: dict[str, Any] = {key: _field(declared) for key, declared in gains_of(law).items()}
    about = (law.__doc__ or law.__name__).strip().splitlines()[0]
    return create_model(f"{law.__name__}Gains", __base__=Part, __doc__=f"Gains of a law: {about}", **fields)


def _field(declared: dataclasses.Field) -> tuple[Any, Any]:
    """Return type and description of a gain or an option."""
    about = declared.metadata
    default = ... if declared.default is dataclasses.MISSING else declared.default
    if "choices" in about:
        kind: Any = bool if True in about["choices"] else Literal[about["choices"]]
        return kind, Field(default, description=about["note"])
    bounds = {"ge": about["minimum"], "gt": about["above"]}
    kind = Annotated[float, Field(**{k: v for k, v in bounds.items() if v is not None})]
    for size in reversed(about["size"] if isinstance(about["size"], tuple) else (about["size"],)):
        kind = kind if size == 1 else Annotated[list[kind], Field(min_length=size, max_length=size)]
    if declared.default is None:
        kind = kind | None
    symbol = f"{about['symbol']}, " if about["symbol"] else ""
    text = f"{symbol}{about['note']}" + (f" [{about['unit']}]" if about["unit"] else "")
    return kind, Field(default, description=text)
