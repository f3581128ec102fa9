"""Spaces of the library as those of Gymnasium."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces

from ..errors import InputError


def box(told: dict[str, Any]) -> spaces.Box:
    """A box of float32."""
    shape = tuple(told["shape"])
    return spaces.Box(told["low"].reshape(shape), told["high"].reshape(shape), shape, np.float32)


def action(told: dict[str, Any]) -> spaces.Space:
    """A box of float32, or choices (int64)."""
    if "low" in told:
        return box(told)
    n = told["n"]
    return spaces.MultiDiscrete(n, dtype=np.int64) if isinstance(n, list) else spaces.Discrete(n)


class ActionReader:
    """Turns actions of a batched space into arrays that the library takes: float32 or int64, in one piece, of the right shape.

    Nothing is copied where they are that already. What cannot be an action is refused with the reason: another shape, another kind of
    number, ragged lists; values are looked at by the library.
    """

    def __init__(self, single: spaces.Space, lanes: int | None):
        self.dtype = np.dtype(np.float32 if isinstance(single, spaces.Box) else np.int64)
        self.shape = tuple(single.shape) if lanes is None else (lanes, *single.shape)
        self.kinds = "fiu" if self.dtype.kind == "f" else "iu"

    def __call__(self, actions: Any) -> np.ndarray:
        if type(actions) is np.ndarray and actions.dtype == self.dtype and actions.shape == self.shape and actions.flags.c_contiguous:
            return actions
        try:
            array = np.asarray(actions)
        except ValueError as error:
            raise _wrong(f"actions are ragged ({error})", f"an array of the shape {self.shape}") from None
        if array.dtype.kind not in self.kinds:
            raise _wrong(f"actions are of the type {array.dtype}", f"{self.dtype} is asked for")
        if array.shape != self.shape:
            raise _wrong(f"actions have the shape {array.shape}", f"{self.shape} is asked for")
        return np.ascontiguousarray(array, dtype=self.dtype)


def _wrong(message: str, hint: str) -> InputError:
    return InputError(f"{message}\n  hint: {hint}", hint=hint)
