"""Single environments: Gymnasium's own check on every id, seeds, snapshots, bad input, and a fuzz of the interface."""

from __future__ import annotations

import copy
import pickle
import tomllib
import warnings
import weakref

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium")

from gymnasium.utils.env_checker import check_env

import trueup
from trueup import envs

IDS = sorted(envs.ids())
CART_POLE = "trueup/CartPole-v0"


def played(env, steps, seed=None, actions_seed=0):
    """What comes of random actions, as bytes."""
    out = [env.reset(seed=seed)[0].tobytes()]
    env.action_space.seed(actions_seed)
    for _ in range(steps):
        observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
        out.append((observation.tobytes(), reward, terminated, truncated, tuple(info.items())))
        if terminated or truncated:
            out.append(env.reset()[0].tobytes())
    return out


def test_what_was_observed_is_the_callers_alone_however_it_is_held():
    env = envs.make(CART_POLE)
    env.reset(seed=1)
    kept, bytes_then = [], []
    for k in range(400):
        observation, _, terminated, _, _ = env.step(k % 2)
        bytes_then.append(observation.tobytes())
        # By a variable, a view, a buffer, a reshaped view, a weak reference; and some are let go.
        ways = [lambda o: o, lambda o: o[:], memoryview, lambda o: o.reshape(2, 2), weakref.ref, lambda o: None]
        kept.append(ways[k % 6](observation))
        if terminated:
            env.reset()
        del observation
    for now, then in zip(kept, bytes_then, strict=True):
        now = now() if isinstance(now, weakref.ref) else now
        assert now is None or now.tobytes() == then
    other = copy.deepcopy(env)
    first, second = env.step(1)[0], other.step(1)[0]
    assert first.tobytes() == second.tobytes() and not np.shares_memory(first, second)


def test_whatever_was_done_to_an_array_the_next_is_as_it_should_be():
    def shaped(observation):
        observation.shape = (2, 2)

    def other_numbers(observation):
        observation.dtype = np.int32

    def shorter(observation):
        observation.resize(3, refcheck=False)

    def locked(observation):
        observation.flags.writeable = False

    def written(observation):
        observation[:] = np.nan

    env, same = envs.make(CART_POLE), envs.make(CART_POLE)
    for meddle in (shaped, other_numbers, shorter, locked, written):
        env.reset(seed=3), same.reset(seed=3)
        for k in range(8):
            observation, expected = env.step(k % 2)[0], same.step(k % 2)[0]
            assert observation.tobytes() == expected.tobytes() and observation.shape == (4,), meddle
            assert observation.dtype == np.float32 and observation.flags.writeable and observation.flags.c_contiguous, meddle
            with warnings.catch_warnings():
                # NumPy advises against some of it.
                warnings.simplefilter("ignore")
                meddle(observation)
            del observation


def test_there_are_environments():
    assert CART_POLE in IDS and all(identity.startswith("trueup/") and about for identity, about in envs.ids().items())
    gymnasium.register_envs(trueup)
    assert set(IDS) <= set(gymnasium.registry)


@pytest.mark.parametrize("identity", IDS)
def test_gymnasium_has_nothing_to_say(identity):
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        check_env(gymnasium.make(identity).unwrapped)
    # It recommends that spaces be symmetric and of finite bounds, which physics does not heed.
    told = [str(one.message) for one in told if not any(words in str(one.message) for words in ("infinity", "recommend", "normalized"))]
    assert told == []


@pytest.mark.parametrize("identity", IDS)
def test_made_by_gymnasium_it_checks_by_itself_what_wrappers_would(identity):
    env = gymnasium.make(identity)
    assert env is env.unwrapped and env.spec.id == identity
    with pytest.raises(trueup.InputError, match="reset"):
        env.step(env.action_space.sample())
    checked = gymnasium.make(identity, disable_env_checker=False)
    assert checked is not checked.unwrapped and played(checked, 30, seed=4) == played(env, 30, seed=4)


@pytest.mark.parametrize("identity", IDS)
def test_a_seed_gives_the_same_bits_and_another_does_not(identity):
    env, again = envs.make(identity), gymnasium.make(identity)
    first = played(env, 60, seed=7)
    assert played(again, 60, seed=7) == first
    assert played(env, 60, seed=7) == first, "after other episodes"
    assert played(env, 60, seed=8) != first
    # Without a seed the stream of episodes goes on.
    assert played(env, 60) != played(env, 60)


