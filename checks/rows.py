"""What is compared, and what must come of it."""

from dataclasses import dataclass

CASH = 100_000


@dataclass(frozen=True)
class Row:
    """A comparison: its name, whether it must be exact, and `books(folder)`, trueup's and theirs."""

    name: str
    exact: bool
    books: object


@dataclass(frozen=True)
class Part:
    """Comparisons with one engine, and what is to be said of them."""

    package: str
    title: str
    told: str
    rows: list


def equal(name, books):
    """Both must do the same."""
    return Row(name, True, books)


def convention(name, put_right, theirs, right):
    """A convention of an engine as it comes, which must show, and put right, which must leave no difference."""
    return [Row(f"{name}: theirs", False, theirs), Row(f"{name}: {put_right}", True, right)]


def crossing(fast, slow, short, weight=0.99):
    """Parameters of the rule in crossing.py and of `sma_cross`."""
    return {"fast": fast, "slow": slow, "short": short, "weight": weight}
