"""Limit orders in a book, with places in queues and latencies, beside hftbacktest."""

import generated_book
import trueup_run
from rows import CASH, Part, convention, equal

MAKER = {
    "gamma": 0.001,
    "kappa": 100.0,
    "sigma": 0.01,
    "max_inventory": 100.0,
    "size": 20.0,
    "horizon": 600.0,
    "step": 1,
}
MAKER_BPS = -0.2
# How long data, orders and reports take [ns]: on no event of the book, and an order is answered before the next one comes.
FEED, ORDER, RESPONSE = 10_000_111, 25_000_333, 15_000_777
# What trueup calls a model of the queue, and what hftbacktest does.
QUEUES = {
    "trades alone": ({"kind": "trades"}, ("risk_adverse_queue_model",)),
    "in proportion": ({"kind": "proportional"}, ("power_prob_queue_model", 1.0)),
    "to the power of 3": ({"kind": "power", "exponent": 3.0}, ("power_prob_queue_model", 3.0)),
    "by logarithms": ({"kind": "log"}, ("log_prob_queue_model",)),
}
# Lots so small that rounding a fill to them is no difference.
FINE = 1e-8

EQUAL = """\
`market_making` quotes 20 units on each side of a generated book, post-only; data take 10 ms, orders 25 ms, reports 15 ms. A
place in the queue moves by trades and by what a model makes of cancellations, and fills may be partial. A maker is paid 0.2 bps.
Equity is compared at every event. Events lie 50 ms apart or more, so that orders are answered before the next: hftbacktest takes
no cancel of an order that has not been answered, and trueup sends it after the order. Seeds are such that hftbacktest comes to
the end: on one book in six or so it stops with its error 14."""

CONVENTIONS = """\
- *After partial fills*: `position` and `state_values` leave out what was filled in part, until the rest is. trueup books each fill
  when it is reported, as one gets it by counting what the orders have left.
- *Fills in lots*: what of a trade reaches an order is rounded to the nearest lot. trueup rounds down: a lot is filled when all of
  it was reached.
- *Trade and cancellation in one change*: what stands behind is counted from the level before the trade, though the trade took
  from the front. trueup counts from what the trade left. With a change for each both are the same.
- *More than was traded*: where a model puts more of a cancellation ahead than stands there, the place becomes negative, and the
  next trade fills more than its own size. trueup takes the rest from behind. In proportion it cannot happen."""


def parts(program):
    from hftbacktest_run import run

    def both(seed, queue, *, lot=FINE, merged=False, **theirs):
        """Books of both; `theirs`: options of the other engine."""
        model, called = QUEUES[queue]
        events = generated_book.book(seed, 4_000, merged=merged)
        latency = {"feed": FEED / 1e9, "order": ORDER / 1e9, "response": RESPONSE / 1e9}
        fees = [("commission", {"maker_bps": MAKER_BPS, "taker_bps": 0.0})]
        ours = {"book": events, "mechanisms": fees, "latency": latency, "matching": {"queue": model}, "lot": lot}
        told = {"feed": FEED, "order": ORDER, "response": RESPONSE, "queue": called, "maker_bps": MAKER_BPS, "lot": lot}
        return lambda folder: (
            trueup_run.run(program, folder, {"kind": "market_making"} | MAKER, CASH, **ours),
            run(events, MAKER, CASH, **told, **theirs),
        )

    rows = [equal(f"cancellations: {queue}", both(seed, queue)) for seed, queue in zip((41, 42, 45, 44), QUEUES)]
    differing = [
        *convention("after partial fills", "counted from orders", both(51, "trades alone", counted=False), both(51, "trades alone")),
        *convention("fills in lots", "lots of 1e-8", both(61, "in proportion", lot=1), both(61, "in proportion")),
        *convention(
            "trade and cancellation in one change",
            "a change for each",
            both(61, "in proportion", merged=True),
            both(61, "in proportion"),
        ),
        *convention("more than was traded", "in proportion", both(71, "to the power of 3"), both(71, "in proportion")),
    ]
    return [
        Part("hftbacktest", "Equal: limit orders in a book", EQUAL, rows),
        Part("hftbacktest", "Conventions of hftbacktest", CONVENTIONS, differing),
    ]
