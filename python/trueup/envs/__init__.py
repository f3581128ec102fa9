"""Environments for reinforcement learning, as Gymnasium has them (1.0 and later).

>>> env = trueup.envs.make("trueup/CartPole-v0")                              # doctest: +SKIP
>>> envs = trueup.envs.make_vec("trueup/CartPole-v0", 4096, threads=2)        # doctest: +SKIP
>>> gymnasium.make("trueup/CartPole-v0"), gymnasium.make_vec("trueup/CartPole-v0", 16)   # doctest: +SKIP

- `Environment`, `VectorEnvironment`: single and vector environments of Gymnasium.
- `BoundEnvironment`: steps in place on buffers that were given once, as PufferLib has it.
- `stable_baselines.StableBaselines`: a `VecEnv` of Stable-Baselines3 (imported when it is asked for).
- `from_config`: made from an `env_config` dict, as RLlib has it.

Every environment can be copied on its way: ``snapshot()``, ``restore()``, ``branch()``. Pickling makes a fresh one from the same
arguments; ``copy.deepcopy`` is a branch.
"""

try:
    import gymnasium as _gymnasium
except ImportError as error:
    raise ImportError("trueup.envs needs gymnasium\n  hint: pip install 'trueup[envs]', or pip install 'gymnasium>=1.0'") from error

from .bound import BoundEnvironment
from .environment import Environment, Snapshot, from_config, make
from .registration import ids, register
from .vector import VectorEnvironment, make_vec

register()
del _gymnasium

__all__ = [
    "BoundEnvironment",
    "Environment",
    "Snapshot",
    "VectorEnvironment",
    "from_config",
    "ids",
    "make",
    "make_vec",
    "register",
]


def __getattr__(name: str):
    if name == "stable_baselines":
        import importlib

        return importlib.import_module(".stable_baselines", __name__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
