"""The crossover that trueup has compiled in, as a strategy of Python, and the audit that shows it does not see the future.

python python/examples/sma_cross.py [RUN.toml]
"""

from __future__ import annotations

import sys
from pathlib import Path

import trueup


class SmaCross(trueup.Strategy):
    """Long while the mean of the last 10 closes is above that of the last 50, else flat."""

    fast, slow, weight = 10, 50, 0.99
    lookback = 50

    def on_event(self, view, orders):
        closes = view.bars().close_nanos
        if view.event != "bar" or len(closes) < self.slow:
            return
        # Whole numbers, so that the comparison is exact.
        ahead = int(closes[-self.fast :].sum()) * self.slow - int(closes.sum()) * self.fast
        coming = view.position() + view.working()
        if ahead > 0 and coming <= 0:
            orders.to_position(view, view.instrument, view.lots_worth(self.weight / len(view.symbols) * view.equity))
        elif ahead < 0 and coming > 0:
            orders.to_position(view, view.instrument, 0.0)


if __name__ == "__main__":
    run = sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parents[2] / "data" / "bars" / "run.toml"
    result = trueup.backtest(run, SmaCross())
    print(result)
    for name in ("total_return", "sharpe", "max_drawdown"):
        print(f"  {name:16} {result.metrics.get(name)}")
    print(trueup.audit(run, SmaCross, cuts=10).summary)
