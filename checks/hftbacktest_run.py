"""`market_making` in hftbacktest (https://hftbacktest.readthedocs.io), an engine of books, queues and latencies."""

import hftbacktest as engine
import numpy as np
from hftbacktest import BacktestAsset, HashMapMarketDepthBacktest
from hftbacktest.order import NEW, NONE, PARTIALLY_FILLED
from numba import njit

from books import Books, Fill
from generated_book import Trade
from generated_market import NANOS, TICK

FEED, RESPONSE = 2, 3
OVER = 1


def table(events, feed):
    """The events as the engine has them; `feed` [ns] is how long they take to the strategy."""
    rows = np.zeros(len(events) + 1, dtype=engine.event_dtype)
    # It is over before the strategy sees the last event, so there is one more of these.
    for k, event in enumerate([*events, events[-1]]):
        traded = isinstance(event, Trade)
        side = event.aggressor if traded else event.side
        kind = engine.TRADE_EVENT if traded else engine.DEPTH_EVENT
        flags = engine.EXCH_EVENT | engine.LOCAL_EVENT | (engine.BUY_EVENT if side == "buy" else engine.SELL_EVENT)
        rows[k]["ev"] = kind | flags
        rows[k]["exch_ts"], rows[k]["local_ts"] = event.time, event.time + feed
        rows[k]["px"], rows[k]["qty"] = round(event.price * TICK, 2), event.size
    rows[-1]["exch_ts"] += NANOS
    rows[-1]["local_ts"] += NANOS
    return rows


@njit
def quoted(mid, inventory, left, gamma, kappa, sigma, most, side):
    """The best price to quote on a side [ticks], 1 to buy and -1 to sell; 0 where there is none."""
    if side * inventory >= most:
        return 0
    risk = gamma * sigma**2 * max(left, 0.0)
    half = 0.5 * (risk + 2.0 / gamma * np.log1p(gamma / kappa))
    # To 1e-9, as trueup's prices are, and then to the tick on the side that does not pay more.
    nanos = round((mid - inventory * risk - side * half) * 1e9)
    tick = 10_000_000
    return nanos // tick if side == 1 else -((-nanos) // tick)


@njit
def follow(hbt, gamma, kappa, sigma, most, size, horizon, step, fee, counted, times, equity, fills, quantities):
    """Quotes both sides at every event of the market; `fee` is a part of the notional.

    Gives the number of events seen, or the engine's error below 0, and that of fills.
    """
    own = np.zeros(2, dtype=np.uint64)
    last_left = {np.uint64(0): 0.0}
    asked = np.uint64(0)
    began = np.int64(-1)
    seen = 0
    filled = 0
    held, cash = 0.0, 0.0
    while True:
        what = hbt.wait_next_feed(True, np.int64(60_000_000_000))
        if what == OVER:
            return seen, filled
        if what < 0 or what > RESPONSE:
            return -what, filled
        depth = hbt.depth(0)
        if what == RESPONSE:
            orders = hbt.orders(0).values()
            while orders.has_next():
                order = orders.get()
                taken = last_left[order.order_id] - order.leaves_qty
                if taken > 0.0:
                    fills[filled, 0] = order.exch_timestamp
                    fills[filled, 1] = order.side
                    fills[filled, 2] = order.exec_price_tick
                    quantities[filled] = taken
                    price = order.exec_price_tick * 0.01
                    held += order.side * taken
                    cash -= order.side * taken * price + fee * taken * price
                    last_left[order.order_id] = order.leaves_qty
                    filled += 1
            continue
        if what != FEED or not (depth.best_bid > 0.0 and depth.best_ask > 0.0):
            continue
        now = hbt.current_timestamp
        if began < 0:
            began = now
        left = horizon - ((now - began) * 1e-9) % horizon
        mid = (depth.best_bid_tick + depth.best_ask_tick) * 0.005
        if not counted:
            values = hbt.state_values(0)
            held, cash = values.position, values.balance - values.fee
        times[seen] = now
        equity[seen] = cash + held * mid
        seen += 1
        for k in range(2):
            side = 1 if k == 0 else -1
            best = quoted(mid, held, left, gamma, kappa, sigma, most, side)
            works = False
            limit = 0
            orders = hbt.orders(0)
            if own[k] in orders:
                order = orders.get(own[k])
                # What was sent and not answered yet works, as far as its owner knows.
                works = order.status in (NONE, NEW, PARTIALLY_FILLED)
                limit = order.price_tick
            gone = works and (best == 0 or abs(limit - best) >= step)
            if gone and orders.get(own[k]).req == NONE:
                hbt.cancel(0, own[k], False)
            if best != 0 and (gone or not works):
                asked += np.uint64(1)
                own[k] = asked
                last_left[asked] = size
                if side == 1:
                    hbt.submit_buy_order(0, asked, best * 0.01, size, engine.GTX, engine.LIMIT, False)
                else:
                    hbt.submit_sell_order(0, asked, best * 0.01, size, engine.GTX, engine.LIMIT, False)


def run(events, maker, cash, *, feed, order, response, queue, maker_bps=0.0, lot=1.0, counted=True):
    """The books of the maker; latencies in ns, `queue` a method of the asset and its arguments.

    `counted`: position and cash are counted from what the orders say of themselves, and not those of `state_values`.
    """
    # The engine reads the table where it is: it must not go before the run is over.
    rows = table(events, feed)
    asset = BacktestAsset().data(rows).linear_asset(1.0).constant_order_latency(order, response)
    getattr(asset, queue[0])(*queue[1:])
    asset = asset.partial_fill_exchange().trading_value_fee_model(maker_bps * 1e-4, 0.0).tick_size(TICK).lot_size(lot)
    hbt = HashMapMarketDepthBacktest([asset])
    times, equity = np.zeros(len(events), dtype=np.int64), np.zeros(len(events))
    fills, quantities = np.zeros((len(events), 3), dtype=np.int64), np.zeros(len(events))
    names = ("gamma", "kappa", "sigma", "max_inventory", "size", "horizon", "step")
    seen, filled = follow(hbt, *(maker[name] for name in names), maker_bps * 1e-4, counted, times, equity, fills, quantities)
    hbt.close()
    del rows
    if seen < 0:
        raise SystemExit(f"error: hftbacktest ended with its error {-seen}")
    books = Books(equity={int(t): cash + float(e) for t, e in zip(times[:seen], equity[:seen])})
    for (time, side, ticks), quantity in zip(fills[:filled], quantities.tolist()):
        price = round(int(ticks) * TICK, 2)
        fee = maker_bps * 1e-4 * price * quantity
        books.fills.append(Fill(int(time), "buy" if side == 1 else "sell", quantity, price, fee))
    return books
