"""Market orders on quotes, with latency, beside NautilusTrader."""

import generated_market as market
import trueup_run
from rows import CASH, Part, convention, crossing, equal

LATENCY = 250_000_000
# What trueup calls a commission, and what the other engine does.
COMMISSIONS = {
    "no commission": ([], {}),
    "2 bps": ([("commission", {"bps": 2.0})], {"bps": 2}),
    "0.005 a unit": ([("commission", {"per_share": 0.005})], {"per_share": 0.005}),
}

EQUAL = """\
Decisions at the close of a minute, orders that arrive 250 ms later and pay the bid or the ask displayed then; in the other
engine amounts of nine digits behind the point, and a timer at the arrival."""

CONVENTIONS = """\
- *Amounts in cents*: each commission is rounded to the digits of its currency. trueup rounds it to 1e-9.
- *Arrival between data*: orders under way meet the market when the next data come, after these have changed it. In trueup, and
  there with a timer at the arrival, they meet what is displayed when they arrive."""


def parts(program):
    from nautilus_run import run

    def both(seed, rule, commission="no commission", **theirs):
        """Books of both; `theirs`: options of the other engine."""
        mechanisms, charged = COMMISSIONS[commission]
        mechanisms = [("half_spread", {"fraction": 1.0}), *mechanisms]
        strategy, latency = {"kind": "sma_cross"} | rule, {"order": LATENCY / 1e9}
        bars = market.bars(seed, 3_000)
        quotes = market.quotes(seed, bars)
        return lambda folder: (
            trueup_run.run(
                program, folder, strategy, CASH, bars=bars, quotes=quotes, mechanisms=mechanisms, latency=latency
            ),
            run(bars, quotes, rule, CASH, latency=LATENCY, **charged, **theirs),
        )

    def row(short, commission, seed):
        side = "long and short" if short else "long or flat"
        return equal(f"{side}, {commission}", both(seed, crossing(5 + seed, 20 + 5 * seed, short), commission))

    rows = [row(short, commission, k + 4 * short) for short in (False, True) for k, commission in enumerate(COMMISSIONS, 1)]
    turning = crossing(8, 34, True)
    differing = [
        *convention("amounts in cents", "a currency of 1e-9", both(31, turning, "2 bps", fine=False), both(31, turning, "2 bps")),
        *convention("arrival between data", "a timer then", both(32, turning, timer=False), both(32, turning)),
    ]
    return [
        Part("nautilus_trader", "Equal: market orders on quotes", EQUAL, rows),
        Part("nautilus_trader", "Conventions of NautilusTrader", CONVENTIONS, differing),
    ]
