"""Two books beside each other, fill by fill and bar by bar."""

from dataclasses import dataclass

# Below this [currency, units] a difference is that of floating point: sums of 1e6 with 16 digits.
EQUAL = 1e-6


@dataclass(frozen=True)
class Comparison:
    """How far two books are apart; `price`, `quantity`, `fee`: at most, over the fills of the same time and side."""

    ours: int
    theirs: int
    matched: int
    equal: int
    price: float
    quantity: float
    fee: float
    bars: int
    equity: float
    finals: tuple

    @property
    def exact(self):
        """Whether there is no difference at all."""
        return self.ours == self.theirs == self.equal and self.bars > 0 and self.equity <= EQUAL


def compare(ours, theirs):
    """Fills are matched by time and side; one that has no counterpart is not equal to any."""
    others = {(fill.time, fill.side): fill for fill in theirs.fills}
    pairs = [(fill, others[fill.time, fill.side]) for fill in ours.fills if (fill.time, fill.side) in others]

    def largest(name):
        return max((abs(getattr(a, name) - getattr(b, name)) for a, b in pairs), default=0.0)

    def same(a, b):
        return all(abs(getattr(a, name) - getattr(b, name)) <= EQUAL for name in ("price", "quantity", "fee"))

    ends = sorted(ours.equity)
    if ends != sorted(theirs.equity):
        raise SystemExit(f"error: {len(ends)} and {len(theirs.equity)} values of equity are not of the same bars")
    return Comparison(
        ours=len(ours.fills),
        theirs=len(theirs.fills),
        matched=len(pairs),
        equal=sum(same(a, b) for a, b in pairs),
        price=largest("price"),
        quantity=largest("quantity"),
        fee=largest("fee"),
        bars=len(ends),
        equity=max(abs(ours.equity[end] - theirs.equity[end]) for end in ends),
        finals=(ours.equity[ends[-1]], theirs.equity[ends[-1]]),
    )
