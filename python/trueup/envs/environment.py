"""Single environments."""

from __future__ import annotations

import copy
import os
from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np

from .. import _trueup
from . import seeds, spaces
from .registration import ids


class Snapshot:
    """An environment as it was: state, random streams, episode. It can be restored any number of times."""

    def __init__(self, identity: str, lanes: _trueup.Lanes, kept: dict[str, Any]):
        self.identity = identity
        self._lanes = lanes
        self._kept = kept

    def __repr__(self) -> str:
        return f"<trueup.envs.Snapshot of {self.identity}>"


class Environment(gymnasium.Env):
    """An environment of the library, one lane of it.

    Parameters
    ----------
    identity : str
        Its id, such as ``"trueup/CartPole-v0"``.
    info : bool
        Whether steps give info; without, they are quicker.
    **options
        What can be set when it is made; ``about["options"]`` lists it with units and bounds. An environment of a market also has `run`: the
        path of a RUN.toml, whose data, venue and account it is then in, instead of data that are generated.

    Observations are float32 arrays of the space's shape, rewards floats, info a dict of floats by channel (``about["info"]`` has their
    units); the observation's components have names and units in ``about["observation"]``.

    Seeds are by Gymnasium's book: ``reset(seed=s)`` gives the same episode every time, and the resets after it, without a seed, the
    same ones after that. One that is never given a seed draws one.
    """

    metadata: dict[str, Any] = {"render_modes": []}

    def __init__(self, identity: str, render_mode: str | None = None, *, info: bool = True, **options: Any):
        if render_mode is not None:
            hint = "leave render_mode out"
            raise seeds.InputError(f"{identity} has nothing to render\n  hint: {hint}", hint=hint)
        self.render_mode = None
        if isinstance(options.get("run"), os.PathLike):
            options["run"] = os.fspath(options["run"])
        self._identity, self._options = identity, dict(options)
        self._lanes = _trueup.Lanes(identity, 1, "Disabled", 1, self._options)
        self._lanes.informs = self._informs = bool(info)
        #: What the environment is: title, spaces with names and units, info channels, options.
        self.about: dict[str, Any] = self._lanes.about()
        self.observation_space = spaces.box(self.about["observation"])
        self.action_space = spaces.action(self.about["action"])
        self._lanes.reader = self._read = spaces.ActionReader(self.action_space, None)
        if type(self).step is Environment.step:
            # What a step is, without a call of Python on the way to it; a subclass with a step of its own keeps that.
            self.step = self._lanes.step_one
        self._seeded = False
        self._flags = (np.empty(1, np.float64), np.empty(1, np.bool_), np.empty(1, np.bool_))

    def reset(self, *, seed: int | None = None, options: Mapping[str, Any] | None = None) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode. `options` are those that can be set at reset."""
        if seed is not None:
            lane_seed = seeds.whole(seed)
            super().reset(seed=int(seed))
        elif not self._seeded:
            lane_seed = seeds.whole(self.np_random_seed) if self._np_random_seed not in (None, -1) else seeds.fresh()
        else:
            lane_seed = None
        observation = np.empty(self.observation_space.shape, np.float32)
        self._lanes.reset(None if lane_seed is None else [lane_seed], None, dict(options or {}), observation)
        self._seeded = True
        return observation, self._lanes.info_of_one()

    def step(self, action: Any) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Take a step: observation, reward, terminated, truncated, info."""
        return self._lanes.step_one(action)

    def step_into(self, action: Any, observation: np.ndarray) -> tuple[float, bool, bool]:
        """Take a step, and write what is observed into `observation`: reward, terminated, truncated."""
        rewards, terminated, truncated = self._flags
        self._lanes.step(self._read(action), observation, rewards, terminated, truncated)
        return float(rewards[0]), bool(terminated[0]), bool(truncated[0])

    def privileged(self) -> dict[str, float]:
        """What was drawn for this episode and is not observed, by name: for critics, never for policies."""
        return {name: float(value) for (name, _), value in zip(self.about["privileged"], self._lanes.privileged()[0], strict=True)}

    def snapshot(self) -> Snapshot:
        """The environment as it is now."""
        kept = {"np_random": copy.deepcopy(self._np_random), "np_random_seed": self._np_random_seed, "seeded": self._seeded}
        kept["options"] = dict(self._options)
        return Snapshot(self._identity, self._lanes.copy(), kept)

    def restore(self, snapshot: Snapshot) -> None:
        """Go back to `snapshot`: what follows has the same bits as what followed then, for the same actions."""
        fits = isinstance(snapshot, Snapshot) and snapshot.identity == self._identity and "settings" not in snapshot._kept
        if not fits or snapshot._kept["options"] != self._options:
            hint = "restore snapshots of environments made alike"
            raise seeds.InputError(f"{snapshot!r} is no snapshot of {self}\n  hint: {hint}", hint=hint)
        self._lanes.load(snapshot._lanes)
        self._np_random, self._np_random_seed = copy.deepcopy(snapshot._kept["np_random"]), snapshot._kept["np_random_seed"]
        self._seeded = snapshot._kept["seeded"]

    def branch(self) -> Environment:
        """Another environment, which goes on from here with the same bits."""
        other = type(self)(self._identity, info=self._informs, **self._options)
        other.restore(self.snapshot())
        other.spec = self.spec
        return other

    def __deepcopy__(self, memory: dict[int, Any]) -> Environment:
        return self.branch()

    def __copy__(self) -> Environment:
        return self.branch()

    def __reduce__(self):
        # As EzPickle has it: a fresh one of the same arguments, which has to be reset.
        return (_again, (type(self), (self._identity,), {"info": self._informs, **self._options}, {"spec": self.spec}))

    def close(self) -> None:
        """Give up what it holds; a step or reset after that is an error."""
        self._lanes.close()

    def __repr__(self) -> str:
        return f"<trueup.envs.Environment {self._identity}>"


def _again(kind, arguments, options, attributes):
    environment = kind(*arguments, **options)
    environment.__dict__.update({name: value for name, value in attributes.items() if value is not None})
    return environment


def make(identity: str, **options: Any) -> Environment:
    """A single environment, without the wrappers that ``gymnasium.make`` puts around it."""
    return Environment(identity, **options)


def from_config(env_config: Mapping[str, Any]) -> Environment:
    """A single environment from an `env_config` dict, as RLlib hands it over: the id under ``"id"``, options beside it.

    >>> ray.tune.register_env("cart_pole", trueup.envs.from_config)                # doctest: +SKIP
    """
    config = dict(env_config)
    identity = config.pop("id", None)
    if identity is None:
        hint = f"env_config={{'id': ...}}; there are {', '.join(ids())}"
        raise seeds.InputError(f"env_config has no `id`\n  hint: {hint}", hint=hint)
    return Environment(identity, **config)
