"""Steps in place, on buffers that are given once: how PufferLib has it."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from .. import _trueup
from .vector import VectorEnvironment, _wrong


class BoundEnvironment:
    """Lanes that read their actions from a buffer and write what comes of them into others, which were given once.

    Parameters
    ----------
    identity : str
        Its id, such as ``"trueup/CartPole-v0"``.
    num_envs : int
        Number of lanes.
    observations : float32 (num_envs, ...)
    actions : float32 (num_envs, ...), or int32 or int64 (num_envs,) or (num_envs, choices), as the action space is
    rewards : float32 or float64 (num_envs,)
    terminals, truncations : bool or uint8 (num_envs,)
        Buffers; those that are left out are made, and are attributes all the same.
    **arguments
        As `VectorEnvironment` takes them. Lanes are reset in the step that ends their episode: its reward and flags are those of the
        end, and what is observed is the first observation of the next.

    A loop is then: write `actions`, call ``step()``, read the others. What was observed last of an episode is not kept; `VectorEnvironment`
    tells it.
    """

    def __init__(
        self,
        identity: str,
        num_envs: int = 1,
        *,
        observations: np.ndarray | None = None,
        actions: np.ndarray | None = None,
        rewards: np.ndarray | None = None,
        terminals: np.ndarray | None = None,
        truncations: np.ndarray | None = None,
        **arguments: Any,
    ):
        arguments.setdefault("info", False)
        self.env = VectorEnvironment(identity, num_envs, autoreset_mode=AutoresetMode.SAME_STEP, **arguments)
        env, lanes = self.env, self.env.num_envs
        self.num_agents = lanes
        self.single_observation_space, self.single_action_space = env.single_observation_space, env.single_action_space
        self.observation_space, self.action_space = env.observation_space, env.action_space
        acted = (lanes, *env.single_action_space.shape)
        real = env._read.dtype.kind == "f"
        self.observations = _buffer("observations", observations, env.observation_space.shape, ("float32",))
        self.actions = _buffer("actions", actions, acted, ("float32",) if real else ("int64", "int32"))
        self.rewards = _buffer("rewards", rewards, (lanes,), ("float32", "float64"))
        self.terminals = _buffer("terminals", terminals, (lanes,), ("bool", "uint8"))
        self.truncations = _buffer("truncations", truncations, (lanes,), ("bool", "uint8"))
        # What is no truth value is none to the library either.
        self.terminals[...] = 0
        self.truncations[...] = 0
        self._bound = _trueup.BoundLanes(
            env._lanes,
            self.actions,
            self.observations,
            self.rewards,
            self.terminals.view(np.bool_),
            self.truncations.view(np.bool_),
        )
        self._step = self._bound.step
        # All there is to tell is in the buffers: a step makes nothing new.
        self._told = (self.observations, self.rewards, self.terminals, self.truncations, ())

    def reset(self, seed: int | None = None) -> tuple[np.ndarray, list]:
        """Begin an episode in every lane: the buffer of observations, and no info."""
        observations, _ = self.env.reset(seed=seed)
        self.observations[...] = observations
        self.rewards[...] = 0
        self.terminals[...] = False
        self.truncations[...] = False
        return self.observations, []

    def step(self, actions: np.ndarray | None = None):
        """Take a step by the buffer of actions, into which `actions` are written before where they are given: all buffers, and no info."""
        self._step(actions)
        return self._told

    def close(self) -> None:
        self.env.close()


def _buffer(name: str, given: np.ndarray | None, shape: tuple[int, ...], types: tuple[str, ...]) -> np.ndarray:
    if given is None:
        return np.zeros(shape, types[0])
    if not isinstance(given, np.ndarray):
        raise _wrong(f"the buffer of {name} is {type(given).__name__}", "an array of NumPy")
    if given.shape != shape or given.dtype.name not in types:
        raise _wrong(f"the buffer of {name} is {given.dtype} {given.shape}", f"{' or '.join(types)} {shape}")
    if not given.flags.c_contiguous or not given.flags.writeable:
        raise _wrong(f"the buffer of {name} cannot be written in one piece", "a C-contiguous, writeable array")
    return given
