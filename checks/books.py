"""What a backtest did, whoever ran it: its fills, and its equity at the end of every bar."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Fill:
    """One order's fill. `time` in ns since the Unix epoch; `price` and `fee` in currency; `quantity` in units, above 0."""

    time: int
    side: str
    quantity: float
    price: float
    fee: float


@dataclass
class Books:
    """Fills in the order in which they happened, and equity [currency] by the time [ns] at which a bar ended."""

    fills: list = field(default_factory=list)
    equity: dict = field(default_factory=dict)
