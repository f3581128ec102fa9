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
