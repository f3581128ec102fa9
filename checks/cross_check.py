"""Holds `trueup backtest` to public engines: the same rule on the same market, fill by fill and bar by bar.

    python checks/cross_check.py --trueup target/release/trueup --out out/cross

A row of the table is either `equal`, which must show no difference, or a convention in which an engine differs: once as it
comes (`theirs`), which must show one, and once with the convention put right by an option (`put right`), which must show none.
Exit code 1 where a row is not what it must be.
"""

import argparse
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import on_bars
import on_books
import on_quotes
from comparison import compare

ENGINES = {"backtesting": on_bars, "nautilus_trader": on_quotes, "hftbacktest": on_books}


def folder(name):
    return "".join(c if c.isalnum() else "_" for c in name)


def amount(value, known=True, digits=2):
    return f"{value:,.{digits}f}" if known else "-"


def told_row(name, found):
    matched = found.matched > 0
    cells = [
        name,
        f"{found.ours} / {found.theirs}",
        str(found.equal),
        *(amount(value, matched) for value in (found.price, found.quantity, found.fee)),
        amount(found.equity),
        *(amount(value, digits=4) for value in found.finals),
    ]
    return f"| {' | '.join(cells)} |"


HEAD = (
    "| comparison | fills: trueup / theirs | equal | price, at most | quantity | fee | equity at any bar | final: trueup "
    "| final: theirs |\n|---|---:|---:|---:|---:|---:|---:|---:|---:|"
)


def check(part, out):
    """Prints the table of a part; the rows that are not what they must be."""
    print(f"\n## {part.title} ({part.package} {version(part.package)})\n\n{part.told}\n\n{HEAD}")
    wrong = []
    for row in part.rows:
        result = compare(*row.books(out / part.package / folder(row.name)))
        print(told_row(row.name, result), flush=True)
        if result.exact != row.exact:
            wrong.append(f"{row.name}: {'a difference that nothing explains' if row.exact else 'no difference any more'}")
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trueup", default="target/release/trueup", type=Path, help="the program [default: %(default)s]")
    parser.add_argument("--out", default="out/cross", type=Path, help="folder of markets and runs [default: %(default)s]")
    given = parser.parse_args()
    if not given.trueup.exists():
        print(f"error: {given.trueup} is not there\nhint: cargo build --release --bin trueup", file=sys.stderr)
        return 2
    wrong, skipped = [], []
    for package, engine in ENGINES.items():
        try:
            version(package)
        except PackageNotFoundError:
            skipped.append(package)
            continue
        for part in engine.parts(given.trueup.resolve()):
            wrong += check(part, given.out)
    for package in skipped:
        print(f"\nskipped: {package} is not installed")
    if wrong:
        print("\n" + "\n".join(f"error: {line}" for line in wrong), file=sys.stderr)
        return 1
    print("\nNothing was compared." if len(skipped) == len(ENGINES) else "\nEvery difference is explained.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
