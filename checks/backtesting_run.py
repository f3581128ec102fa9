"""The same rule in backtesting.py (https://kernc.github.io/backtesting.py), an engine of bars."""

import os
import warnings

# Read where tqdm is imported: no bar of progress among the errors.
os.environ["TQDM_DISABLE"] = "1"

import numpy as np
import pandas as pd
from backtesting import Backtest, Strategy

from books import Books, Fill
from crossing import Crossing
from generated_market import TICK


def frame(bars):
    names = ("open", "high", "low", "close")
    columns = {name.title(): [round(getattr(bar, name) * TICK, 2) for bar in bars] for name in names}
    columns["Volume"] = [bar.volume for bar in bars]
    return pd.DataFrame(columns, index=pd.to_datetime([bar.open_at for bar in bars], unit="ns"))


def average(ticks, count):
    return pd.Series(ticks).rolling(count).mean().to_numpy()


def run(
    bars, rule, cash, *, commission=0.0, borrowing=True, indicators=False, relative=False, on_close=False, refund=0.0
):
    """The books of the rule.

    - `borrowing`: margin 0.5, so that an order sized at the close is not cancelled where the open has gapped beyond its cash;
    - `indicators`: the averages are declared by `self.I`, as its documentation has it, and not kept by the rule alone;
    - `relative`: the order is for a part of what there is (`size=0.99`), which the engine makes units of at the fill;
    - `on_close`: `trade_on_close`, orders fill at the close they were decided on;
    - `refund`: [currency] for each turn from long to short or back. The engine takes that for two trades, and charges what is
      charged for an order twice; the refund is in the equity that sizes come from, in fees and in the curve.
    """
    ticks = np.array([bar.close for bar in bars])
    broker, refunds = None, [0.0] * len(bars)

    class Rule(Strategy):
        def init(self):
            self.rule = Crossing(**rule)
            if indicators:
                self.fast = self.I(average, ticks, rule["fast"])
                self.slow = self.I(average, ticks, rule["slow"])
            self.taken, self.side, self.refunded = 0, 0, 0.0

        def next(self):
            nonlocal broker
            last = len(self.data) - 1
            # It is first called with the second bar, or later where indicators are declared.
            while self.taken < last:
                self.rule.wanted(int(ticks[self.taken]))
                self.taken += 1
            self.taken += 1
            position = self.position.size
            side = (position > 0) - (position < 0)
            self.refunded += refund if side * self.side < 0 else 0.0
            self.side = side
            broker, refunds[last] = self._broker, self.refunded
            equity = self.equity + self.refunded
            signed = self.rule.order(int(ticks[last]), self.data.Close[-1], position, equity)
            if signed == 0:
                return
            if relative:
                self.position.close()
                if abs(signed) > abs(position):
                    (self.buy if signed > 0 else self.sell)(size=rule["weight"])
            else:
                (self.buy if signed > 0 else self.sell)(size=abs(signed))

    engine = Backtest(
        frame(bars), Rule, cash=cash, commission=commission, margin=0.5 if borrowing else 1.0, trade_on_close=on_close
    )
    with warnings.catch_warnings():
        # Of orders it cancels, and of what is still held at the end; both show in the comparison.
        warnings.simplefilter("ignore")
        result = engine.run()
    fills = {}

    def took(bar, signed, price):
        side = "buy" if signed > 0 else "sell"
        fee = broker._commission(abs(signed), price)
        old = fills.get((bar, side))
        # Where it turns from long to short it closes one trade and opens another: one order, and one fill.
        fills[bar, side] = (price, abs(signed) + old[1], fee + old[2] - refund) if old else (price, abs(signed), fee)

    for trade in [*broker.closed_trades, *broker.trades]:
        took(trade.entry_bar, trade.size, trade.entry_price)
        if trade.exit_bar is not None:
            took(trade.exit_bar, -trade.size, trade.exit_price)
    books = Books()
    for (bar, side), (price, quantity, fee) in sorted(fills.items()):
        time = bars[bar].close_at if on_close else bars[bar].open_at
        books.fills.append(Fill(time, side, float(quantity), float(price), float(fee)))
    curve = result["_equity_curve"]["Equity"].to_numpy()
    books.equity = {bar.close_at: float(value) + more for bar, value, more in zip(bars, curve, refunds)}
    return books