@pytest.mark.parametrize("identity", IDS)
def test_observations_and_rewards_are_what_is_said(identity):
    env = envs.make(identity)
    about = env.about
    assert len(about["observation"]["names"]) == np.prod(env.observation_space.shape) == len(about["observation"]["units"])
    low, high = about["reward_range"]
    for episode in range(3):
        observation, info = env.reset(seed=episode)
        for _ in range(200):
            assert env.observation_space.contains(observation)
            assert list(info) == [name for name, _ in about["info"]]
            observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
            assert type(reward) is float and low <= reward <= high and type(terminated) is bool
            if terminated or truncated:
                break


@pytest.mark.parametrize("identity", IDS)
def test_snapshots_branches_and_copies_go_on_with_the_same_bits(identity):
    env = envs.make(identity)
    played(env, 20, seed=3)
    snapshot, branch, copied = env.snapshot(), env.branch(), copy.deepcopy(env)
    assert branch is not env and branch.np_random is not env.np_random

    def on(env):
        env.action_space.seed(5)
        out = []
        for _ in range(30):
            step = env.step(env.action_space.sample())
            out.append((step[0].tobytes(), *step[1:4]))
            if step[2] or step[3]:
                out.append(env.reset()[0].tobytes())
        return out

    env.reset(), branch.restore(snapshot)
    env.restore(snapshot)
    if _over(env):
        env.reset(), branch.reset(), copied.reset()
    first = on(env)
    assert on(branch) == first and on(copied) == first
    env.restore(snapshot)
    if _over(env):
        env.reset()
    assert on(env) == first, "a snapshot can be restored again"


def _over(env):
    try:
        env.branch().step(env.action_space.sample())
    except trueup.InputError:
        return True
    return False


@pytest.mark.parametrize("identity", IDS)
def test_what_is_pickled_is_fresh_and_made_alike(identity):
    env = gymnasium.make(identity)
    first = played(env, 30, seed=4)
    again = pickle.loads(pickle.dumps(env.unwrapped))
    assert again.spec.id == identity and again.observation_space == env.observation_space
    with pytest.raises(trueup.InputError, match="reset"):
        again.step(again.action_space.sample())
    assert played(again, 30, seed=4) == first


def test_fresh_arrays_are_fresh_and_given_ones_are_written():
    env = envs.make(CART_POLE)
    first, _ = env.reset(seed=0)
    kept = first.copy()
    second, *_ = env.step(0)
    assert not np.shares_memory(first, second) and np.array_equal(first, kept)
    twin = envs.make(CART_POLE)
    twin.reset(seed=0)
    into = np.empty(4, np.float32)
    assert twin.step_into(0, into)[0] == 1.0 and np.array_equal(into, second)


def test_seeds_are_by_the_book():
    env = envs.make(CART_POLE)
    with pytest.raises(gymnasium.error.Error, match="at least 0"):
        env.reset(seed=-1)
    for wrong in ("seed", 1.5, True, [1]):
        with pytest.raises(trueup.InputError, match="seed"):
            env.reset(seed=wrong)
    huge = [env.reset(seed=seed)[0].tobytes() for seed in (0, 2**64 - 1, 2**64, 2**100 + 1, 10**60)]
    assert len(set(huge)) == len(huge)
    assert env.reset(seed=2**100 + 1)[0].tobytes() == huge[3]
    assert env.reset(seed=np.int64(5))[0].tobytes() == env.reset(seed=5)[0].tobytes()
    assert env.np_random_seed == 5
    # Two that are never given a seed are no twins.
    assert envs.make(CART_POLE).reset()[0].tobytes() != envs.make(CART_POLE).reset()[0].tobytes()


def test_what_comes_out_of_order_is_said():
    env = envs.make(CART_POLE)
    with pytest.raises(trueup.InputError, match="has not been reset") as error:
        env.step(0)
    assert error.value.hint
    env.reset(seed=0)
    while True:
        *_, terminated, truncated, _ = env.step(0)
        if terminated or truncated:
            break
    with pytest.raises(trueup.InputError, match="is over"):
        env.step(0)
    env.reset()
    env.close()
    env.close()
    for call in (lambda: env.step(0), lambda: env.reset(seed=0)):
        with pytest.raises(trueup.InputError, match="is closed"):
            call()


@pytest.mark.parametrize(
    "action",
    [
        2,
        -1,
        10**30,
        0.0,
        np.float32(0),
        float("nan"),
        None,
        "left",
        [0],
        [[0, 1], [0]],
        np.array([0]),
        np.zeros((2, 2)),
        True,
        object(),
        {},
    ],
)
def test_an_action_that_is_none_is_refused_and_nothing_moves(action):
    env, twin = envs.make(CART_POLE), envs.make(CART_POLE)
    env.reset(seed=1), twin.reset(seed=1)
    with pytest.raises((trueup.InputError, OverflowError)):
        env.step(action)
    assert env.step(1)[0].tobytes() == twin.step(1)[0].tobytes()


