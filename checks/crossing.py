"""The rule both engines follow, written apart from trueup's `sma_cross`: averages of whole ticks, without rounding."""

from collections import deque
from math import floor


class Crossing:
    """Long while the mean of the last `fast` closes is above that of the last `slow`; flat or short while it is below."""

    def __init__(self, fast, slow, short, weight):
        self.fast, self.slow, self.short, self.weight = fast, slow, short, weight
        self.closes = deque(maxlen=slow)

    def wanted(self, close):
        """Takes the next close [ticks]. 1, 0 or -1 for the side to be on; None where the averages do not say."""
        self.closes.append(close)
        if len(self.closes) < self.slow:
            return None
        closes = list(self.closes)
        # fast / n against slow / m, without a division.
        fast, slow = sum(closes[-self.fast :]) * self.slow, sum(closes) * self.fast
        if fast == slow:
            return None
        return 1 if fast > slow else -1 if self.short else 0

    def order(self, close, price, position, equity):
        """The signed quantity to trade at the next chance, for a close of `close` ticks and `price` currency."""
        wanted = self.wanted(close)
        if wanted is None or (position > 0) - (position < 0) == wanted:
            return 0
        # A part of the equity, at the close the decision is made on, in whole units. The ninth digit is that of trueup's
        # quantities.
        units = floor(round(self.weight * equity / price, 9))
        return wanted * units - position
