"""Steps a second of the cart-pole through Python: this package's, and Gymnasium's.

    python python/benches/environments.py [--seconds 2] [--repeats 5]

Prints a table in Markdown: the median over the repeats of nanoseconds of CPU time a step of one lane, and their range. Actions are drawn
before the clock starts; episodes that end are reset by the environments themselves.
"""

from __future__ import annotations

import argparse
import platform
import statistics
import time

import gymnasium
import numpy as np

import trueup
from trueup import envs

ID = "trueup/CartPole-v0"


def steps(env, step, lanes, seconds):
    """Nanoseconds of CPU time a step of a lane."""
    rng = np.random.default_rng(0)
    actions = [rng.integers(2, size=lanes) for _ in range(64)]
    env.reset(seed=0)
    count, began, started = 0, time.process_time(), time.perf_counter()
    while time.perf_counter() - started < seconds:
        for action in actions:
            step(action)
        count += len(actions)
    return 1e9 * (time.process_time() - began) / (count * lanes)


def fresh(lanes):
    env = envs.make_vec(ID, lanes)
    return env, env.step


def quiet(lanes):
    env = envs.make_vec(ID, lanes, info=False)
    buffers = (np.empty((lanes, 4), np.float32), np.empty(lanes), np.empty(lanes, np.bool_), np.empty(lanes, np.bool_))
    return env, lambda actions: env.step_into(actions, *buffers)


def bound(lanes):
    env = envs.BoundEnvironment(ID, lanes)

    def step(actions):
        env.actions[:] = actions
        env.step()

    return env, step


def gymnasium_vector(lanes):
    env = gymnasium.make_vec("CartPole-v1", lanes)
    return env, env.step


def gymnasium_sync(lanes):
    env = gymnasium.make_vec("CartPole-v1", lanes, vectorization_mode="sync")
    return env, env.step


KINDS = {
    "trueup, `step`": (fresh, (1, 16, 256, 4096)),
    "trueup, `step_into`, without info": (quiet, (1, 16, 256, 4096)),
    "trueup, `BoundEnvironment`": (bound, (1, 16, 256, 4096)),
    "gymnasium, its own vector in NumPy": (gymnasium_vector, (1, 16, 256, 4096)),
    "gymnasium, `SyncVectorEnv`": (gymnasium_sync, (1, 16, 256)),
}

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=2.0, help="length of a measurement [s]")
    parser.add_argument("--repeats", type=int, default=5)
    arguments = parser.parse_args()
    versions = f"trueup {trueup.__version__}, gymnasium {gymnasium.__version__}, NumPy {np.__version__}, Python {platform.python_version()}"
    print(f"{versions}; {platform.machine()}\n")
    print("| cart-pole | 1 lane | 16 lanes | 256 lanes | 4096 lanes |\n|---|---|---|---|---|")
    for name, (make, counts) in KINDS.items():
        cells = []
        for lanes in (1, 16, 256, 4096):
            if lanes not in counts:
                cells.append("")
                continue
            env, step = make(lanes)
            times = [steps(env, step, lanes, arguments.seconds) for _ in range(arguments.repeats)]
            cells.append(f"{statistics.median(times):,.0f} ns ({min(times):,.0f} to {max(times):,.0f})")
        print(f"| {name} | {' | '.join(cells)} |", flush=True)
