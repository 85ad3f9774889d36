"""The report of a run: tables (CSV, JSON, Parquet), Markdown and pictures, all from the stored results."""

from __future__ import annotations

import csv
import importlib.util
import io
import json
import math
from pathlib import Path
from typing import Any

from casadi_gnc.benchmarks import plots
from casadi_gnc.benchmarks.markdown import as_markdown
from casadi_gnc.benchmarks.results import Results
from casadi_gnc.benchmarks.running import left_out
from casadi_gnc.benchmarks.summary import COLUMNS, Overview, alike
from casadi_gnc.system.files import prepare_folder, write_beside


def write_report(found: Overview, folder: Path | None = None) -> list[Path]:
    """Write all files of the report and return their paths.

    Parameters
    ----------
    folder : that of the results by default.
    """
    results = found.results
    folder = prepare_folder(folder or results.folder)
    written = []

    def put(name: str, text: str) -> None:
        write_beside(folder / name, lambda path: path.write_text(text, encoding="utf-8"))
        written.append(folder / name)

    put("summary.csv", as_csv(found.rows))
    put("summary.json", json.dumps(as_data(found), indent=1, allow_nan=False) + "\n")
    if importlib.util.find_spec("pyarrow") is not None:
        written.append(_write_parquet(results, folder / "samples.parquet"))
    pictures = [plots.plot_group(results, group, folder) for group, order in found.orders.items() if order]
    put("report.md", as_markdown(found, pictures))
    return [*written, *pictures]


def as_csv(rows: list[dict[str, Any]]) -> str:
    """Return the rows as a table with a header; empty where there is no value."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for row in rows:
        writer.writerow(["" if row[name] is None else _short(row[name]) for name in COLUMNS])
    return text.getvalue()


def as_data(found: Overview) -> dict[str, Any]:
    """Return everything that the report says as plain data."""
    results = found.results
    return {
        "header": results.header,
        "rows": [{name: _finite(value) for name, value in row.items()} for row in found.rows],
        "ranking": {
            group: [
                {"contestant": who, "ratio_to_last": ratio and [ratio.value, ratio.low, ratio.high]}
                for who, ratio in order
            ]
            for group, order in found.orders.items()
        },
        "alike": {group: alike(order) for group, order in found.orders.items()},
        "left_out": left_out(results),
        "corrupt_lines": [{"line": number, "what": what} for number, what in results.corrupt],
    }


def _short(value: Any) -> Any:
    return f"{value:.6g}" if isinstance(value, float) else value


def _finite(value: Any) -> Any:
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _write_parquet(results: Results, target: Path) -> Path:
    """Write every solve as a row."""
    import pyarrow  # type: ignore[import-not-found]
    from pyarrow import parquet  # type: ignore[import-not-found]

    columns: dict[str, list[Any]] = {}
    for cell in results.cells.values():
        count = len(cell.samples)
        for name in ("contestant", "family", "mode", "number", "started", "memory_MB"):
            columns.setdefault(name, []).extend([getattr(cell, name)] * count)
        for name in ("samples", "seconds", "own", "claimed", "good", "violation", "gap", "iterations"):
            columns.setdefault(name, []).extend(getattr(cell, name))
    write_beside(target, lambda path: parquet.write_table(pyarrow.table(columns), str(path)))
    return target
