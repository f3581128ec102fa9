"""What a step of an environment costs through Python: this package's, Gymnasium's, PufferLib's, gym-anytrading's, gym-trading-env's.

    python python/benches/environments.py [--seconds 0.3] [--repeats 9] [--only TITLE]

Prints tables in Markdown: the median over the repeats of nanoseconds of processor time a step of one lane, with the quartiles, and each
peer's median over that of this package. Those of a table take turns, so that all of them meet the same machine. Actions are drawn before
the clock starts; episodes that end are reset, within the time. Peers that cannot be had here are left out, with a word why.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import os
import platform
import statistics
import sys
import time
from collections.abc import Callable

# Threads of linear algebra wait for work that never comes, on the processor's time.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import gymnasium
import numpy as np
import peers

import trueup
from trueup import envs

CART_POLE = "trueup/CartPole-v0"
#: A delay of up to two steps, noise of the position's sensor, and three parameters of which each episode draws its own.
DRAWN = """
[[mechanism]]
name = "command_delay"
seconds = 0.02
[[mechanism]]
name = "noise"
std = 0.01
[[randomize.parameter]]
mechanism = "command_delay"
parameter = "seconds"
distribution = "uniform"
low = 0.0
high = 0.04
[[randomize.parameter]]
mechanism = "noise"
parameter = "std"
distribution = "uniform"
low = 0.0
high = 0.02
[[randomize.parameter]]
parameter = "gravity"
distribution = "uniform"
low = 0.9
high = 1.1
relative = true
"""

#: Takes so many steps; what is made of a number of lanes.
Run = Callable[[int], None]


def single(env, actions: list) -> Run:
    """Steps of a single environment, with resets."""
    env.reset(seed=0)
    count = len(actions)

    def run(steps: int) -> None:
        step, reset = env.step, env.reset
        for k in range(steps):
            _, _, terminated, truncated, _ = step(actions[k % count])
            if terminated or truncated:
                reset()

    return run


def keeping(env, actions: list) -> Run:
    """The same, of which the last 64 observations are kept as they were given, so that none of their arrays is filled again."""
    env.reset(seed=0)
    count, kept = len(actions), [None] * 64

    def run(steps: int) -> None:
        step, reset = env.step, env.reset
        for k in range(steps):
            kept[k % 64], _, terminated, truncated, _ = step(actions[k % count])
            if terminated or truncated:
                reset()

    return run


def vector(env, step: Callable, lanes: int, kind=np.int64) -> Run:
    """Steps of many lanes, which reset themselves."""
    rng = np.random.default_rng(0)
    actions = [rng.integers(2, size=lanes).astype(kind) for _ in range(64)]
    env.reset(seed=0)

    def run(steps: int) -> None:
        for k in range(steps):
            step(actions[k % 64])

    return run


def quiet(lanes: int, **options) -> Run:
    env = envs.make_vec(CART_POLE, lanes, info=False, **options)
    buffers = (np.empty((lanes, 4), np.float32), np.empty(lanes), np.empty(lanes, np.bool_), np.empty(lanes, np.bool_))
    return vector(env, lambda actions: env.step_into(actions, *buffers), lanes)


def fresh(lanes: int) -> Run:
    env = envs.make_vec(CART_POLE, lanes)
    return vector(env, env.step, lanes)


def bound(lanes: int, **options) -> Run:
    env = envs.BoundEnvironment(CART_POLE, lanes, actions=np.zeros(lanes, np.int32), **options)
    return vector(env, env.step, lanes, np.int32)


def in_numpy(lanes: int) -> Run:
    env = gymnasium.make_vec("CartPole-v1", lanes)
    return vector(env, env.step, lanes)


def one_after_another(lanes: int) -> Run:
    env = gymnasium.make_vec("CartPole-v1", lanes, vectorization_mode="sync")
    return vector(env, env.step, lanes)


def puffer(lanes: int) -> Run:
    env = peers.PufferCartPole(lanes)
    return vector(env, env.step, lanes, np.float32)


def choices() -> list[int]:
    return [int(way) for way in np.random.default_rng(0).integers(2, size=4096)]


#: One of two positions at each step: half of the steps turn it around.
WAYS = [int(way) for way in np.random.default_rng(0).integers(2, size=4096)]


def ways(kind: Callable) -> list:
    """These positions, as an environment's actions."""
    return [kind(way) for way in WAYS]


def trade_env(**options):
    """All of 5,000 bars as one episode, as the peers have it. What is held drifts with prices, which they do not trade: nor do shares within the
    band."""
    return gymnasium.make("trueup/Trade-v0", rows=peers.BARS, length=0, band=0.5, **options)


def trade(loop: Callable = single, **options) -> Run:
    return loop(trade_env(**options), ways(lambda way: np.array([2 * way - 1], np.float32)))


def turned() -> str:
    """How often each market's position is another after a step, by what each tells of itself, in the first 2,000 steps of an episode."""
    told = []
    makers = [
        ("trueup", trade_env, lambda env, info: info["orders"], lambda way: np.array([2 * way - 1], np.float32)),
        ("gym-anytrading", peers.anytrading, lambda env, info: info["position"], int),
        ("gym-trading-env", peers.trading_env, lambda env, info: info["position"], int),
    ]
    for name, make, position, kind in makers:
        try:
            env = make()
        except peers.Missing:
            continue
        _, info = env.reset(seed=0)
        before, turns = position(env, info), 0
        for way in WAYS[:2000]:
            *_, info = env.step(kind(way))
            now = position(env, info)
            turns += now != before
            before = now
        told.append(f"{name} {turns}")
    return f"Of 2,000 steps by the same draws so many turn the position: {', '.join(told)}."


