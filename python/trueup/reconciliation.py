"""Backtests beside paper logs."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from . import _trueup
from .document import Document
from .errors import Mismatch
from .recording import as_paths
from .run import Backtest, Progress


class Reconciliation(Document):
    """A backtest beside a paper log, order by order (schema trueup.reconcile/1). `within` says whether all bounds of the call hold."""

    within: bool = True


def reconcile(
    backtest: Backtest | os.PathLike | str | None,
    paper: Any,
    *,
    run: os.PathLike | str | None = None,
    tolerance: Mapping[str, float] | os.PathLike | str | None = None,
    format: str | None = None,
    symbols: os.PathLike | str | None = None,
    zone: str | None = None,
    fee_rates: Iterable[str] = (),
    correct_clock: bool = False,
    out: os.PathLike | str | None = None,
    force: bool = False,
    seed: int = 1,
    progress: Progress | None = None,
) -> Reconciliation:
    """Compare a backtest with a paper log, order by order: where they part, by how much, and why.

    Parameters
    ----------
    backtest : Backtest, path of the folder that one wrote, or None
        None takes the log's own orders as the simulator of `run` executes them.
    paper : path, ExecutionLog, or several paths
        The paper log: files of a broker or a bot, or a folder of them.
    run : path, optional
        RUN.toml of the backtest: its simulator executes the paper log's orders, which tells decision from execution.
    tolerance : mapping or path, optional
        How far the two may part: ``{"unmatched": 0, "mean_price_bps": 1.0}``.
    format, symbols, zone, fee_rates
        How the log is read, where it does not say so itself.
    """
    with as_paths(paper) as logs, tempfile.TemporaryDirectory(prefix="trueup-") as spare:
        line = ["reconcile", "--json", f"--seed={seed}", *(f"--paper={path}" for path in logs)]
        if isinstance(backtest, Backtest):
            folder = Path(spare) / "backtest"
            backtest.write(folder)
            line.append(f"--backtest={folder}")
        elif backtest is not None:
            line.append(f"--backtest={os.fspath(backtest)}")
        if isinstance(tolerance, Mapping):
            line += [f"--tolerance={key}={value!r}" for key, value in tolerance.items()]
        elif tolerance is not None:
            line.append(f"--tolerance={os.fspath(tolerance)}")
        options = {"run": run, "format": format, "symbols": symbols, "zone": zone, "out": out}
        line += [f"--{name}={os.fspath(value)}" for name, value in options.items() if value is not None]
        line += [f"--fee-rate={rate}" for rate in fee_rates]
        line += ["--correct-clock"] * correct_clock + ["--force"] * force
        text, beyond = _trueup.answer(line, progress)
        reconciliation = Reconciliation.of_text(text)
        reconciliation.within = not beyond
        return reconciliation


def assert_reconciles(
    backtest: Backtest | os.PathLike | str | None,
    paper: Any,
    *,
    tolerance: Mapping[str, float] | os.PathLike | str,
    **arguments: Any,
) -> Reconciliation:
    """For tests: `reconcile`, and raise `Mismatch` (an AssertionError) where a bound of `tolerance` does not hold.

    >>> def test_paper_is_as_backtested():                                       # doctest: +SKIP
    ...     trueup.assert_reconciles(trueup.backtest("run.toml"), "logs/paper", tolerance={"unmatched": 0, "mean_price_bps": 1})
    """
    reconciliation = reconcile(backtest, paper, tolerance=tolerance, **arguments)
    if not reconciliation.within:
        bounds = tolerance if not isinstance(tolerance, Mapping) else ", ".join(f"{key} <= {value}" for key, value in tolerance.items())
        raise Mismatch(f"the two part further than {bounds}: {reconciliation['summary']}", reconciliation)
    return reconciliation