def _boxes():
    return [identity for identity in IDS if isinstance(envs.make(identity).action_space, gymnasium.spaces.Box)]


@pytest.mark.parametrize("identity", _boxes())
def test_a_real_action_that_is_none_is_refused_and_nothing_moves(identity):
    env, twin = envs.make(identity), envs.make(identity)
    env.reset(seed=1), twin.reset(seed=1)
    shape, high = env.action_space.shape, env.action_space.high
    good = np.zeros(shape, np.float32)
    wrong = [
        np.full(shape, np.nan),
        np.full(shape, np.inf),
        high + 1.0,
        np.zeros((*shape, 1)),
        np.zeros(0),
        "x",
        None,
        good.astype(complex),
        good.astype(bool),
    ]
    for action in wrong:
        with pytest.raises(trueup.InputError) as error:
            env.step(action)
        assert error.value.hint
    # Whole numbers, lists and strided arrays are actions all the same.
    for same in (good.astype(int), good.tolist(), np.zeros((shape[0] * 2, *shape[1:]), np.float64)[::2]):
        assert env.step(same)[0].tobytes() == twin.step(good)[0].tobytes()


def test_options_are_held_to_what_there_is():
    with pytest.raises(trueup.InputError, match="no option `gravty`"):
        envs.make(CART_POLE, gravty=3.0)
    with pytest.raises(trueup.InputError, match="a number, a truth value or a text"):
        envs.make(CART_POLE, low=[1])
    env = envs.make(CART_POLE)
    with pytest.raises(trueup.InputError, match="no option `hgih`"):
        env.reset(seed=0, options={"hgih": 0.1})
    with pytest.raises(trueup.InputError, match="texts for names"):
        env.reset(seed=0, options={3: 0.1})
    with pytest.raises(trueup.InputError, match="did you mean|there are"):
        envs.make("trueup/CartPol-v0")
    with pytest.raises(trueup.InputError, match="nothing to render"):
        envs.make(CART_POLE, render_mode="human")
    with pytest.raises(trueup.InputError, match="no `id`"):
        envs.from_config({})
    assert envs.from_config({"id": CART_POLE}).reset(seed=1)[0].tobytes() == envs.make(CART_POLE).reset(seed=1)[0].tobytes()


def test_a_snapshot_of_another_environment_is_refused():
    others = [identity for identity in IDS if identity != CART_POLE]
    if not others:
        pytest.skip("there is one environment")
    env, other = envs.make(CART_POLE), envs.make(others[0])
    with pytest.raises(trueup.InputError, match="snapshot"):
        env.restore(other.snapshot())


def test_whatever_the_interface_is_given_it_answers_or_raises():
    """Random calls with random arguments: an exception is fine, a crash or a hang is not, and what is good still works after."""
    rng = np.random.default_rng(1)
    things = [
        None,
        0,
        1,
        -1,
        2**70,
        -(2**70),
        0.5,
        float("nan"),
        "",
        "x" * 1000,
        b"x",
        [],
        [0],
        [None],
        {},
        {"reset_mask": 1},
        (),
        object(),
        np.array(1),
        np.zeros(1),
        np.zeros((3, 4)),
        np.zeros((3, 4), np.float32),
        np.array([True, False, True]),
        np.array(["a"]),
        np.zeros(3, np.int64),
        np.zeros((3, 4), np.float32)[:, ::2],
        np.zeros(0),
        np.datetime64("2020-01-01"),
        int,
        lambda: 0,
        complex(1, 1),
    ]
    single, vector = envs.make(CART_POLE), envs.make_vec(CART_POLE, 3)
    for _ in range(4000):
        env = single if rng.random() < 0.5 else vector
        method = [
            "reset",
            "step",
            "step_into",
            "restore",
            "branch_lane",
            "_lanes.step",
            "_lanes.reset",
            "_lanes.copy_lane",
            "make",
        ][rng.integers(9)]
        arguments = [things[k] for k in rng.integers(len(things), size=rng.integers(0, 7))]
        keywords = {name: things[rng.integers(len(things))] for name in ("seed", "options", "num_envs", "threads") if rng.random() < 0.3}
        call = envs.make_vec if method == "make" else env
        for part in () if method == "make" else method.split("."):
            call = getattr(call, part, None)
        if call is None:
            continue
        try:
            call(*arguments, **keywords)
        except Exception as error:
            assert not isinstance(error, trueup.BugError), (method, arguments, keywords, error)
    assert len(played(single, 10, seed=1)) > 10
    assert vector.reset(seed=1)[0].shape == (3, 4)


