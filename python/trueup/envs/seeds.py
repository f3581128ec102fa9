"""Seeds, by Gymnasium's book."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.error import Error

from ..errors import InputError

_LIMIT = 1 << 64


class SeedError(InputError, Error):
    """A seed that is none: an error of Gymnasium's, too."""


def whole(seed: Any) -> int:
    """A seed as 64 bits: itself below 2^64, and beyond that drawn from all of its bits."""
    if isinstance(seed, (bool, np.bool_)) or not isinstance(seed, (int, np.integer)):
        hint = "a whole number of at least 0, or None"
        raise SeedError(f"the seed is {seed!r}\n  hint: {hint}", hint=hint)
    seed = int(seed)
    if seed < 0:
        hint = "a seed is at least 0"
        raise SeedError(f"the seed is {seed}\n  hint: {hint}", hint=hint)
    return seed if seed < _LIMIT else int(np.random.SeedSequence(seed).generate_state(1, np.uint64)[0])


def fresh() -> int:
    """A seed that nobody has chosen."""
    return int(np.random.SeedSequence().generate_state(1, np.uint64)[0])


def of_lanes(seed: int | Sequence[int | None] | None, lanes: int) -> list[int | None]:
    """One seed a lane: from a number s, lane i has s + i; a sequence has one for each; None stays None."""
    if seed is None:
        return [None] * lanes
    if isinstance(seed, (int, np.integer)) and not isinstance(seed, bool):
        whole(seed)
        return [whole(int(seed) + lane) for lane in range(lanes)]
    if isinstance(seed, (str, bytes)) or not hasattr(seed, "__len__"):
        whole(seed)
    if len(seed) != lanes:
        hint = f"one a lane: {lanes}"
        raise SeedError(f"there are {len(seed)} seeds\n  hint: {hint}", hint=hint)
    return [None if one is None else whole(one) for one in seed]
