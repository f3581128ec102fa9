"""Runs `trueup backtest` on a generated market and reads what it wrote."""

import subprocess
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from books import Books, Fill
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


def document(rule, cash, mechanisms, latency, quotes):
    """RUN.toml."""
    lines = [
        f"[run]\nseed = 1\ncash = {cash}\ncurrency = \"USD\"\n",
        f"[[instrument]]\nsymbol = \"XYZ\"\ntick_size = {TICK}\nlot_size = 1\n",
        "[[data]]\nsymbol = \"XYZ\"\nbars = \"bars.parquet\"\nstamp = \"open\"\n",
    ]
    if quotes:
        lines.append("[[data]]\nsymbol = \"XYZ\"\nquotes = \"quotes.parquet\"\n")
    short = "true" if rule["short"] else "false"
    lines.append(
        f"[strategy]\nkind = \"sma_cross\"\nfast = {rule['fast']}\nslow = {rule['slow']}\nshort = {short}\n"
        f"weight = {rule['weight']}\n"
    )
    if latency:
        lines.append(f"[latency]\norder = {latency}\n")
    for name, parameters in mechanisms:
        values = "".join(f"{key} = {value}\n" for key, value in parameters.items())
        lines.append(f"[[mechanism]]\nname = \"{name}\"\n{values}")
    return "\n".join(lines)


def run(program, folder, bars, rule, cash, mechanisms=(), latency=None, quotes=()):
    """The books of `sma_cross`; RUN.toml, its data and all that it writes stay in `folder`."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    write_bars(folder / "bars.parquet", bars)
    if quotes:
        write_quotes(folder / "quotes.parquet", quotes)
    (folder / "run.toml").write_text(document(rule, cash, mechanisms, latency, quotes))
    out = folder / "out"
    command = [str(program), "backtest", str(folder / "run.toml"), "--out", str(out), "--force"]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"error: {' '.join(command)} ended with {done.returncode}\n{done.stderr}")
    return read(out, {bar.close_at for bar in bars})


def nanos(column):
    return column.cast(pa.timestamp("ns", tz="UTC")).cast(pa.int64()).to_pylist() if pa.types.is_timestamp(
        column.type
    ) else column.to_pylist()


def read(out, ends):
    """The books of a folder that `trueup backtest` wrote; of its equity, the values at `ends`."""
    orders = pq.read_table(out / "orders.parquet")
    sides = dict(zip(orders["order_id"].to_pylist(), orders["side"].to_pylist()))
    table = pq.read_table(out / "fills.parquet")
    columns = [table[name].to_pylist() for name in ("order_id", "qty", "price", "fee")]
    books = Books()
    for time, (order, quantity, price, fee) in zip(nanos(table["filled_at"]), zip(*columns)):
        books.fills.append(Fill(time, sides[order], quantity, price, fee))
    equity = pq.read_table(out / "equity.parquet")
    # Of several rows of one time the last is what stands; those between the ends of bars are those of quotes.
    books.equity = {t: e for t, e in zip(nanos(equity["ts"]), equity["equity"].to_pylist()) if t in ends}
    return books