def test_a_market_is_that_of_a_run_file(bars_run):
    env = envs.make("trueup/Trade-v0", run=bars_run)
    _, began = env.reset(seed=1)
    with open(bars_run, "rb") as file:
        assert began["equity"] == tomllib.load(file)["run"]["cash"]
    alike = envs.make("trueup/Trade-v0", run=str(bars_run))
    alike.reset(seed=1)
    for step in range(60):
        action = np.array([1.0 if step % 20 < 10 else 0.0], np.float32)
        ours, theirs = env.step(action), alike.step(action)
        assert np.array_equal(ours[0], theirs[0]) and ours[1:] == theirs[1:]
    assert ours[4]["fills"] > 0 and ours[4]["fees"] > 0 and ours[4]["time"] > 1.7e9
    # Made by its id alone it is in another market.
    elsewhere = envs.make("trueup/Trade-v0")
    elsewhere.reset(seed=1)
    assert elsewhere.step(action)[4]["time"] != ours[4]["time"]
    with pytest.raises(FileNotFoundError, match="nowhere.toml"):
        envs.make("trueup/Trade-v0", run="nowhere.toml")
    with pytest.raises(trueup.InputError, match="path of a RUN.toml"):
        envs.make("trueup/Trade-v0", run=3)
    with pytest.raises(trueup.InputError, match="has no option `run`"):
        envs.make("trueup/CartPole-v0", run=str(bars_run))


def test_info_can_be_left_out():
    told, silent = envs.make("trueup/Trade-v0"), envs.make("trueup/Trade-v0", info=False)
    assert told.reset(seed=3)[1]["equity"] > 0 and silent.reset(seed=3)[1] == {}
    action = np.array([0.5], np.float32)
    ours, theirs = told.step(action), silent.step(action)
    assert np.array_equal(ours[0], theirs[0]) and ours[1:4] == theirs[1:4] and theirs[4] == {} and len(ours[4]) > 5
    # A snapshot of one goes on in the other, which stays as it was made.
    silent.restore(told.snapshot())
    assert silent.step(action)[4] == {} and pickle.loads(pickle.dumps(silent)).reset(seed=3)[1] == {}
    assert silent.branch().step(action)[4] == {} and copy.deepcopy(told).step(action)[4]["steps"] == 2


def test_a_subclass_may_have_a_step_of_its_own():
    class Doubled(envs.Environment):
        def step(self, action):
            observation, reward, *rest = super().step(action)
            return observation, 2 * reward, *rest

    ours, theirs = Doubled(CART_POLE), envs.make(CART_POLE)
    ours.reset(seed=1), theirs.reset(seed=1)
    assert ours.step(0)[1] == 2 * theirs.step(0)[1]
    assert copy.deepcopy(ours).step(0)[1] == 2 * theirs.step(0)[1]
    again = pickle.loads(pickle.dumps(theirs))
    again.reset(seed=1)
    assert again.step(1)[1] == 1.0


@pytest.mark.parametrize("identity", IDS)
def test_an_env_config_makes_them_as_rllib_does(identity):
    # A worker is handed the config by a pickle, makes its environment, and copies it.
    config = pickle.loads(pickle.dumps({"id": identity, "info": False}))
    env = envs.from_config(config)
    assert config == {"id": identity, "info": False}
    assert played(copy.deepcopy(env), 20, seed=2) == played(pickle.loads(pickle.dumps(env)), 20, seed=2)
    # What cannot be sent to a worker is no option either: it is said where it is written.
    with pytest.raises(trueup.InputError, match="a number, a truth value or a text"):
        envs.from_config({"id": identity, "reward": lambda: 0})


def test_data_that_end_in_the_midst_of_an_episode_truncate_it():
    env = envs.make("trueup/Trade-v0", rows=40, length=0, warm_up=8)
    env.reset(seed=0)
    for steps in range(1, 100):
        observation, _, terminated, truncated, info = env.step(np.array([steps % 2], np.float32))
        assert env.observation_space.contains(observation)
        if terminated or truncated:
            break
    assert (terminated, truncated, info["ended"]) == (False, True, 3.0) and steps == info["steps"] < 40
    with pytest.raises(trueup.InputError, match="is over"):
        env.step(np.array([0.0], np.float32))
    assert env.reset()[1]["steps"] == 0
