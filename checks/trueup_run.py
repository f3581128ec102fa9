"""Runs `trueup backtest` on a generated market and reads what it wrote."""

import subprocess
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from books import Books, Fill
from generated_book import Change, Trade
from generated_market import TICK


def write_bars(path, bars):
    columns = {"ts": [bar.open_at for bar in bars]}
    for name in ("open", "high", "low", "close"):
        columns[name] = [round(getattr(bar, name) * TICK, 2) for bar in bars]
    columns["volume"] = [float(bar.volume) for bar in bars]
    pq.write_table(pa.table(columns), path)


def write_quotes(path, quotes):
    columns = {"ts": [quote.time for quote in quotes]}
    for side in ("bid", "ask"):
        columns[side] = [round(getattr(quote, side) * TICK, 2) for quote in quotes]
        columns[f"{side}_size"] = [float(getattr(quote, f"{side}_size")) for quote in quotes]
    pq.write_table(pa.table(columns), path)


def write_book(folder, events):
    """`book.parquet` and `trades.parquet`."""
    changes = [event for event in events if isinstance(event, Change)]
    trades = [event for event in events if isinstance(event, Trade)]
    for name, rows, words in (("book", changes, ["side"]), ("trades", trades, ["aggressor"])):
        columns = {"ts": [row.time for row in rows], "price": [round(row.price * TICK, 2) for row in rows]}
        columns |= {"size": [float(row.size) for row in rows]}
        columns |= {word: [getattr(row, word) for row in rows] for word in words}
        pq.write_table(pa.table(columns), folder / f"{name}.parquet")


def value(of):
    """As TOML has it."""
    if isinstance(of, dict):
        return "{ " + ", ".join(f"{key} = {value(item)}" for key, item in of.items()) + " }"
    return str(of).lower() if isinstance(of, bool) else f'"{of}"' if isinstance(of, str) else repr(of)


def section(head, values):
    return f"{head}\n" + "".join(f"{key} = {value(item)}\n" for key, item in values.items())


def run(program, folder, strategy, cash, *, bars=(), quotes=(), book=(), mechanisms=(), latency=None, matching=None, lot=1):
    """The books of a run; RUN.toml, its data and all that it writes stay in `folder`.

    `strategy`: the keys of `[strategy]`. Equity is that at the end of each bar, or at every event where there are none.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    sections = [
        section("[run]", {"seed": 1, "cash": cash, "currency": "USD"}),
        section("[[instrument]]", {"symbol": "XYZ", "tick_size": TICK, "lot_size": lot}),
    ]
    if bars:
        write_bars(folder / "bars.parquet", bars)
        sections.append(section("[[data]]", {"symbol": "XYZ", "bars": "bars.parquet", "stamp": "open"}))
    if quotes:
        write_quotes(folder / "quotes.parquet", quotes)
        sections.append(section("[[data]]", {"symbol": "XYZ", "quotes": "quotes.parquet"}))
    if book:
        write_book(folder, book)
        sections += [section("[[data]]", {"symbol": "XYZ", name: f"{name}.parquet"}) for name in ("book", "trades")]
    sections.append(section("[strategy]", strategy))
    sections += [section(head, keys) for head, keys in (("[latency]", latency), ("[matching]", matching)) if keys]
    sections += [section("[[mechanism]]", {"name": name} | parameters) for name, parameters in mechanisms]
    (folder / "run.toml").write_text("\n".join(sections))
    out = folder / "out"
    command = [str(program), "backtest", str(folder / "run.toml"), "--out", str(out), "--force"]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"error: {' '.join(command)} ended with {done.returncode}\n{done.stderr}")
    return read(out, {bar.close_at for bar in bars})


def nanos(column):
    if pa.types.is_timestamp(column.type):
        column = column.cast(pa.timestamp("ns", tz="UTC")).cast(pa.int64())
    return column.to_pylist()


def read(out, ends):
    """The books of a folder that `trueup backtest` wrote; of its equity, the values at `ends`, or all."""
    orders = pq.read_table(out / "orders.parquet")
    sides = dict(zip(orders["order_id"].to_pylist(), orders["side"].to_pylist()))
    table = pq.read_table(out / "fills.parquet")
    columns = [table[name].to_pylist() for name in ("order_id", "qty", "price", "fee")]
    books = Books()
    for time, (order, quantity, price, fee) in zip(nanos(table["filled_at"]), zip(*columns)):
        books.fills.append(Fill(time, sides[order], quantity, price, fee))
    equity = pq.read_table(out / "equity.parquet")
    # Of several rows of one time the last is what stands; those between the ends of bars are those of quotes.
    books.equity = {t: e for t, e in zip(nanos(equity["ts"]), equity["equity"].to_pylist()) if not ends or t in ends}
    return books
