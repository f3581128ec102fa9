"""Learners learn: the cross-entropy method, in NumPy, within a minute."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("gymnasium")

from trueup import envs


def cross_entropy(returns, size, rng, population=64, elite=8, rounds=12, spread=1.0):
    """The mean of the best of ever narrower Gaussians. Source: Rubinstein (1999); Mannor, Rubinstein and Gat (2003)."""
    mean, std = np.zeros(size), np.full(size, spread)
    for _ in range(rounds):
        candidates = mean + std * rng.normal(size=(population, size))
        best = candidates[np.argsort(returns(candidates))[-elite:]]
        mean, std = best.mean(axis=0), best.std(axis=0) + 0.02
    return mean


def returns_of(env, weights, act, steps, seed):
    """Return of the first episode of each lane, lane i playing by ``weights[i]``."""
    observations, _ = env.reset(seed=seed)
    total, alive = np.zeros(env.num_envs), np.ones(env.num_envs, np.bool_)
    for _ in range(steps):
        observations, rewards, terminated, truncated, _ = env.step(act(weights, observations))
        total += rewards * alive
        alive &= ~(terminated | truncated)
        if not alive.any():
            break
    return total


def test_a_pole_is_balanced():
    rng = np.random.default_rng(0)

    def push(weights, observations):
        return (np.einsum("lk,lk->l", weights, observations) > 0).astype(np.int64)

    env = envs.make_vec("trueup/CartPole-v0", 64)
    learnt = cross_entropy(lambda weights: returns_of(env, weights, push, 500, seed=1), 4, rng)
    test = envs.make_vec("trueup/CartPole-v0", 100)
    scores = returns_of(test, np.tile(learnt, (100, 1)), push, 500, seed=10_000)
    # Gymnasium counts CartPole-v1 as solved from a mean of 475 over 100 episodes on.
    assert scores.mean() > 475, scores.mean()


def shares(weights, observations):
    """A share of the portfolio in [-1, 1] by a linear policy of what is observed, with an intercept."""
    told = np.einsum("lk,lk->l", weights[:, :-1], observations) + weights[:, -1]
    return np.tanh(told).astype(np.float32)[:, None]


def test_a_planted_signal_is_found_and_beats_holding():
    """Returns follow those before them: who reads them gains, and who buys and holds does not."""
    rng = np.random.default_rng(1)
    market = {"rows": 4_000, "momentum": 0.3, "length": 100, "commission": 0.1}
    env = envs.make_vec("trueup/Trade-v0", 64, info=False, data_seed=1, **market)
    size = env.single_observation_space.shape[0]
    names = env.about["observation"]["names"]

    def returns(weights):
        # The mean of some episodes, for one alone is mostly luck.
        return np.mean([returns_of(env, weights, shares, 100, seed=1_000 * k) for k in range(3)], axis=0)

    learnt = cross_entropy(returns, size + 1, rng, rounds=10, spread=0.3)
    # Other data: the same law, other draws.
    test = envs.make_vec("trueup/Trade-v0", 64, info=False, data_seed=2, **market)
    gained = returns_of(test, np.tile(learnt, (64, 1)), shares, 100, seed=5)
    hold = np.zeros((64, size + 1))
    hold[:, -1] = 100.0
    held = returns_of(test, hold, shares, 100, seed=5)
    better = gained - held
    assert better.mean() > 3 * better.std() / np.sqrt(64), (better.mean(), better.std())
    assert gained.mean() > 0 and learnt[names.index("return_1")] > 0
