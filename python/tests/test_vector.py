"""Vector environments: a conformance of our own over every id, and beside Gymnasium's vector of single ones."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium")

from gymnasium.vector import AutoresetMode, SyncVectorEnv

import trueup
from trueup import envs

IDS = sorted(envs.ids())
CART_POLE = "trueup/CartPole-v0"
MODES = list(AutoresetMode)


def actions_of(env, steps, seed=0):
    env.action_space.seed(seed)
    return [env.action_space.sample() for _ in range(steps)]


@pytest.mark.parametrize("identity", IDS)
@pytest.mark.parametrize("mode", MODES)
def test_lanes_do_what_single_environments_do_side_by_side(identity, mode):
    lanes, steps = 5, 120
    ours = envs.make_vec(identity, lanes, autoreset_mode=mode)
    theirs = SyncVectorEnv([lambda: envs.make(identity)] * lanes, autoreset_mode=mode)
    assert ours.metadata["autoreset_mode"] is mode and ours.num_envs == lanes
    assert ours.observation_space == theirs.observation_space and ours.action_space == theirs.action_space
    _same(ours.reset(seed=11), theirs.reset(seed=11), identity)
    for number, actions in enumerate(actions_of(ours, steps)):
        one, other = ours.step(actions), theirs.step(actions)
        _same(one, other, (identity, mode, number))
        over = one[2] | one[3]
        if mode is AutoresetMode.DISABLED and over.any():
            _same(
                ours.reset(options={"reset_mask": over}),
                theirs.reset(options={"reset_mask": over.copy()}),
                (identity, number, "masked"),
            )


def _same(ours, theirs, where):
    assert len(ours) == len(theirs)
    for one, other in zip(ours[:-1], theirs[:-1], strict=True):
        assert one.dtype == other.dtype and one.shape == other.shape and one.tobytes() == other.tobytes(), where
    _same_info(ours[-1], theirs[-1], where)


def _same_info(ours, theirs, where):
    if not ours.get("final_info"):
        # Without channels theirs has an empty dict of the final info, and so have we.
        ours, theirs = dict(ours), dict(theirs)
    assert set(ours) == set(theirs), (where, set(ours) ^ set(theirs))
    for name, one in ours.items():
        other = theirs[name]
        if isinstance(one, dict):
            _same_info(one, other, (where, name))
        elif one.dtype == object:
            assert all(np.array_equal(a, b) if a is not None else b is None for a, b in zip(one, other, strict=True)), (
                where,
                name,
            )
        elif not name.startswith("_") and f"_{name}" in ours:
            mask = ours[f"_{name}"]
            assert np.array_equal(one[mask], other[mask], equal_nan=True), (where, name)
        else:
            assert np.array_equal(one, other), (where, name)


@pytest.mark.parametrize("identity", IDS)
def test_bits_depend_on_neither_lanes_nor_threads(identity):
    whole, threaded = envs.make_vec(identity, 6), envs.make_vec(identity, 6, threads=3)
    alone = envs.make_vec(identity, 1)
    first, second = whole.reset(seed=2)[0], threaded.reset(seed=2)[0]
    lane = alone.reset(seed=2 + 4)[0]
    assert first.tobytes() == second.tobytes() and first[4].tobytes() == lane[0].tobytes()
    for actions in actions_of(whole, 80):
        a, b, c = whole.step(actions), threaded.step(actions), alone.step(actions[4:5])
        assert all(x.tobytes() == y.tobytes() for x, y in zip(a[:4], b[:4], strict=True))
        assert all(x[4].tobytes() == y[0].tobytes() for x, y in zip(a[:4], c[:4], strict=True))


@pytest.mark.parametrize("identity", IDS)
@pytest.mark.parametrize("mode", MODES)
def test_snapshots_branches_and_lanes_that_are_copied(identity, mode):
    env = envs.make_vec(identity, 3, autoreset_mode=mode)
    env.reset(seed=5)
    before, after = actions_of(env, 10), actions_of(env, 25, seed=1)

    def on(env, actions):
        out = []
        for action in actions:
            step = env.step(action)
            out.append(tuple(part.tobytes() for part in step[:4]))
            over = step[2] | step[3]
            if mode is AutoresetMode.DISABLED and over.any():
                out.append(env.reset(options={"reset_mask": over})[0].tobytes())
        return out

    on(env, before)
    snapshot, branch, copied = env.snapshot(), env.branch(), copy.deepcopy(env)
    first = on(env, after)
    assert on(branch, after) == first and on(copied, after) == first
    env.restore(snapshot)
    assert on(env, after) == first
    env.branch_lane(0, 2)
    for action in after[:10]:
        action = np.array(action)
        action[2] = action[0]
        step = env.step(action)
        for part in step[:4]:
            assert part[2].tobytes() == part[0].tobytes()
        over = step[2] | step[3]
        if mode is AutoresetMode.DISABLED and over.any():
            observation = env.reset(options={"reset_mask": over})[0]
            assert observation[2].tobytes() == observation[0].tobytes()
    with pytest.raises(trueup.InputError, match="no lane 3"):
        env.branch_lane(0, 3)


def test_what_is_pickled_is_fresh_and_made_alike():
    env = gymnasium.make_vec(CART_POLE, 4, autoreset_mode="SameStep")
    assert isinstance(env, envs.VectorEnvironment) and env.spec.id == CART_POLE
    env.reset(seed=1)
    again = pickle.loads(pickle.dumps(env))
    assert again.num_envs == 4 and again.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP
    assert again.reset(seed=1)[0].tobytes() == env.reset(seed=1)[0].tobytes()


def test_steps_are_written_into_what_is_given():
    env, twin = envs.make_vec(CART_POLE, 3), envs.make_vec(CART_POLE, 3)
    env.reset(seed=0), twin.reset(seed=0)
    buffers = (np.empty((3, 4), np.float32), np.empty(3), np.empty(3, np.bool_), np.empty(3, np.bool_))
    actions = np.array([0, 1, 0])
    infos = env.step_into(actions, *buffers)
    expected = twin.step(actions)
    assert all(np.array_equal(a, b) for a, b in zip(buffers, expected[:4], strict=True)) and isinstance(infos, dict)
    wrong = [
        (np.empty((3, 4)), *buffers[1:]),
        (np.empty((4, 3), np.float32), *buffers[1:]),
        (np.empty((3, 8), np.float32)[:, ::2], *buffers[1:]),
        (buffers[0], np.empty(2), *buffers[2:]),
        (buffers[0], np.empty(3, np.float32), *buffers[2:]),
        (buffers[0], buffers[1], buffers[2], buffers[2]),
        (np.zeros((3, 4), np.float32), buffers[1], buffers[2], np.empty(3, np.uint8)),
    ]
    frozen = np.zeros((3, 4), np.float32)
    frozen.flags.writeable = False
    for given in [*wrong, (frozen, *buffers[1:])]:
        with pytest.raises((trueup.InputError, TypeError, ValueError)):
            env.step_into(actions, *given)
    # Nothing has moved.
    assert env.step(actions)[0].tobytes() == twin.step(actions)[0].tobytes()


def test_fresh_arrays_are_fresh():
    env = envs.make_vec(CART_POLE, 3)
    first, _ = env.reset(seed=0)
    kept = first.copy()
    second, rewards, *_ = env.step(np.array([0, 1, 0]))
    third, *_ = env.step(np.array([0, 1, 0]))
    assert np.array_equal(first, kept) and not np.shares_memory(second, third) and rewards.dtype == np.float64


def test_seeds_of_lanes():
    env = envs.make_vec(CART_POLE, 3)
    observations = env.reset(seed=10)[0]
    assert env.reset(seed=[10, 11, 12])[0].tobytes() == observations.tobytes()
    swapped = env.reset(seed=[12, 11, 10])[0]
    assert swapped[0].tobytes() == observations[2].tobytes()
    # A lane that is given none goes on to its next episode.
    mixed = env.reset(seed=[10, None, 12])[0]
    assert mixed[0].tobytes() == observations[0].tobytes() and mixed[1].tobytes() != observations[1].tobytes()
    for wrong, words in [
        (-1, "at least 0"),
        ([1, 2], "2 seeds"),
        ("abc", "seed"),
        (1.5, "seed"),
        ([1, -2, 3], "at least 0"),
        (True, "seed"),
    ]:
        with pytest.raises(gymnasium.error.Error, match=words):
            env.reset(seed=wrong)
    assert np.isfinite(env.reset(seed=2**200)[0]).all()
    assert envs.make_vec(CART_POLE, 3).reset()[0].tobytes() != envs.make_vec(CART_POLE, 3).reset()[0].tobytes()


def test_masks_that_are_none_are_refused():
    env = envs.make_vec(CART_POLE, 3, autoreset_mode="Disabled")
    env.reset(seed=0)
    for mask, words in [
        ([True, False, False], "reset_mask"),
        (np.array([1, 0, 0]), "reset_mask"),
        (np.array([True, False]), "reset_mask"),
        (np.zeros(3, np.bool_), "selects none"),
    ]:
        with pytest.raises(trueup.InputError, match=words):
            env.reset(options={"reset_mask": mask})
    before = env.step(np.zeros(3, np.int64))[0]
    after, _ = env.reset(options={"reset_mask": np.array([False, True, False])})
    assert np.array_equal(before[[0, 2]], after[[0, 2]]) and not np.array_equal(before[1], after[1])


@pytest.mark.parametrize(
    "arguments",
    [
        {"num_envs": 0},
        {"num_envs": -3},
        {"num_envs": 1.5},
        {"num_envs": True},
        {"threads": 0},
        {"autoreset_mode": "Later"},
        {"render_mode": "human"},
    ],
)
def test_what_cannot_be_made_is_refused(arguments):
    with pytest.raises(trueup.InputError) as error:
        envs.make_vec(CART_POLE, **arguments)
    assert error.value.hint


def test_actions_of_the_wrong_kind_are_refused_and_nothing_moves():
    env, twin = envs.make_vec(CART_POLE, 3), envs.make_vec(CART_POLE, 3)
    with pytest.raises(trueup.InputError, match="has not been reset"):
        env.step(np.zeros(3, np.int64))
    env.reset(seed=0), twin.reset(seed=0)
    for actions in [
        np.zeros(2, np.int64),
        np.zeros((3, 1), np.int64),
        np.zeros(3),
        [0, 1, 2],
        [0, 1, -1],
        0,
        None,
        [[0], [1, 2], [3]],
        "010",
    ]:
        with pytest.raises(trueup.InputError):
            env.step(actions)
    good = np.array([0, 1, 0], np.int8)
    assert env.step(good)[0].tobytes() == twin.step([0, 1, 0])[0].tobytes()
    env.close()
    with pytest.raises(trueup.InputError, match="closed"):
        env.step(good)


def test_two_threads_on_one_environment_do_no_harm():
    import threading

    env = envs.make_vec(CART_POLE, 512)
    env.reset(seed=0)
    raised = []

    def work():
        for _ in range(200):
            try:
                env.step(np.zeros(512, np.int64))
            except RuntimeError as error:
                raised.append(error)

    threads = [threading.Thread(target=work) for _ in range(4)]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    assert env.step(np.zeros(512, np.int64))[0].shape == (512, 4)


def test_bound_buffers_are_read_and_written_in_place():
    lanes = 4
    buffers = {
        "observations": np.zeros((lanes, 4), np.float32),
        "actions": np.zeros(lanes, np.int32),
        "rewards": np.zeros(lanes, np.float32),
        "terminals": np.zeros(lanes, np.uint8),
        "truncations": np.zeros(lanes, np.bool_),
    }
    bound = envs.BoundEnvironment(CART_POLE, lanes, **buffers)
    twin = envs.make_vec(CART_POLE, lanes, autoreset_mode="SameStep")
    assert bound.reset(seed=3)[0] is buffers["observations"]
    assert np.array_equal(buffers["observations"], twin.reset(seed=3)[0])
    ended = 0
    for actions in actions_of(twin, 200):
        buffers["actions"][:] = actions
        bound.step()
        observations, rewards, terminated, truncated, _ = twin.step(actions)
        assert np.array_equal(buffers["observations"], observations) and np.array_equal(buffers["rewards"], rewards.astype(np.float32))
        assert np.array_equal(buffers["terminals"], terminated) and np.array_equal(buffers["truncations"], truncated)
        ended += terminated.sum()
    assert ended > 3
    made = envs.BoundEnvironment(CART_POLE, 2)
    made.reset(seed=1)
    assert made.step(np.array([0, 1]))[1] is made.rewards
    for name, wrong in [
        ("rewards", np.zeros(3)),
        ("actions", np.zeros(lanes)),
        ("observations", [[0.0]]),
        ("terminals", np.zeros(lanes, np.int64)),
    ]:
        with pytest.raises(trueup.InputError, match=name):
            envs.BoundEnvironment(CART_POLE, lanes, **{name: wrong})


def test_bound_buffers_answer_to_whatever_is_in_them():
    bound = envs.BoundEnvironment(CART_POLE, 3)
    with pytest.raises(trueup.InputError, match="has not been reset"):
        bound.step()
    twin = envs.BoundEnvironment(CART_POLE, 3)
    bound.reset(seed=2), twin.reset(seed=2)
    kept = bound.observations.copy()
    for wrong in ([0, 1, 2], [0, -1, 1], [2**40, 0, 0]):
        bound.actions[:] = wrong
        with pytest.raises(trueup.InputError, match="lane") as error:
            bound.step()
        assert error.value.hint and np.array_equal(bound.observations, kept)
    assert np.array_equal(bound.step([0, 1, 0])[0], twin.step([0, 1, 0])[0])
    # Actions are given in any form that NumPy writes into an array, views of the buffer itself among them.
    for given in ([1, 0, 1], np.array([1, 1, 0]), np.array([0, 1, 1], np.int32), np.array([1, 9, 0, 9, 1])[::2], 1, bound.actions, bound.actions[::-1]):
        twin.actions[...] = np.array(given)
        assert np.array_equal(bound.step(given)[0], twin.step()[0]) and np.array_equal(bound.actions, twin.actions)
    long = np.zeros(4, np.int64)
    within = envs.BoundEnvironment(CART_POLE, 3, actions=long[:3])
    within.reset(seed=2)
    long[:] = [0, 1, 1, 0]
    assert len(within.step(long[1:])[0]) == 3 and long.tolist() == [1, 1, 0, 0]
    for given in (np.zeros(2, np.int64), "x", {}, np.zeros((2, 3))):
        with pytest.raises((TypeError, ValueError)):
            bound.step(given)
    real = envs.BoundEnvironment("trueup/Pendulum-v0", 2)
    real.reset(seed=0)
    for wrong in (np.nan, np.inf, 3.0):
        real.actions[1] = wrong
        with pytest.raises(trueup.InputError, match="lane 1"):
            real.step()
    real.actions[:] = 0.5
    real.step()
    bound.close()
    for call in (bound.step, lambda: bound.reset(seed=0)):
        with pytest.raises(trueup.InputError, match="closed"):
            call()


def test_info_of_ends_can_be_left_out_and_changes_nothing_else():
    told, silent = (envs.make_vec("trueup/Servo-v0", 3, autoreset_mode="SameStep", info=info, max_steps=5) for info in (True, False))
    told.reset(seed=1), silent.reset(seed=1)
    for actions in actions_of(told, 12):
        ours, theirs = told.step(actions), silent.step(actions)
        assert all(np.array_equal(a, b) for a, b in zip(ours[:4], theirs[:4], strict=True))
        if "final_obs" in ours[4]:
            assert all(np.array_equal(a, b) for a, b in zip(ours[4]["final_obs"], theirs[4]["final_obs"], strict=True))
            assert len(ours[4]["final_info"]) > 2 and theirs[4]["final_info"] == {}
    # A snapshot of one goes on in the other, which stays as it was made.
    silent.restore(told.snapshot()), told.restore(silent.snapshot())
    for actions in actions_of(told, 12):
        ours, theirs = told.step(actions), silent.step(actions)
        assert np.array_equal(ours[0], theirs[0])
        if "final_obs" in ours[4]:
            assert len(ours[4]["final_info"]) > 2 and theirs[4]["final_info"] == {}


@pytest.mark.parametrize("identity", IDS)
@pytest.mark.parametrize("vectorization", [None, "sync", "async"])
def test_gymnasiums_own_vectors_and_wrappers_go_around_them(identity, vectorization):
    from gymnasium.wrappers.vector import ClipReward, NormalizeObservation, RecordEpisodeStatistics

    if vectorization == "async" and identity not in (CART_POLE, "trueup/Trade-v0"):
        pytest.skip("processes are started for two of them")
    made = gymnasium.make_vec(identity, 3, vectorization_mode=vectorization)
    env = NormalizeObservation(ClipReward(RecordEpisodeStatistics(made), -1.0, 1.0))
    first, _ = env.reset(seed=4)
    again = [first.tobytes()]
    env.action_space.seed(0)
    for _ in range(30):
        observations, rewards, terminated, truncated, info = env.step(env.action_space.sample())
        assert observations.shape[0] == 3 and np.isfinite(observations).all() and (np.abs(rewards) <= 1).all()
        again.append(observations.tobytes())
    env.close()
    if vectorization == "sync":
        own = NormalizeObservation(ClipReward(RecordEpisodeStatistics(gymnasium.make_vec(identity, 3)), -1.0, 1.0))
        assert own.reset(seed=4)[0].tobytes() == again[0]
        own.action_space.seed(0)
        assert [own.step(own.action_space.sample())[0].tobytes() for _ in range(30)] == again[1:]