MARKET = "One market of 5,000 bars, long or short by the same draws"

TABLES: dict[str, list[tuple[str, int, Callable[[], Run]]]] = {
    "One cart-pole, by `gymnasium.make`": [
        ("trueup/CartPole-v0", 1, lambda: single(gymnasium.make(CART_POLE), choices())),
        ("trueup/CartPole-v0, observations kept", 1, lambda: keeping(gymnasium.make(CART_POLE), choices())),
        ("Gymnasium's CartPole-v1", 1, lambda: single(gymnasium.make("CartPole-v1"), choices())),
    ],
    "One cart-pole, on buffers that were bound": [
        ("`BoundEnvironment`", 1, lambda: bound(1)),
        ("PufferLib's", 1, lambda: puffer(1)),
    ],
    "4,096 cart-poles": [
        ("`BoundEnvironment`", 4096, lambda: bound(4096)),
        ("`step_into`, without info", 4096, lambda: quiet(4096)),
        ("`step`", 4096, lambda: fresh(4096)),
        ("PufferLib's", 4096, lambda: puffer(4096)),
        ("Gymnasium's own vector in NumPy", 4096, lambda: in_numpy(4096)),
    ],
    "4,096 cart-poles with a delay, noise and parameters drawn for each episode, beside PufferLib's bare ones": [
        ("`BoundEnvironment`", 4096, lambda: bound(4096, twin=DRAWN)),
        ("PufferLib's", 4096, lambda: puffer(4096)),
    ],
    "16 cart-poles": [
        ("`step_into`, without info", 16, lambda: quiet(16)),
        ("`step`", 16, lambda: fresh(16)),
        ("Gymnasium's own vector in NumPy", 16, lambda: in_numpy(16)),
        ("Gymnasium's `SyncVectorEnv`", 16, lambda: one_after_another(16)),
    ],
    MARKET: [
        ("trueup/Trade-v0, without info", 1, lambda: trade(info=False)),
        ("trueup/Trade-v0, without info, observations kept", 1, lambda: trade(keeping, info=False)),
        ("trueup/Trade-v0, with twelve figures of info", 1, trade),
        ("gym-anytrading's StocksEnv", 1, lambda: single(peers.anytrading(), ways(int))),
        ("gym-trading-env's TradingEnv", 1, lambda: single(peers.trading_env(), ways(int))),
    ],
}


def measured(runs: list[tuple[int, Run]], seconds: float, repeats: int) -> list[list[float]]:
    """Nanoseconds of processor time a step of a lane, of each run, taking turns."""
    counts = []
    for _, run in runs:
        count, spent = 1, 0.0
        while spent < seconds / 8:
            began = time.process_time()
            run(count)
            spent = time.process_time() - began
            count *= 2
        counts.append(max(1, int(count / 2 * seconds / spent)))
    told: list[list[float]] = [[] for _ in runs]
    for _ in range(repeats):
        for times, (lanes, run), count in zip(told, runs, counts, strict=True):
            began = time.process_time()
            run(count)
            times.append(1e9 * (time.process_time() - began) / (count * lanes))
    return told


def table(title: str, rows: list[tuple[str, int, Callable[[], Run]]], seconds: float, repeats: int) -> None:
    names, runs = [], []
    for name, lanes, make in rows:
        try:
            runs.append((lanes, make()))
            names.append(name)
        except peers.Missing as missing:
            print(f"{name} is left out: {missing}", file=sys.stderr)
    told = measured(runs, seconds, repeats)
    own = statistics.median(told[0])
    print(f"\n## {title}\n\n| | ns a step of a lane, median (quartiles) | over the first |\n|---|---|---|")
    for name, times in zip(names, told, strict=True):
        middle = statistics.median(times)
        low, _, high = statistics.quantiles(times, n=4)
        print(f"| {name} | {middle:,.1f} ({low:,.1f} to {high:,.1f}) | {middle / own:.2f} |", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=0.3, help="processor time of a measurement [s]")
    parser.add_argument("--repeats", type=int, default=9)
    parser.add_argument("--only", default="", help="the tables with this in their title")
    arguments = parser.parse_args()
    print("# Environments through Python, beside their peers\n")
    print("`./x environments` measures this anew. Nanoseconds of processor time a step of one lane, resets within; those of a table take turns.\n")
    versions = [f"trueup {trueup.__version__}", f"Python {platform.python_version()}", f"NumPy {np.__version__}"]
    for name in ("gymnasium", "gym-anytrading", "gym-trading-env"):
        try:
            versions.append(f"{name} {importlib.metadata.version(name)}")
        except importlib.metadata.PackageNotFoundError:
            continue
    print(f"{', '.join(versions)}, PufferLib {peers.PUFFER} (its cart-pole in C, built with the flags of its setup.py); {platform.machine()}.")
    for title, rows in TABLES.items():
        if arguments.only in title:
            table(title, rows, arguments.seconds, arguments.repeats)
        if title == MARKET and arguments.only in title:
            print(f"\n{turned()}")
