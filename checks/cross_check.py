"""Holds `trueup backtest` to public engines: the same rule on the same market, fill by fill and bar by bar.

    python checks/cross_check.py --trueup target/release/trueup --out out/cross

A row of the table is either `equal`, which must show no difference, or a convention in which an engine differs: once as it
comes (`theirs`), which must show one, and once with the convention put right by an option (`put right`), which must show none.
Exit code 1 where a row is not what it must be.
"""

import argparse
import sys
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import generated_market as market
import trueup_run
from comparison import compare

CASH = 100_000
LATENCY = 250_000_000
# What trueup calls it, and what backtesting.py does.
COMMISSIONS = {
    "no commission": ([], 0.0),
    "2 bps": ([("commission", {"bps": 2.0})], 2e-4),
    "0.005 a unit": ([("commission", {"per_share": 0.005})], lambda quantity, price: abs(quantity) * 0.005),
    "4.95 an order": ([("commission", {"per_order": 4.95})], (4.95, 0.0)),
}


@dataclass(frozen=True)
class Row:
    """A comparison: what it is, whether it must be exact, and how the two books are made."""

    name: str
    exact: bool
    books: object


@dataclass(frozen=True)
class Part:
    """Comparisons with one engine, and what is to be said of them."""

    package: str
    title: str
    told: str
    rows: list


def rule(fast, slow, short, weight=0.99):
    return {"fast": fast, "slow": slow, "short": short, "weight": weight}


def minutes(seed, count=5_000):
    return market.bars(seed, count)


def days(seed):
    return market.bars(seed, 4_000, seconds=86_400, per_session=1)


def without_gaps(seed):
    """Each bar opens where and when the last one closed."""
    return market.bars(seed, 5_000, seconds=10, per_session=8_640, missing=0, overnight=0, gap=0)


class Checks:
    """The comparisons there are."""

    def __init__(self, program, folder):
        self.program, self.folder = program, folder

    def ours(self, name, rule, **more):
        return trueup_run.run(self.program, self.folder / name, {"kind": "sma_cross"} | rule, CASH, **more)

    def on_bars(self, name, bars, rule, commission="no commission", **theirs):
        """Books of both on bars. `theirs`: options of the other engine."""
        mechanisms, charged = COMMISSIONS[commission]
        engine = import_module("backtesting_run")
        return self.ours(name, rule, bars=bars, mechanisms=mechanisms), engine.run(
            bars, rule, CASH, commission=charged, **theirs
        )

    def on_quotes(self, name, seed, rule, commission="no commission", **theirs):
        """Books of both on quotes, with decisions on bars and a latency of 250 ms."""
        bars = minutes(seed, 3_000)
        quotes = market.quotes(seed, bars)
        mechanisms = [("half_spread", {"fraction": 1.0}), *COMMISSIONS[commission][0]]
        charged = {"2 bps": {"bps": 2}, "0.005 a unit": {"per_share": 0.005}}.get(commission, {})
        engine = import_module("nautilus_run")
        latency = {"order": LATENCY / 1e9}
        return self.ours(name, rule, bars=bars, quotes=quotes, mechanisms=mechanisms, latency=latency), engine.run(
            bars, quotes, rule, CASH, latency=LATENCY, **charged, **theirs
        )

    def equal_on_bars(self):
        def row(made, word, short, commission, seed):
            followed = rule(5 + seed, 20 + 5 * seed, short)
            side = "long and short" if short else "long or flat"
            name = f"{word}, {side}, {commission}"
            return Row(name, True, lambda: self.on_bars(folder(name), made(seed), followed, commission))

        rows = [row(minutes, "minutes", False, commission, k) for k, commission in enumerate(COMMISSIONS, start=1)]
        turning = [commission for commission in COMMISSIONS if commission != "4.95 an order"]
        rows += [row(minutes, "minutes", True, commission, k) for k, commission in enumerate(turning, start=5)]
        rows += [row(days, "days", short, "2 bps", 8 + short) for short in (False, True)]
        told = (
            "Decisions at the close, fills at the next open, whole units worth 0.99 of equity at the close of the decision. "
            "Of minutes and of days some are missing, and the open gaps from the close before."
        )
        return Part("backtesting", "Equal, on bars", told, rows)

    def conventions_on_bars(self):
        turning, long = rule(8, 34, True), rule(8, 34, False)

        def pair(name, put_right, theirs, right):
            return [
                Row(f"{name}: theirs", False, lambda: theirs(folder(name) + "_theirs")),
                Row(f"{name}: {put_right}", True, lambda: right(folder(name) + "_right")),
            ]

        rows = [
            *pair(
                "first decision",
                "the rule counts bars itself",
                lambda at: self.on_bars(at, minutes(21), turning, indicators=True),
                lambda at: self.on_bars(at, minutes(21), turning),
            ),
            *pair(
                "orders beyond their cash",
                "margin = 0.5",
                lambda at: self.on_bars(at, minutes(11), turning, borrowing=False),
                lambda at: self.on_bars(at, minutes(11), turning),
            ),
            *pair(
                "size = 0.99",
                "no gaps between bars",
                lambda at: self.on_bars(at, minutes(22), long, relative=True, borrowing=False),
                lambda at: self.on_bars(at, without_gaps(22), long, relative=True, borrowing=False),
            ),
            *pair(
                "trade_on_close",
                "no gaps between bars",
                lambda at: self.on_bars(at, minutes(23), turning, "2 bps", on_close=True),
                lambda at: self.on_bars(at, without_gaps(23), turning, "2 bps", on_close=True),
            ),
            *pair(
                "4.95 an order, long and short",
                "4.95 back a turn",
                lambda at: self.on_bars(at, minutes(24), turning, "4.95 an order"),
                lambda at: self.on_bars(at, minutes(24), turning, "4.95 an order", refund=4.95),
            ),
        ]
        return Part("backtesting", "Conventions of backtesting.py, and each put right", BACKTESTING_CONVENTIONS, rows)

    def equal_on_quotes(self):
        def row(short, commission, seed):
            side = "long and short" if short else "long or flat"
            name = f"quotes, {side}, {commission}"
            followed = rule(5 + seed, 20 + 5 * seed, short)
            return Row(name, True, lambda: self.on_quotes(folder(name), seed, followed, commission))

        chosen = [commission for commission in COMMISSIONS if commission != "4.95 an order"]
        rows = [row(short, commission, k + 4 * short) for short in (False, True) for k, commission in enumerate(chosen, 1)]
        told = (
            "Decisions at the close of a bar, orders that arrive 250 ms later and pay the bid or the ask displayed then; amounts "
            "of nine digits behind the point, and a timer at the arrival."
        )
        return Part("nautilus_trader", "Equal, on quotes", told, rows)

    def conventions_on_quotes(self):
        turning = rule(8, 34, True)
        rows = [
            Row("amounts in cents: theirs", False, lambda: self.on_quotes("cents_theirs", 31, turning, "2 bps", fine=False)),
            Row("amounts in cents: a currency of 1e-9", True, lambda: self.on_quotes("cents_right", 31, turning, "2 bps")),
            Row("arrival between data: theirs", False, lambda: self.on_quotes("arrival_theirs", 32, turning, timer=False)),
            Row("arrival between data: a timer then", True, lambda: self.on_quotes("arrival_right", 32, turning)),
        ]
        return Part("nautilus_trader", "Conventions of NautilusTrader, and each put right", NAUTILUS_CONVENTIONS, rows)

    def parts(self):
        return [self.equal_on_bars(), self.conventions_on_bars(), self.equal_on_quotes(), self.conventions_on_quotes()]


