"""A generated order book: changes of its levels and the trades between, made of whole numbers alone."""

from dataclasses import dataclass
from random import Random

from generated_market import FIRST, NANOS

MICRO = 1_000
# Between any two events lies this at least [ns].
GAP = 50_000 * MICRO
LEVELS = 5


@dataclass(frozen=True)
class Change:
    """From `time` [ns] on, `size` units are displayed at `price` [ticks] on the side of `side`, "buy" or "sell"."""

    time: int
    side: str
    price: int
    size: int


@dataclass(frozen=True)
class Trade:
    """`size` units are traded at `price` [ticks]; `aggressor` is the side that took."""

    time: int
    price: int
    size: int
    aggressor: str


class Walk:
    """A book on its way, and all that happened to it."""

    def __init__(self, seed):
        self.random = Random(seed)
        self.time = FIRST
        self.sides = {"buy": {}, "sell": {}}
        self.events = []
        for k in range(2 * LEVELS):
            self.set("buy", 9_999 - k, self.random.randrange(20, 200))
            self.set("sell", 10_001 + k, self.random.randrange(20, 200))

    def best(self, side):
        return max(self.sides["buy"]) if side == "buy" else min(self.sides["sell"])

    def set(self, side, price, size):
        if size:
            self.sides[side][price] = size
        else:
            del self.sides[side][price]
        self.events.append(Change(self.time, side, price, size))

    def wait(self, nanos):
        self.time += nanos

    def trade(self, merged):
        """Somebody takes from the best level. `merged`: what is cancelled there comes with the same change."""
        aggressor = self.random.choice(("buy", "sell"))
        side = "sell" if aggressor == "buy" else "buy"
        price = self.best(side)
        there = self.sides[side][price]
        size = min(self.random.randrange(1, 120), there)
        self.events.append(Trade(self.time, price, size, aggressor))
        self.wait(GAP)
        left = there - size
        self.set(side, price, left - (self.random.randrange(left // 2 + 1) if merged else 0))

    def add(self):
        side = self.random.choice(("buy", "sell"))
        away = 1 if side == "sell" else -1
        spread = self.best("sell") - self.best("buy")
        # Into the spread, or up to four ticks behind the best.
        price = self.best(side) + away * self.random.randrange(-min(spread - 1, 2), 5)
        self.set(side, price, self.sides[side].get(price, 0) + self.random.randrange(5, 150))

    def cancel(self):
        side = self.random.choice(("buy", "sell"))
        price = self.random.choice(sorted(self.sides[side]))
        there = self.sides[side][price]
        gone = self.random.randrange(1, there + 1)
        self.set(side, price, there - gone)

    def fill_up(self):
        for side, away in (("buy", -1), ("sell", 1)):
            while len(self.sides[side]) < LEVELS:
                self.wait(GAP)
                end = min(self.sides[side], default=self.best("sell") - 1) if side == "buy" else max(
                    self.sides[side], default=self.best("buy") + 1
                )
                self.set(side, end + away, self.random.randrange(20, 200))


def book(seed, steps, *, merged=False):
    """What happens to a book in `steps` steps; after the last it is silent, so that all that is under way arrives."""
    walk = Walk(seed)
    for _ in range(steps):
        walk.wait(GAP + MICRO * walk.random.randrange(400_000))
        drawn = walk.random.randrange(100)
        if drawn < 25:
            walk.trade(merged)
        elif drawn < 62:
            walk.add()
        else:
            walk.cancel()
        walk.fill_up()
    walk.wait(10 * NANOS)
    # The furthest bid becomes larger, which moves no price: the last event.
    deepest = min(walk.sides["buy"])
    walk.set("buy", deepest, walk.sides["buy"][deepest] + 1)
    return walk.events
