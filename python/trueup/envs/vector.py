"""Vector environments: many lanes stepped together."""

from __future__ import annotations

import copy
import os
from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from .. import _trueup
from . import seeds, spaces
from .environment import Snapshot, _again


class VectorEnvironment(gymnasium.vector.VectorEnv):
    """Lanes of an environment, stepped together.

    Parameters
    ----------
    identity : str
        Its id, such as ``"trueup/CartPole-v0"``.
    num_envs : int
        Number of lanes.
    autoreset_mode : AutoresetMode or str
        When a lane whose episode is over is reset: "NextStep" (the default, as Gymnasium has it), "SameStep" or "Disabled".
    threads : int
        Into how many parts the lanes are split, which are stepped side by side. The bits are the same for any number.
    info : bool
        Whether steps give info; without, they are quicker.
    **options
        What can be set when it is made; ``about["options"]`` lists it with units and bounds.

    Every call gives fresh arrays: observations float32 (num_envs, ...), rewards float64, terminations and truncations bool (num_envs,).
    `step_into` writes into arrays of the caller's instead. A lane's bits depend on its seed, its episodes and its actions alone: not on
    the number of lanes, its place among them, or threads.

    Info has a float64 array for each channel, and beside it, under the name with ``_`` before it, which lanes it is told of. With
    "SameStep", ``final_obs`` has the last observations of the lanes whose episodes ended (an object array, None for others), and
    ``final_info`` their info.
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(
        self,
        identity: str,
        num_envs: int = 1,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        threads: int = 1,
        info: bool = True,
        render_mode: str | None = None,
        **options: Any,
    ):
        if render_mode is not None:
            raise _wrong(f"{identity} has nothing to render", "leave render_mode out")
        try:
            mode = AutoresetMode(autoreset_mode)
        except ValueError:
            raise _wrong(f"there is no autoreset mode {autoreset_mode!r}", f"one of {', '.join(m.value for m in AutoresetMode)}") from None
        for name, count in (("num_envs", num_envs), ("threads", threads)):
            if isinstance(count, bool) or not isinstance(count, (int, np.integer)) or count < 1:
                raise _wrong(f"{name} is {count!r}", "a whole number of at least 1")
        if isinstance(options.get("run"), os.PathLike):
            options["run"] = os.fspath(options["run"])
        self._identity, self._options = identity, dict(options)
        self._settings = {"num_envs": int(num_envs), "autoreset_mode": mode, "threads": int(threads), "info": bool(info)}
        self._lanes = _trueup.Lanes(identity, int(num_envs), mode.value, int(threads), self._options)
        #: What the environment is: title, spaces with names and units, info channels, options.
        self.about: dict[str, Any] = self._lanes.about()
        self.num_envs = int(num_envs)
        self.render_mode = None
        self.metadata = {**type(self).metadata, "autoreset_mode": mode}
        self.autoreset_mode = mode
        self.single_observation_space = spaces.box(self.about["observation"])
        self.single_action_space = spaces.action(self.about["action"])
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._read = spaces.ActionReader(self.single_action_space, self.num_envs)
        self._informs = bool(info) and bool(self.about["info"])
        self._lanes.informs = self._informs
        self._seeded = np.zeros(self.num_envs, np.bool_)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode in every lane, or in those of the bool array ``options["reset_mask"]``.

        From a seed s, lane i is given s + i; a sequence gives each its own. A lane without one goes on to its next episode; if it never
        had one, it draws one. Rows of lanes that are not reset hold what was observed there last.
        """
        options = dict(options or {})
        mask = options.pop("reset_mask", None)
        if mask is not None:
            if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_ or mask.shape != (self.num_envs,):
                found = f"{mask.dtype} {mask.shape}" if isinstance(mask, np.ndarray) else type(mask).__name__
                raise _wrong(f"options['reset_mask'] is {found}", f"a bool array of the shape ({self.num_envs},)")
            if not mask.any():
                raise _wrong(f"options['reset_mask'] selects none of the {self.num_envs} lanes", "select at least one, or do not reset")
            mask = np.ascontiguousarray(mask)
        of_lanes = seeds.of_lanes(seed, self.num_envs)
        if isinstance(seed, (int, np.integer)):
            super().reset(seed=int(seed))
        observations = self._last_observations(mask)
        which = np.ones(self.num_envs, np.bool_) if mask is None else mask
        given = [one is not None for one in of_lanes]
        if all(given):
            self._lanes.reset(of_lanes, mask, options, observations)
        else:
            # Lanes that have had a seed and are given none go on; the others are given one.
            needed = which & (np.array(given) | ~self._seeded)
            on = which & ~needed
            if needed.any():
                first = [seeds.fresh() if one is None else one for one in of_lanes]
                self._lanes.reset(first, None if needed.all() else needed, options, observations)
            if on.any():
                self._lanes.reset(None, None if on.all() else on, options, observations)
        self._seeded |= which
        self._observed = observations
        return observations.copy(), self._infos(which)

    def _last_observations(self, mask: np.ndarray | None) -> np.ndarray:
        last = getattr(self, "_observed", None)
        if mask is None or last is None:
            return np.zeros(self.observation_space.shape, np.float32)
        return last.copy()

    def step(self, actions: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Take a step in every lane: observations, rewards, terminations, truncations, info."""
        observations = np.empty(self.observation_space.shape, np.float32)
        rewards = np.empty(self.num_envs, np.float64)
        terminations, truncations = np.empty(self.num_envs, np.bool_), np.empty(self.num_envs, np.bool_)
        infos = self.step_into(actions, observations, rewards, terminations, truncations)
        return observations, rewards, terminations, truncations, infos

    def step_into(
        self,
        actions: Any,
        observations: np.ndarray,
        rewards: np.ndarray,
        terminations: np.ndarray,
        truncations: np.ndarray,
    ) -> dict[str, Any]:
        """Take a step in every lane, and write what comes of it into arrays of the caller's (C-contiguous; float32 of the space's shape,
        float64, bool, bool of the shape (num_envs,)); gives the info. After an error they hold what they held."""
        if getattr(observations, "shape", None) != self.observation_space.shape:
            raise _wrong(f"observations have the shape {np.shape(observations)}", f"{self.observation_space.shape} is asked for")
        self._lanes.step(self._read(actions), observations, rewards, terminations, truncations)
        # A reset with a mask gives the rows of other lanes as they are. Where such resets are the rule, nobody else may change these.
        self._observed = observations.copy() if self.autoreset_mode is AutoresetMode.DISABLED else observations
        return self._infos(None) if self._informs or self.autoreset_mode is AutoresetMode.SAME_STEP else {}

    def _infos(self, which: np.ndarray | None) -> dict[str, Any]:
        infos: dict[str, Any] = {}
        if self._informs:
            for name, values in self._lanes.info().items():
                infos[name], infos[f"_{name}"] = values, np.ones(self.num_envs, np.bool_) if which is None else which.copy()
        finals = self._lanes.finals() if which is None else None
        if finals is not None:
            ended, observations, final_info = finals
            last = np.full(self.num_envs, None, dtype=object)
            shape = self.single_observation_space.shape
            for lane in np.flatnonzero(ended):
                last[lane] = observations[lane].reshape(shape)
            infos["final_obs"], infos["_final_obs"] = last, ended
            told = {}
            for name, values in final_info.items() if self._informs else ():
                told[name], told[f"_{name}"] = np.where(ended, values, 0.0), ended.copy()
            infos["final_info"], infos["_final_info"] = told, ended.copy()
        return infos

    def privileged(self) -> np.ndarray:
        """What was drawn for each lane's episode and is not observed, shape (num_envs, parameters); ``about["privileged"]`` has their
        names and units. For critics, never for policies."""
        return self._lanes.privileged()

    def snapshot(self) -> Snapshot:
        """All lanes as they are now."""
        kept = {
            "seeded": self._seeded.copy(),
            "observed": None if getattr(self, "_observed", None) is None else self._observed.copy(),
            "np_random": copy.deepcopy(self._np_random),
            "np_random_seed": self._np_random_seed,
            "options": dict(self._options),
            "settings": {name: self._settings[name] for name in ("num_envs", "autoreset_mode")},
        }
        return Snapshot(self._identity, self._lanes.copy(), kept)

    def restore(self, snapshot: Snapshot) -> None:
        """Go back to `snapshot`: what follows has the same bits as what followed then, for the same actions."""
        own = {name: self._settings[name] for name in ("num_envs", "autoreset_mode")}
        fits = isinstance(snapshot, Snapshot) and snapshot.identity == self._identity
        if not fits or snapshot._kept["options"] != self._options or snapshot._kept.get("settings") != own:
            raise _wrong(f"{snapshot!r} is no snapshot of these lanes", "restore snapshots of environments made alike")
        self._lanes.load(snapshot._lanes)
        kept = snapshot._kept
        self._seeded = kept["seeded"].copy()
        self._observed = None if kept["observed"] is None else kept["observed"].copy()
        self._np_random, self._np_random_seed = copy.deepcopy(kept["np_random"]), kept["np_random_seed"]

    def branch(self) -> VectorEnvironment:
        """Another vector environment, which goes on from here with the same bits."""
        other = type(self)(self._identity, **self._settings, **self._options)
        other.restore(self.snapshot())
        other.spec = self.spec
        return other

    def branch_lane(self, source: int, target: int) -> None:
        """Make lane `target` a copy of lane `source`, which goes on with the same bits."""
        self._lanes.copy_lane(source, target)
        self._seeded[target] = self._seeded[source]
        if getattr(self, "_observed", None) is not None:
            self._observed = self._observed.copy()
            self._observed[target] = self._observed[source]

    def __deepcopy__(self, memory: dict[int, Any]) -> VectorEnvironment:
        return self.branch()

    def __copy__(self) -> VectorEnvironment:
        return self.branch()

    def __reduce__(self):
        # As EzPickle has it: fresh lanes of the same arguments, which have to be reset.
        return (_again, (type(self), (self._identity,), {**self._settings, **self._options}, {"spec": self.spec}))

    def close_extras(self, **kwargs: Any) -> None:
        self._lanes.close()

    def __repr__(self) -> str:
        return f"<trueup.envs.VectorEnvironment {self._identity}, {self.num_envs} lanes, {self.autoreset_mode.value}>"


def make_vec(identity: str, num_envs: int = 1, **arguments: Any) -> VectorEnvironment:
    """A vector environment; arguments are those of `VectorEnvironment`."""
    return VectorEnvironment(identity, num_envs, **arguments)


def _wrong(message: str, hint: str) -> seeds.InputError:
    return seeds.InputError(f"{message}\n  hint: {hint}", hint=hint)