BACKTESTING_CONVENTIONS = """\
- *First decision*: with averages declared by `self.I` it begins a bar after all of them are known. trueup decides on the first
  bar on which they are.
- *Orders beyond their cash*: an order sized at the close is cancelled where the open is so far beyond it that cash does not
  suffice. trueup holds an order to `max_leverage` when it is sent, at the prices of then, and not again at the fill.
- *`size = 0.99`*: made units of at the fill, by the open and by the cash there is then. trueup sizes at the decision: nobody
  knows the open when an order is sent. Without gaps both are the same price.
- *`trade_on_close`*: the price is the close that was decided on, which is known too late to trade at. Without gaps it is the
  next open.
- *4.95 an order*: a turn from long to short is one order. It is booked as two trades, and the fixed part charged for each."""

NAUTILUS_CONVENTIONS = """\
- *Amounts in cents*: each commission is rounded to the digits of its currency. trueup rounds it to 1e-9.
- *Arrival between data*: orders under way meet the market when the next data come, after these have changed it. In trueup, and
  there with a timer at the arrival, they meet what is displayed when they arrive."""


def folder(name):
    return "".join(c if c.isalnum() else "_" for c in name)


def amount(value, known=True, digits=2):
    return f"{value:,.{digits}f}" if known else "-"


def told_row(name, found):
    matched = found.matched > 0
    cells = [
        name,
        f"{found.ours} / {found.theirs}",
        str(found.equal),
        *(amount(value, matched) for value in (found.price, found.quantity, found.fee)),
        amount(found.equity),
        *(amount(value, digits=4) for value in found.finals),
    ]
    return f"| {' | '.join(cells)} |"


HEAD = (
    "| comparison | fills: trueup / theirs | equal | price, at most | quantity | fee | equity at any bar | final: trueup "
    "| final: theirs |\n|---|---:|---:|---:|---:|---:|---:|---:|---:|"
)


def check(part):
    """Prints the table of a part; the rows that are not what they must be."""
    try:
        found = version(part.package)
    except PackageNotFoundError:
        print(f"\nskipped: {part.title} ({part.package} is not installed)")
        return []
    print(f"\n## {part.title} ({part.package} {found})\n\n{part.told}\n\n{HEAD}")
    wrong = []
    for row in part.rows:
        result = compare(*row.books())
        print(told_row(row.name, result), flush=True)
        if result.exact != row.exact:
            wrong.append(f"{row.name}: {'a difference that nothing explains' if row.exact else 'no difference any more'}")
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trueup", default="target/release/trueup", type=Path, help="the program [default: %(default)s]")
    parser.add_argument("--out", default="out/cross", type=Path, help="folder of markets and runs [default: %(default)s]")
    given = parser.parse_args()
    if not given.trueup.exists():
        print(f"error: {given.trueup} is not there\nhint: cargo build --release --bin trueup", file=sys.stderr)
        return 2
    wrong = [line for part in Checks(given.trueup.resolve(), given.out).parts() for line in check(part)]
    if wrong:
        print("\n" + "\n".join(f"error: {line}" for line in wrong), file=sys.stderr)
        return 1
    print("\nEvery difference is explained.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
