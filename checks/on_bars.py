"""Market orders on bars, beside backtesting.py."""

import generated_market as market
import trueup_run
from rows import CASH, Part, convention, crossing, equal

# What trueup calls a commission, and what backtesting.py does.
COMMISSIONS = {
    "no commission": ([], 0.0),
    "2 bps": ([("commission", {"bps": 2.0})], 2e-4),
    "0.005 a unit": ([("commission", {"per_share": 0.005})], lambda quantity, price: abs(quantity) * 0.005),
    "4.95 an order": ([("commission", {"per_order": 4.95})], (4.95, 0.0)),
}

EQUAL = """\
Decisions at the close, fills at the next open, whole units worth 0.99 of equity at the close of the decision. Some minutes and
all weekends are missing, and opens gap from the close before."""

CONVENTIONS = """\
- *First decision*: with averages declared by `self.I` it begins a bar after all of them are known. trueup decides on the first
  bar on which they are.
- *Orders beyond their cash*: an order sized at the close is cancelled where the open is so far from it that the cash does not
  suffice. trueup holds an order to `max_leverage` when it is sent, at the prices of then, and not again at the fill.
- *`size = 0.99`*: made units of at the fill, by the open and by the cash there is then. trueup sizes at the decision: nobody
  knows the open when an order is sent. Without gaps both are the same price.
- *`trade_on_close`*: the price is the close that was decided on, which is known too late to trade at. Without gaps it is the
  next open.
- *4.95 an order*: a turn from long to short is one order. It is booked as two trades, and the fixed part charged for each."""


def minutes(seed):
    return market.bars(seed, 5_000)


def days(seed):
    return market.bars(seed, 4_000, seconds=86_400, per_session=1)


def without_gaps(seed):
    """Each bar opens where and when the last one closed."""
    return market.bars(seed, 5_000, seconds=10, per_session=8_640, missing=0, overnight=0, gap=0)


def parts(program):
    from backtesting_run import run

    def both(bars, rule, commission="no commission", **theirs):
        """Books of both; `theirs`: options of the other engine."""
        mechanisms, charged = COMMISSIONS[commission]
        strategy = {"kind": "sma_cross"} | rule
        return lambda folder: (
            trueup_run.run(program, folder, strategy, CASH, bars=bars, mechanisms=mechanisms),
            run(bars, rule, CASH, commission=charged, **theirs),
        )

    def row(made, short, commission, seed):
        side = "long and short" if short else "long or flat"
        rule = crossing(5 + seed, 20 + 5 * seed, short)
        return equal(f"{made.__name__}, {side}, {commission}", both(made(seed), rule, commission))

    proportional = ["no commission", "2 bps", "0.005 a unit"]
    rows = [row(minutes, False, commission, k) for k, commission in enumerate(COMMISSIONS, start=1)]
    rows += [row(minutes, True, commission, k) for k, commission in enumerate(proportional, start=5)]
    rows += [row(days, short, "2 bps", 8 + short) for short in (False, True)]

    turning, long = crossing(8, 34, True), crossing(8, 34, False)
    differing = [
        *convention(
            "first decision",
            "the rule counts bars itself",
            both(minutes(21), turning, indicators=True),
            both(minutes(21), turning),
        ),
        *convention(
            "orders beyond their cash", "margin = 0.5", both(minutes(11), turning, borrowing=False), both(minutes(11), turning)
        ),
        *convention(
            "size = 0.99",
            "no gaps between bars",
            both(minutes(22), long, relative=True, borrowing=False),
            both(without_gaps(22), long, relative=True, borrowing=False),
        ),
        *convention(
            "trade_on_close",
            "no gaps between bars",
            both(minutes(23), turning, "2 bps", on_close=True),
            both(without_gaps(23), turning, "2 bps", on_close=True),
        ),
        *convention(
            "4.95 an order, long and short",
            "4.95 back a turn",
            both(minutes(24), turning, "4.95 an order"),
            both(minutes(24), turning, "4.95 an order", refund=4.95),
        ),
    ]
    return [
        Part("backtesting", "Equal: market orders on bars", EQUAL, rows),
        Part("backtesting", "Conventions of backtesting.py", CONVENTIONS, differing),
    ]
