"""Recordings: what was measured, from memory or from files."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from . import _trueup
from .errors import InputError

#: What columns may be given as: a mapping of arrays, a DataFrame of pandas or polars, a table of pyarrow, or whatever else has
#: ``__arrow_c_stream__``.
Table = Any


def _array(name: str, values: Any) -> np.ndarray | list:
    """One column: float64, int64, datetime64[ns] or a list of texts."""
    values = np.asarray(values)
    if values.ndim != 1:
        raise InputError(
            f"column `{name}` has the shape {values.shape}\n  hint: give one value a row",
            hint="give one value a row",
            column=name,
        )
    if values.dtype.kind == "M":
        return values.astype("datetime64[ns]")
    if values.dtype.kind == "f":
        return np.ascontiguousarray(values, dtype=np.float64)
    if values.dtype.kind in "iu":
        return np.ascontiguousarray(values, dtype=np.int64)
    if values.dtype.kind == "b":
        return values.astype(np.float64)
    texts = values.tolist()
    if all(isinstance(text, str) or text is None for text in texts):
        return texts
    with contextlib.suppress(TypeError, ValueError):
        return np.array([np.nan if value is None else float(value) for value in texts])
    raise InputError(
        f"column `{name}` holds neither numbers nor times nor texts\n  hint: convert it, or leave it out",
        hint="convert it, or leave it out",
        column=name,
    )


def columns_of(table: Table) -> dict[str, Any]:
    """The columns of a table, by name.

    Arrays of float64 that lie in one piece are taken as they are and not copied; so are the columns of pandas that are such. What comes
    by Arrow (polars, pyarrow) is copied once, for a recording says with NaN what Arrow says with a bitmap.
    """
    if isinstance(table, Recording):
        return dict(table.columns)
    if isinstance(table, Mapping):
        return {str(name): _array(str(name), values) for name, values in table.items()}
    # pandas, without pyarrow
    if hasattr(table, "to_numpy") and hasattr(table, "columns") and hasattr(table, "loc"):
        return {str(name): _array(str(name), table[name].to_numpy()) for name in table.columns}
    if hasattr(table, "__arrow_c_stream__"):
        return {name: _array(name, values) for name, values in _trueup.columns_of(table).items()}
    raise InputError(
        f"a table is expected, found {type(table).__name__}\n  hint: give a dict of arrays, a DataFrame, or what has __arrow_c_stream__",
        hint="give a dict of arrays, a DataFrame, or what has __arrow_c_stream__",
    )


def write_table(path: os.PathLike | str, table: Table, *, force: bool = False) -> None:
    """Write a table into a file: CSV or Parquet, by the ending of its name. Nothing is written over unless `force`."""
    columns, times = {}, set()
    for name, values in columns_of(table).items():
        if isinstance(values, np.ndarray) and values.dtype.kind == "M":
            times.add(name)
            values = values.view(np.int64)
        columns[name] = values
    _trueup.write_columns(path, columns, times, force)


class Recording:
    """A trajectory that was measured: the time, commands and channels, a row a sample.

    Parameters
    ----------
    columns : mapping, DataFrame, or Arrow stream
        Columns by name, each of shape (rows,). ``t`` is the time [s] and increases strictly; NaN stands for a lost sample.
    name : str
        What to call it in reports.

    A command in a row is in force from that row's time on; what is observed in a row was observed before that command has acted.
    """

    def __init__(self, columns: Table, name: str = "recording"):
        self.columns = columns_of(columns)
        self.name = str(name)
        lengths = {key: len(values) for key, values in self.columns.items()}
        if not lengths:
            raise InputError(
                "a recording without columns\n  hint: give at least t, a command and a channel",
                hint="give at least t, a command and a channel",
            )
        if len(set(lengths.values())) > 1:
            told = ", ".join(f"{key}: {length}" for key, length in lengths.items())
            raise InputError(
                f"columns differ in length ({told})\n  hint: give one value a row in every column",
                hint="give one value a row in every column",
            )

    @classmethod
    def read(cls, path: os.PathLike | str) -> Recording:
        """Read the numeric columns of a file: CSV (``.csv``, ``.csv.gz``), Parquet or Arrow."""
        return cls(_trueup.read_columns(path), name=Path(path).name)

    def __getitem__(self, name: str) -> np.ndarray:
        """A column, of shape (rows,)."""
        try:
            return self.columns[name]
        except KeyError:
            raise KeyError(f"there is no column `{name}`; there are {', '.join(self.columns)}") from None

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    def __repr__(self) -> str:
        return f"<trueup.Recording {self.name!r} of {len(self)} rows: {', '.join(self.columns)}>"


class ExecutionLog:
    """A log of orders in memory: the tables that a folder of an execution recording holds.

    Parameters
    ----------
    orders, fills : table
        As docs/paper_logs.md has them: `order_id, symbol, decided_at, side, qty, type, ...` and `order_id, filled_at, qty, price, fee`.
    quotes, trades, bars : table, optional
        The market they met, where the twin names none.
    name : str
        What to call it in reports.
    """

    def __init__(
        self,
        orders: Table,
        fills: Table,
        *,
        quotes: Table = None,
        trades: Table = None,
        bars: Table = None,
        name: str = "log",
    ):
        given = {"orders": orders, "fills": fills, "quotes": quotes, "trades": trades, "bars": bars}
        self.tables = {key: columns_of(table) for key, table in given.items() if table is not None}
        self.name = str(name)


@contextlib.contextmanager
def as_paths(recordings: Any) -> Iterator[list[str]]:
    """Paths of recordings. Those in memory are written into a folder for as long as this lasts, so that they are held to the same
    rules as files are; errors name them as they are called."""
    if recordings is None:
        recordings = []
    if isinstance(recordings, (str, os.PathLike, Recording, ExecutionLog, Mapping)) or hasattr(recordings, "__arrow_c_stream__"):
        recordings = [recordings]
    with contextlib.ExitStack() as stack:
        folder, paths = None, []
        for number, recording in enumerate(recordings):
            if isinstance(recording, (str, os.PathLike)):
                paths.append(os.fspath(recording))
                continue
            if folder is None:
                folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="trueup-")))
            # A folder for each, for two may be called the same.
            place = folder / str(number)
            place.mkdir()
            if isinstance(recording, ExecutionLog):
                target = place / _file_name(recording.name)
                target.mkdir()
                for stem, columns in recording.tables.items():
                    write_table(target / f"{stem}.parquet", columns)
            else:
                recording = recording if isinstance(recording, Recording) else Recording(recording, name=f"recording {number + 1}")
                name = _file_name(recording.name)
                target = place / (name if name.endswith(".parquet") else f"{name}.parquet")
                write_table(target, recording.columns)
            paths.append(str(target))
        try:
            yield paths
        except InputError as error:
            if folder is not None and error.path and error.path.startswith(str(folder)):
                shown = str(Path(*Path(error.path).relative_to(folder).parts[1:]))
                error.args = (str(error).replace(error.path, f"<{shown}>"),)
                error.path = shown
            raise


def _file_name(name: str) -> str:
    return "".join("_" if letter in "/\\:\0" else letter for letter in name) or "recording"
