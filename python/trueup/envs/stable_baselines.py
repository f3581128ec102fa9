"""Environments as a `VecEnv` of Stable-Baselines3 (2.0 and later)."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from .vector import VectorEnvironment

try:
    from stable_baselines3.common.vec_env import VecEnv
except ImportError as error:
    raise ImportError("trueup.envs.stable_baselines needs stable-baselines3\n  hint: pip install stable-baselines3") from error


class StableBaselines(VecEnv):
    """Lanes of an environment for Stable-Baselines3. Arguments are those of `VectorEnvironment`.

    Lanes are reset in the step that ends their episode; ``infos[i]["terminal_observation"]`` is what was observed last, and
    ``infos[i]["TimeLimit.truncated"]`` whether the episode was cut off without having ended.

    >>> model = stable_baselines3.PPO("MlpPolicy", StableBaselines("trueup/CartPole-v0", 16))        # doctest: +SKIP
    """

    def __init__(self, identity: str, num_envs: int = 1, **arguments: Any):
        self.env = VectorEnvironment(identity, num_envs, autoreset_mode=AutoresetMode.SAME_STEP, **arguments)
        self._actions: np.ndarray | None = None
        super().__init__(self.env.num_envs, self.env.single_observation_space, self.env.single_action_space)

    def reset(self) -> np.ndarray:
        """Begin an episode in every lane, with the seeds and options given before by `seed` and `set_options`."""
        seeds = getattr(self, "_seeds", None)
        given = None if seeds is None or all(seed is None for seed in seeds) else seeds
        options = getattr(self, "_options", None) or [{}]
        observations, infos = self.env.reset(seed=given, options=options[0] or None)
        self.reset_infos = [self._of_lane(infos, lane) for lane in range(self.num_envs)]
        for forget in ("_reset_seeds", "_reset_options"):
            if hasattr(self, forget):
                getattr(self, forget)()
        return observations

    def step_async(self, actions: np.ndarray) -> None:
        self._actions = actions

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        observations, rewards, terminated, truncated, infos = self.env.step(self._actions)
        done = terminated | truncated
        last, final_info = infos.pop("final_obs", None), infos.pop("final_info", {})
        told = [self._of_lane(infos, lane) for lane in range(self.num_envs)]
        for lane in np.flatnonzero(done):
            # What is told of the step is told of the episode that has ended, not of the one that has begun.
            told[lane] = self._of_lane(final_info, lane)
            told[lane]["terminal_observation"] = last[lane]
            told[lane]["TimeLimit.truncated"] = bool(truncated[lane] and not terminated[lane])
        return observations, rewards.astype(np.float32), done, told

    def _of_lane(self, infos: dict[str, Any], lane: int) -> dict[str, Any]:
        return {name: float(infos[name][lane]) for name, _ in self.env.about["info"] if name in infos}

    def close(self) -> None:
        self.env.close()

    def get_attr(self, attr_name: str, indices: None | int | Iterable[int] = None) -> list[Any]:
        return [getattr(self.env, attr_name) for _ in self._chosen(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: None | int | Iterable[int] = None) -> None:
        if list(self._chosen(indices)) != list(range(self.num_envs)):
            raise NotImplementedError("lanes share their attributes\n  hint: set it of all, with indices=None")
        setattr(self.env, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: None | int | Iterable[int] = None, **method_kwargs: Any
    ) -> list[Any]:
        """Call a method of the vector environment, once, and give its result for each of `indices`: lanes have no methods of their own."""
        result = getattr(self.env, method_name)(*method_args, **method_kwargs)
        return [copy.copy(result) for _ in self._chosen(indices)]

    def env_is_wrapped(self, wrapper_class: type, indices: None | int | Iterable[int] = None) -> list[bool]:
        return [False for _ in self._chosen(indices)]

    def _chosen(self, indices: None | int | Iterable[int]) -> Sequence[int]:
        if indices is None:
            return range(self.num_envs)
        return [indices] if isinstance(indices, (int, np.integer)) else list(indices)
