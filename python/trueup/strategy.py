"""Strategies written in Python."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ._trueup import Orders, View


class Strategy:
    """Decides what to trade; derive from it and write `on_event`.

    What it asks for depends on what it was shown and on nothing else: no clock, no files, no randomness but from a seed among its
    parameters. ``trueup.audit(run, strategy=...)`` looks whether it does.

    Attributes
    ----------
    lookback : int
        How many bars, quotes and trades of each instrument it is shown, the newest counted; at least 1.
    name : str
        What reports call it; the name of the class, if it is left out.

    An exception that it raises ends the run and reaches the caller as it is, with a note of when and at what it was raised.
    """

    lookback: int = 1

    def on_event(self, view: View, orders: Orders) -> None:
        """See that something became known, and ask `orders` for what is to be done."""
        raise NotImplementedError(f"{type(self).__name__} has no on_event(view, orders)")

    # Written by whoever wants to learn of it, for a call costs time:
    # def on_notice(self, view: View, notice: dict[str, Any], orders: Orders) -> None: what became of one of its orders
    # def on_action(self, view: View, action: dict[str, Any], orders: Orders) -> None: a dividend or a split
