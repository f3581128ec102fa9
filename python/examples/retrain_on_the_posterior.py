"""Train in a simulator, fail on the real thing, find out why, train again on what was found.

    python python/examples/retrain_on_the_posterior.py

The real thing is a simulator too, of which the learner is shown recordings alone: a servo with dry friction and a late drive. Learning is
the cross-entropy method on a policy of five numbers.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

import trueup
from trueup import envs

ID = "trueup/Servo-v0"

# The servo as its designer has it.
TWIN = """
[twin]
model = "joint"

[parameters]
inertia          = { value = 0.020, unit = "kg m^2",       uncertainty = 0.2 }
viscous_friction = { value = 0.050, unit = "N m s/rad",    uncertainty = 0.2 }
gravity_torque   = { value = 0.300, unit = "N m",          uncertainty = 0.2 }
gain             = { value = 1.500, unit = "N m per unit", uncertainty = 0.0 }

[channels]
command  = { column = "u" }
position = { column = "q", unit = "rad" }
"""

# The servo as it is; nobody below reads this but the environment that stands for it.
REAL = TWIN.replace("0.020", "0.023").replace("0.300", "0.280") + """
[[mechanism]]
name = "coulomb_friction"
torque = 0.35

[[mechanism]]
name = "command_delay"
seconds = 0.03
"""


def act(weights, observations):
    """A command from the error, velocities, the load of gravity, and a push against what sticks: linear in five weights a lane."""
    position, velocity, error, wanted_velocity = (observations[:, k] for k in range(4))
    features = np.stack([error, velocity, wanted_velocity, np.sin(position), np.tanh(30.0 * error)], axis=1)
    return np.clip(np.einsum("lk,lk->l", weights, features), -1.0, 1.0).astype(np.float32)[:, None]


def returns(env, weights, seed):
    """Return of the first episode of each lane, lane i acting by weights[i]."""
    observations, _ = env.reset(seed=seed)
    total, going = np.zeros(env.num_envs), np.ones(env.num_envs, np.bool_)
    while going.any():
        observations, rewards, terminated, truncated, _ = env.step(act(weights, observations))
        total += rewards * going
        going &= ~(terminated | truncated)
    return total


def learnt(twin, rounds=12, population=64, elite=8):
    """The policy that the cross-entropy method finds in the servo of `twin`, every lane of which draws its own where it is uncertain."""
    rng = np.random.default_rng(0)
    env = envs.make_vec(ID, population, info=False, twin=twin, max_steps=250)
    mean, std = np.zeros(5), np.array([5.0, 1.0, 1.0, 1.0, 1.0])
    for number in range(rounds):
        candidates = mean + std * rng.normal(size=(population, 5))
        best = candidates[np.argsort(returns(env, candidates, seed=1_000 * number))[-elite:]]
        mean, std = best.mean(axis=0), best.std(axis=0) + 0.02
    return mean


def score(weights):
    """Mean return of 64 episodes on the real servo, and its standard error."""
    env = envs.make_vec(ID, 64, info=False, twin=REAL, max_steps=250)
    got = returns(env, np.tile(weights, (64, 1)), seed=77_000)
    return got.mean(), got.std() / 8.0


def recording(seed):
    """Ten seconds of the real servo under commands that step at random."""
    rng = np.random.default_rng(seed)
    env = envs.make(ID, twin=REAL, max_steps=500)
    commands = np.repeat(rng.uniform(-0.9, 0.9, size=50), 10).astype(np.float32)
    observation, _ = env.reset(seed=seed)
    positions = []
    for command in commands:
        positions.append(float(observation[0]))
        observation, *_ = env.step(np.array([command]))
    step = env.about["seconds_a_step"]
    return trueup.Recording({"t": step * np.arange(len(commands)), "u": commands, "q": np.array(positions)}, name=f"servo {seed}")


if __name__ == "__main__":
    first = learnt(TWIN)
    print("trained on the twin as given:       return on the real servo {:8.3f} +- {:.3f}".format(*score(first)))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "twin.toml"
        path.write_text(TWIN)
        diagnosis = trueup.diagnose(path, [recording(1), recording(2)], recording(3))
    print(f"diagnosed: {diagnosis.verdict}, {', '.join(diagnosis.mechanisms)}")
    # The trued twin has a [posterior]: each lane, at each reset, draws a servo that the recordings allow.
    second = learnt(diagnosis.trued_toml)
    print("trained on draws of the trued twin: return on the real servo {:8.3f} +- {:.3f}".format(*score(second)))
