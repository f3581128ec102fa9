"""Backtests and audits."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from . import _trueup
from ._trueup import Table
from .document import Document

#: What is told how far a long work is: ``progress(step, done, of)``; `of` is 0 where nobody knows.
Progress = Callable[[str, int, int], Any]


class Backtest:
    """What a backtest came to.

    Attributes
    ----------
    metrics : dict
        The figures of ``run.json``, by name (None: not defined for this run).
    summary : dict
        All of ``run.json`` (schema trueup.run/1): metrics, counts, seed, version, SHA-256 of every input.
    orders, fills, trades, equity : Table
        As the files of these names; ``equity["ts"]`` and ``equity["equity"]`` are NumPy arrays of shape (events,), and each table
        passes to pandas, polars or pyarrow without a copy (``polars.DataFrame(result.fills)``).
    """

    def __init__(self, outputs: _trueup.Outputs):
        self._outputs = outputs
        self.summary: dict[str, Any] = json.loads(outputs.json())
        self.metrics: dict[str, Any] = self.summary["metrics"]

    @property
    def orders(self) -> Table:
        return self._outputs.table("orders")

    @property
    def fills(self) -> Table:
        return self._outputs.table("fills")

    @property
    def trades(self) -> Table:
        return self._outputs.table("trades")

    @property
    def equity(self) -> Table:
        return self._outputs.table("equity")

    def returns(self) -> np.ndarray:
        """Relative changes of equity from point to point, of shape (points - 1,)."""
        equity = self.equity["equity"]
        return np.diff(equity) / equity[:-1]

    def html(self) -> str:
        """The report, a page that opens offline."""
        return self._outputs.html()

    def write(self, folder: os.PathLike | str, *, force: bool = False) -> list[Path]:
        """Write run.json, the tables as Parquet and report.html into `folder`; give their paths. Nothing is written over unless `force`."""
        return [Path(path) for path in self._outputs.write(folder, force)]

    def __repr__(self) -> str:
        return f"<trueup.Backtest of {self.summary['strategy']}: {len(self.fills)} fills, {len(self.equity)} points of equity>"


def backtest(
    run: os.PathLike | str,
    strategy: Any = None,
    *,
    seed: int | None = None,
    values: Mapping[str, Any] | None = None,
    progress: Progress | None = None,
) -> Backtest:
    """Run a strategy on past bars, quotes, trades or books, event by event.

    Parameters
    ----------
    run : path
        RUN.toml: cash, instruments, data, what stands between decision and fill.
    strategy : object with ``on_event(view, orders)``, optional
        A strategy of Python instead of the one that the run names; see `Strategy`. It is called on this thread.
    seed : int, optional
        Seed of all randomness, instead of the run's.
    values : mapping, optional
        Other values by path: ``{"strategy.fast": 12, "mechanism.half_spread.bps": 2.0, "run.cash": 1e5}``.
    progress : callable, optional
        Told how far it is.

    Without a strategy of Python the run holds no lock of Python, so that several go on side by side in threads. Ctrl-C ends it.

    Raises
    ------
    InputError
        What is wrong with the run or its data, with file, place, value and `hint`.
    """
    values = None if values is None else dict(values)
    if strategy is None:
        return Backtest(_trueup.backtest(run, seed, values, progress))
    return Backtest(_trueup.backtest_with(run, strategy, seed, values, progress))


class Audit(Document):
    """What an audit found (schema trueup.audit/1): `verdict` is "clean" where nothing was."""

    @property
    def clean(self) -> bool:
        return self["verdict"] == "clean"


def audit(
    run: os.PathLike | str,
    strategy: Callable[[], Any] | None = None,
    *,
    cuts: int = 30,
    seed: int = 1,
    progress: Progress | None = None,
) -> Audit:
    """Look for lookahead: change the future, and compare every earlier decision bit by bit.

    Parameters
    ----------
    run : path
        RUN.toml.
    strategy : callable, optional
        Makes a strategy of Python, a fresh one at each call (a class derived from `Strategy` is such a callable); without it the
        strategy of the run is audited.
    cuts : int
        Number of instants after which the future is changed.
    seed : int
        Seed of the instants and of the other futures.
    """
    return Audit.of_text(_trueup.audit_with(run, strategy, cuts, seed, progress))
