"""Backtests: figures and tables, strategies of Python, audits, errors."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import trueup


class SmaCross(trueup.Strategy):
    """The crossover that is compiled in, written again: sums of closes as whole numbers, which are exact."""

    def __init__(self, fast: int = 10, slow: int = 50, weight: float = 0.99):
        self.fast, self.slow, self.weight = fast, slow, weight
        self.lookback = slow + 1
        self.seen = 0

    def on_event(self, view, orders):
        if view.event != "bar":
            return
        self.seen += 1
        if self.seen < self.slow:
            return
        closes = view.bars().close_nanos
        ahead = int(closes[-self.fast :].sum()) * self.slow - int(closes[-self.slow :].sum()) * self.fast
        if ahead == 0:
            return
        wanted = 1 if ahead > 0 else 0
        if np.sign(view.position() + view.working()) == wanted:
            return
        size = view.lots_worth(self.weight / len(view.symbols) * view.equity)
        orders.to_position(view, view.instrument, size * wanted)


def test_a_backtest_gives_figures_and_tables(bars_run):
    result = trueup.backtest(bars_run)
    assert result.summary["schema"] == "trueup.run/1"
    assert result.metrics == result.summary["metrics"]
    equity = result.equity
    assert equity["ts"].dtype == "datetime64[ns]" and equity["equity"].dtype == np.float64
    assert len(equity) == len(equity["equity"]) > 1000
    assert set(result.fills.columns) >= {"order_id", "filled_at", "qty", "price", "fee"}
    assert result.orders["side"].dtype == object and set(result.orders["side"]) == {"buy", "sell"}
    assert len(result.returns()) == len(equity) - 1
    assert "<html" in result.html()


def test_a_strategy_of_python_does_to_the_bit_what_the_compiled_one_does(bars_run):
    compiled, scripted = trueup.backtest(bars_run), trueup.backtest(bars_run, SmaCross())
    assert scripted.summary["strategy"] == "SmaCross"
    assert len(compiled.fills) > 10
    for table in ("orders", "fills", "equity", "trades"):
        ours, theirs = getattr(scripted, table).to_numpy(), getattr(compiled, table).to_numpy()
        assert ours.keys() == theirs.keys()
        for name in ours.keys() - {"strategy"}:
            same = ours[name].tobytes() == theirs[name].tobytes() if ours[name].dtype != object else list(ours[name]) == list(theirs[name])
            assert same, (table, name)


def test_the_same_run_gives_the_same_bits_and_values_change_it(bars_run):
    first, again = trueup.backtest(bars_run), trueup.backtest(bars_run)
    assert first.equity["equity"].tobytes() == again.equity["equity"].tobytes()
    other = trueup.backtest(bars_run, values={"strategy.fast": 20, "mechanism.half_spread.bps": 3.0})
    assert other.equity["equity"].tobytes() != first.equity["equity"].tobytes()
    with pytest.raises(trueup.InputError, match="hint"):
        trueup.backtest(bars_run, values={"strategy.fsat": 20})
    with pytest.raises(trueup.InputError, match="number, a truth value or a text"):
        trueup.backtest(bars_run, values={"strategy.fast": [1, 2]})


def test_what_is_written_is_what_the_command_writes(bars_run, tmp_path):
    paths = trueup.backtest(bars_run).write(tmp_path / "ours")
    assert {path.name for path in paths} >= {"run.json", "fills.parquet", "equity.parquet", "report.html"}
    done = subprocess.run(
        [sys.executable, "-m", "trueup", "backtest", str(bars_run), "--out", str(tmp_path / "theirs")], capture_output=True
    )
    assert done.returncode == 0, done.stderr
    for path in paths:
        assert path.read_bytes() == (tmp_path / "theirs" / path.name).read_bytes(), path.name
    with pytest.raises(trueup.InputError, match="exists already"):
        trueup.backtest(bars_run).write(tmp_path / "ours")
    trueup.backtest(bars_run).write(tmp_path / "ours", force=True)


def test_the_command_line_has_its_exit_codes():
    run = [sys.executable, "-m", "trueup"]
    assert subprocess.run([*run, "mechanisms"], capture_output=True).returncode == 0
    missing = subprocess.run([*run, "audit", "nowhere.toml"], capture_output=True, text=True)
    assert missing.returncode == 2 and "there is no such file" in missing.stderr


def test_bad_input_says_where_and_what_to_do(bars_run, tmp_path):
    with pytest.raises(FileNotFoundError) as missing:
        trueup.backtest(tmp_path / "nowhere.toml")
    assert isinstance(missing.value, trueup.InputError) and missing.value.path.endswith("nowhere.toml")
    text = (
        bars_run.read_text()
        .replace('kind = "sma_cross"', 'kind = "sma_corss"')
        .replace("bars.parquet", str(bars_run.parent / "bars.parquet"))
    )
    (tmp_path / "run.toml").write_text(text)
    with pytest.raises(trueup.InputError) as wrong:
        trueup.backtest(tmp_path / "run.toml")
    assert "sma_cross" in wrong.value.hint and wrong.value.path.endswith("run.toml")
    assert "hint:" in str(wrong.value)
    import copy
    import pickle

    again = pickle.loads(pickle.dumps(wrong.value))
    assert (again.hint, again.path, str(again)) == (wrong.value.hint, wrong.value.path, str(wrong.value))
    assert isinstance(pickle.loads(pickle.dumps(missing.value)), FileNotFoundError)
    assert copy.copy(wrong.value).hint == wrong.value.hint


def test_what_a_strategy_raises_reaches_the_caller_with_a_note(bars_run):
    class Faulty(trueup.Strategy):
        calls = 0

        def on_event(self, view, orders):
            self.calls += 1
            if self.calls == 100:
                raise ZeroDivisionError("by intent")

    strategy = Faulty()
    with pytest.raises(ZeroDivisionError, match="by intent") as raised:
        trueup.backtest(bars_run, strategy)
    assert strategy.calls == 100, "it is not called again"
    assert any("Faulty.on_event" in note and "XYZ" in note for note in raised.value.__notes__)


@pytest.mark.parametrize(
    ("strategy", "words"),
    [
        (object(), "on_event"),
        (type("S", (trueup.Strategy,), {"lookback": 0})(), "lookback"),
        (type("S", (trueup.Strategy,), {"lookback": "x"})(), "lookback"),
    ],
)
def test_what_is_no_strategy_is_refused(bars_run, strategy, words):
    with pytest.raises(trueup.InputError, match=words):
        trueup.backtest(bars_run, strategy)


def test_orders_that_cannot_be_are_refused_where_they_are_asked_for(bars_run):
    class Asks(trueup.Strategy):
        def __init__(self, ask):
            self.ask = ask

        def on_event(self, view, orders):
            self.ask(view, orders)

    def refused(ask, words):
        with pytest.raises(trueup.InputError, match=words) as error:
            trueup.backtest(bars_run, Asks(ask))
        assert error.value.hint

    refused(lambda view, orders: orders.market("ABC", "buy", 1), "no instrument 'ABC'")
    refused(lambda view, orders: orders.market(1, "buy", 1), "no instrument 1")
    refused(lambda view, orders: orders.market(-1, "buy", 1), "no instrument -1")
    refused(lambda view, orders: orders.market(0, "long", 1), "no side")
    refused(lambda view, orders: orders.market(0, "buy", float("nan")), "quantity is NaN")
    refused(lambda view, orders: orders.market(0, "buy", 1e300), "beyond")
    refused(lambda view, orders: orders.limit(0, "buy", 1, float("inf")), "price is inf")
    refused(lambda view, orders: orders.submit(0, "buy", 1, "limit"), "needs `limit`")
    refused(lambda view, orders: orders.submit(0, "buy", 1, "iceberg"), "no order of type")
    refused(lambda view, orders: orders.submit(0, "buy", 1, time_in_force="ever"), "time in force")
    refused(lambda view, orders: orders.submit(0, "buy", 1, condition="maybe"), "no condition")
    refused(lambda view, orders: view.bars("ABC"), "no instrument 'ABC'")
    refused(lambda view, orders: view.best("up"), "no side")


def test_orders_are_of_no_use_after_their_event(bars_run):
    kept = []

    class Keeps(trueup.Strategy):
        def on_event(self, view, orders):
            if kept:
                kept[0].market(0, "buy", 1)
            kept.append(orders)

    with pytest.raises(trueup.InputError, match="event that is over"):
        trueup.backtest(bars_run, Keeps())


def test_a_view_may_be_kept_and_does_not_change(bars_run):
    views = []

    class Keeps(trueup.Strategy):
        lookback = 3
        notices = []

        def on_event(self, view, orders):
            views.append((view, view.bars().close, view.now))
            if len(views) == 5:
                orders.market("XYZ", "buy", 10)
            if len(views) == 6:
                orders.submit("XYZ", "sell", 10, "limit", limit=round(view.price() * 1.5, 2))

        def on_notice(self, view, notice, orders):
            self.notices.append(notice)

    strategy = Keeps()
    result = trueup.backtest(bars_run, strategy)
    assert len(result.orders) == 2
    for view, closes, now in views[:50]:
        assert np.array_equal(view.bars().close, closes) and view.now == now
        assert len(closes) <= 3 and view.price() == closes[-1]
        bars = view.bars(0)
        assert np.all(bars.low <= bars.open) and np.all(bars.open <= bars.high) and np.all(bars.known_at > bars.open_at)
    times = [now for _, _, now in views]
    assert times == sorted(times) and views[0][0].symbols == ("XYZ",)
    assert strategy.notices[0]["what"] == "filled" and strategy.notices[0]["quantity"] == 10
    assert views[-1][0].position("XYZ") == 10
    resting = views[-1][0].orders("XYZ")
    assert [order["type"] for order in resting] == ["limit"] and resting[0]["left"] == 10


def test_an_audit_finds_what_sees_the_future_and_nothing_else(bars_run):
    assert trueup.audit(bars_run, cuts=4).clean
    assert trueup.audit(bars_run, SmaCross, cuts=4).clean

    prices = {}

    class Peeks(trueup.Strategy):
        """Keeps what it saw at all times, of all runs, and trades on what came next then."""

        def on_event(self, view, orders):
            later = prices.get(view.now + 60_000_000_000)
            prices[view.now] = view.price()
            if later is not None:
                orders.to_position(view, 0, 100.0 if later > view.price() else 0.0)

    trueup.backtest(bars_run, Peeks())
    found = trueup.audit(bars_run, Peeks, cuts=6)
    assert not found.clean and found.verdict != "clean"


def test_an_audit_raises_what_the_strategy_raises(bars_run):
    class Faulty(trueup.Strategy):
        def on_event(self, view, orders):
            raise LookupError("by intent")

    with pytest.raises(LookupError, match="by intent"):
        trueup.audit(bars_run, Faulty, cuts=2)
    with pytest.raises(TypeError):
        trueup.audit(bars_run, lambda: 1 + "x", cuts=2)


def test_long_work_leaves_python_to_others(bars_run):
    counted, stop = [0], threading.Event()

    def count():
        while not stop.is_set():
            counted[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    # Work that lasts a while on this machine: whoever kept the lock would keep the other thread waiting all that time.
    cuts, lasted, during = 10, 0.0, 0
    while lasted < 0.3:
        before, began = counted[0], time.perf_counter()
        trueup.audit(bars_run, cuts=cuts)
        during, lasted, cuts = counted[0] - before, time.perf_counter() - began, 2 * cuts
    stop.set()
    thread.join()
    assert during > 20, f"the other thread has hardly run: {during} times in {lasted:.2f} s"


def test_ctrl_c_ends_long_work(bars_run):
    program = (
        "import os, signal, threading, trueup\n"
        # Whoever runs the tests may have told that signal to be ignored.
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()\n"
        "try:\n"
        f"    trueup.audit({str(bars_run)!r}, cuts=10_000)\n"
        "except KeyboardInterrupt:\n"
        "    print('interrupted')\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert done.stdout == "interrupted\n", done.stderr


def test_progress_is_told_and_may_end_the_work(bars_run):
    told = []
    trueup.backtest(bars_run, progress=lambda step, done, of: told.append((step, done, of)))
    assert told and told[0][0] == "running"

    def stop(step, done, of):
        raise InterruptedError("enough")

    with pytest.raises(InterruptedError, match="enough"):
        trueup.backtest(bars_run, progress=stop)
    with pytest.raises(InterruptedError, match="enough"):
        trueup.audit(bars_run, progress=stop)


def test_json_of_a_document_reads_back(bars_run):
    audit = trueup.audit(bars_run, cuts=2)
    assert json.loads(audit.to_json()) == audit.to_dict()
    assert audit["schema"] == audit.schema == "trueup.audit/1"
    with pytest.raises(AttributeError, match="there are"):
        audit.verdcit
