"""The `VecEnv` of Stable-Baselines3: beside the library where it is installed, else beside a double of its base class."""

from __future__ import annotations

import importlib
import importlib.util
import sys
import types
from abc import ABC, abstractmethod

import numpy as np
import pytest

pytest.importorskip("gymnasium")

from trueup import envs

CART_POLE = "trueup/CartPole-v0"


class Double(ABC):
    """What the base class of version 2 does with the methods it asks for; source: its documentation and source text."""

    def __init__(self, num_envs, observation_space, action_space):
        self.num_envs, self.observation_space, self.action_space = num_envs, observation_space, action_space
        self.reset_infos = [{} for _ in range(num_envs)]
        self._seeds = [None for _ in range(num_envs)]
        self._options = [{} for _ in range(num_envs)]
        modes = self.get_attr("render_mode")
        assert all(mode == modes[0] for mode in modes)
        self.render_mode = modes[0]

    def _reset_seeds(self):
        self._seeds = [None for _ in range(self.num_envs)]

    def _reset_options(self):
        self._options = [{} for _ in range(self.num_envs)]

    def seed(self, seed=None):
        self._seeds = [None if seed is None else seed + lane for lane in range(self.num_envs)]
        return self._seeds

    def step(self, actions):
        self.step_async(actions)
        return self.step_wait()

    for _name in ("reset", "step_async", "step_wait", "close", "get_attr", "set_attr", "env_method", "env_is_wrapped"):
        locals()[_name] = abstractmethod(lambda self, *arguments, **keywords: None)


@pytest.fixture(scope="module")
def adapter():
    if importlib.util.find_spec("stable_baselines3") is None:
        packages = {
            name: types.ModuleType(name) for name in ("stable_baselines3", "stable_baselines3.common", "stable_baselines3.common.vec_env")
        }
        packages["stable_baselines3.common.vec_env"].VecEnv = Double
        sys.modules.update(packages)
    return importlib.import_module("trueup.envs.stable_baselines").StableBaselines


def test_steps_are_as_stable_baselines_wants_them(adapter):
    lanes = 4
    ours, twin = adapter(CART_POLE, lanes), envs.make_vec(CART_POLE, lanes, autoreset_mode="SameStep")
    assert ours.action_space == twin.single_action_space and ours.observation_space == twin.single_observation_space
    assert ours.seed(9) == [9, 10, 11, 12]
    assert np.array_equal(ours.reset(), twin.reset(seed=9)[0]) and len(ours.reset_infos) == lanes
    twin.action_space.seed(0)
    ended = 0
    for _ in range(150):
        actions = twin.action_space.sample()
        observations, rewards, dones, infos = ours.step(actions)
        expected = twin.step(actions)
        assert np.array_equal(observations, expected[0]) and rewards.dtype == np.float32
        assert np.array_equal(dones, expected[2] | expected[3]) and len(infos) == lanes
        for lane in range(lanes):
            assert ("terminal_observation" in infos[lane]) == dones[lane]
            if dones[lane]:
                ended += 1
                assert np.array_equal(infos[lane]["terminal_observation"], expected[4]["final_obs"][lane])
                assert infos[lane]["TimeLimit.truncated"] is bool(expected[3][lane])
    assert ended > 3
    # A seed is used once.
    assert not np.array_equal(ours.reset(), twin.reset(seed=9)[0])


def test_attributes_and_methods_are_those_of_the_vector(adapter):
    ours = adapter(CART_POLE, 3)
    assert ours.get_attr("num_envs") == [3, 3, 3] and ours.get_attr("num_envs", indices=0) == [3]
    assert ours.get_attr("num_envs", indices=np.int64(0)) == [3]
    assert ours.env_is_wrapped(object) == [False] * 3 and ours.env_is_wrapped(object, indices=[1]) == [False]
    ours.set_attr("note", "x")
    assert ours.get_attr("note") == ["x"] * 3
    with pytest.raises(NotImplementedError, match="hint"):
        ours.set_attr("note", "y", indices=[0])
    ours.reset()
    assert len(ours.env_method("privileged")) == 3
    ours.close()


@pytest.mark.skipif(importlib.util.find_spec("stable_baselines3") is None, reason="it is not installed")
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    ("algorithm", "identity"),
    [("PPO", CART_POLE), ("A2C", "trueup/Pendulum-v0"), ("DQN", CART_POLE), ("SAC", "trueup/Trade-v0")],
)
def test_its_learners_learn_in_them(algorithm, identity, tmp_path):
    import stable_baselines3
    from stable_baselines3.common.env_checker import check_env
    from stable_baselines3.common.evaluation import evaluate_policy
    from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

    adapter = importlib.import_module("trueup.envs.stable_baselines").StableBaselines
    balance = algorithm == "PPO"
    arguments = {"n_steps": 64, "batch_size": 256, "n_epochs": 10, "learning_rate": 1e-3} if balance else {}
    model = getattr(stable_baselines3, algorithm)("MlpPolicy", VecMonitor(adapter(identity, 16)), seed=0, device="cpu", **arguments)
    model.learn(40_000 if balance else 2_000)
    assert model.num_timesteps >= 2_000 and (identity != CART_POLE or len(model.ep_info_buffer) > 5)
    mean, _ = evaluate_policy(model, VecMonitor(adapter(identity, 4)), n_eval_episodes=8)
    assert mean > 200 if balance else np.isfinite(mean)
    model.save(tmp_path / "model")
    again = getattr(stable_baselines3, algorithm).load(tmp_path / "model", env=VecNormalize(adapter(identity, 16)), device="cpu")
    again.learn(500)
    check_env(envs.make(identity))
