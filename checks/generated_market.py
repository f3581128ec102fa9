"""Markets for the cross-check: random walks on ticks, made of whole numbers alone, so that they are the same everywhere."""

from dataclasses import dataclass
from random import Random

NANOS = 1_000_000_000
TICK = 0.01
# 2024-01-02 14:30 UTC, a Tuesday: the first open.
FIRST = 1_704_205_800 * NANOS


@dataclass(frozen=True)
class Bar:
    """Prices in ticks; `open_at` and `close_at` in ns since the Unix epoch; `volume` in units."""

    open_at: int
    close_at: int
    open: int
    high: int
    low: int
    close: int
    volume: int


@dataclass(frozen=True)
class Quote:
    """The best bid and ask [ticks] from `time` on [ns], with their sizes [units]."""

    time: int
    bid: int
    bid_size: int
    ask: int
    ask_size: int


def opens(count, seconds, per_session, missing, random):
    """Times at which bars open: sessions of `per_session` bars on weekdays, of which one in `missing` is not there."""
    times, day = [], 0
    while True:
        if day % 7 not in (4, 5):  # From a Tuesday, these are Saturday and Sunday.
            for k in range(per_session):
                if len(times) == count:
                    return times
                if not missing or random.randrange(missing):
                    times.append(FIRST + (day * 86_400 + k * seconds) * NANOS)
        day += 1


def bars(seed, count, *, seconds=60, per_session=390, missing=97, overnight=150, gap=4):
    """`count` bars of `seconds`.

    The open lies up to `gap` ticks from the close before, and up to `overnight` ticks where time has passed between them.
    There are trends, so that averages cross for more than noise.
    """
    random = Random(seed)
    made, last, drift, before = [], 10_000, 1, None
    for time in opens(count, seconds, per_session, missing, random):
        if random.randrange(60) == 0:
            drift = random.randrange(-3, 4)
        # Away from where a tick is a large part of the price, and from where it is none.
        drift = abs(drift) + 1 if last < 5_000 else -abs(drift) - 1 if last > 20_000 else drift
        jump = overnight if before is not None and time > before else gap
        opened = last + (random.randrange(-jump, jump + 1) if jump else 0)
        last = opened + drift + random.randrange(-12, 13)
        high = max(opened, last) + random.randrange(6)
        low = min(opened, last) - random.randrange(6)
        before = time + seconds * NANOS
        made.append(Bar(time, before, opened, high, low, last, 1_000_000 + random.randrange(100_000)))
    return made


def quotes(seed, bars, *, size=1_000_000):
    """Quotes within `bars`: from the open to the close of each, at times of their own and with spreads of 1 to 4 ticks."""
    random = Random(seed)
    made = []
    for bar in bars:
        inside = (bar.close_at - bar.open_at) // 6
        for k in range(6):
            middle = bar.open + (bar.close - bar.open) * k // 5
            bid = middle - random.randrange(1, 3)
            ask = middle + random.randrange(0, 3) + (0 if bid < middle else 1)
            # A time within its sixth of the bar, never at the bar's own ends.
            time = bar.open_at + inside * k + random.randrange(1, inside)
            made.append(Quote(time, bid, size, max(ask, bid + 1), size))
    return made
