"""Holds regimes to hmmlearn, ruptures: the same series, the same answers, and how long each takes.

    cargo run --release --example regime_check -- out/regimes >out/regimes/trueup.json
    python checks/regime_check.py out/regimes target/release/examples/regime_check >reports/regimes.md

Hidden Markov models: with the same parameters the same log-likelihood, path and posterior; a fit of each, of which trueup's must
be no less likely. Change points: the same cost, penalty and least length, the same rows. Exit code 1 where a row is not so.
"""

import csv
import json
import logging
import subprocess
import sys
import time
from importlib.metadata import version
from pathlib import Path

import numpy as np
import ruptures
from hmmlearn.hmm import GaussianHMM

ROUNDS = 31
SECONDS = 0.05


def read(path):
    with open(path) as file:
        return np.array([[float(cell) for cell in row] for row in list(csv.reader(file))[1:]])


class Turns:
    """Times both sides by turns, so that a slow minute of the machine is one of both."""

    def __init__(self, program, table):
        self.ours = subprocess.Popen([program, "--timed"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.table = table

    def tell(self, what, rows, asked, run, times=1, rounds=ROUNDS):
        """Adds a row: seconds of ours, which is `asked` for, and of `run`, which does its own so many `times`."""
        pairs = [(self.of_ours(asked), least(run) / times) for _ in range(rounds)]
        ratios = np.array([theirs / ours for ours, theirs in pairs])
        low, middle, high = np.quantile(ratios, [0.1, 0.5, 0.9])
        ours, theirs = np.median(pairs, axis=0)
        spread = f"{middle:.0f} ({low:.0f} to {high:.0f})" if rounds > 1 else f"{middle:.0f}"
        self.table.append(f"| {what} | {rows:,} | {duration(ours)} | {duration(theirs)} | {spread} |")

    def of_ours(self, asked):
        self.ours.stdin.write(asked + "\n")
        self.ours.stdin.flush()
        return float(self.ours.stdout.readline())


def least(run):
    """The least seconds that `run` takes, of as many times as there is time for."""
    took = []
    while sum(took) < SECONDS:
        started = time.perf_counter()
        run()
        took.append(time.perf_counter() - started)
    return min(took)


def peer(model, full, **settings):
    """A model of hmmlearn with the parameters of ours, and without its prior, which is no part of a likelihood."""
    states = model["state"]
    made = GaussianHMM(
        len(states),
        "full" if full else "diag",
        min_covar=0,
        startprob_prior=1,
        transmat_prior=1,
        means_prior=0,
        means_weight=0,
        covars_prior=0,
        covars_weight=0,
        random_state=0,
        **settings,
    )
    made.startprob_ = np.array(model["initial"])
    made.transmat_ = np.array(model["transition"])
    made.means_ = np.array([state["mean"] for state in states])
    made.n_features = made.means_.shape[1]
    made.covars_ = np.array([state["spread"]["full" if full else "diagonal"] for state in states])
    return made


def duration(seconds):
    unit, scale = ("s", 1) if seconds >= 1 else ("ms", 1e3) if seconds >= 1e-3 else ("µs", 1e6)
    return f"{seconds * scale:.3g} {unit}"


def hidden_markov(case, series, table, turns):
    """A row of the table, and what is wrong with it."""
    made, wrong = peer(case["model"], case["full"]), []
    log = made.score(series)
    path_log, path = made.decode(series)
    posterior = made.predict_proba(series)
    relative = abs(log - case["log_likelihood"]) / abs(log)
    path_relative = abs(path_log - case["path_log"]) / abs(path_log)
    agree = float(np.mean(path == np.array(case["path"])))
    apart = float(np.max(np.abs(posterior[:, 0] - np.array(case["posterior"]))))
    # From the true parameters, so that the peer has the best start there is.
    learner = peer(case["model"], case["full"], init_params="", n_iter=1000, tol=1e-9 * len(series))
    learner.fit(series)
    theirs = learner.score(series)
    ours = case["fit"]["log_likelihood"]
    again = peer(case["fit"]["model"], case["full"]).score(series)
    order = np.argsort([np.trace(np.atleast_2d(c)) for c in learner.covars_])
    names = np.empty_like(order)
    names[order] = np.arange(len(order))
    fitted = float(np.mean(names[learner.predict(series)] == np.array(case["fit"]["path"])))
    if not relative < 1e-6 or not path_relative < 1e-6 or not agree > 0.9999 or not apart < 1e-6:
        wrong.append("the same parameters do not give the same")
    if not abs(again - ours) < 1e-6 * abs(again) or ours < theirs - 1e-4 * len(series) ** 0.5 or not fitted > 0.99:
        wrong.append("the fit is not as likely, or of other states")
    table.append(
        f"| {case['series']} | {relative:.0e} | {100 * agree:.2f} % | {apart:.0e} | {ours:.3f} | {theirs:.3f} "
        f"| {100 * fitted:.2f} % |"
    )
    # Twenty iterations, of which each costs the same.
    learner = peer(case["model"], case["full"], init_params="", n_iter=20, tol=-np.inf)
    for name, asked, run, times in (
        ("log-likelihood", "log_likelihood", lambda: made.score(series), 1),
        ("Viterbi", "viterbi", lambda: made.decode(series), 1),
        ("posterior", "posterior", lambda: made.predict_proba(series), 1),
        ("an iteration of Baum-Welch", "iteration", lambda: learner.fit(series), 20),
    ):
        turns.tell(f"{case['series']}: {name}, hmmlearn", case["rows"], f"{case['series']} {asked}", run, times)
    return wrong


class GaussianCost(ruptures.base.BaseCost):
    """The cost of a mean and a variance without what ruptures adds to the variance."""

    model, min_size = "gaussian", 2

    def fit(self, signal):
        signal = signal.reshape(-1) - signal.mean()
        self.signal = signal.reshape(-1, 1)
        self.sums = np.concatenate([[0.0], np.cumsum(signal)])
        self.squares = np.concatenate([[0.0], np.cumsum(signal**2)])
        return self

    def error(self, start, end):
        count = end - start
        mean = (self.sums[end] - self.sums[start]) / count
        return count * (np.log((self.squares[end] - self.squares[start]) / count - mean * mean) + 1.0)


def change_points(case, series, table, turns):
    def divide():
        kind = {"model": "l2"} if case["cost"] == "l2" else {"custom_cost": GaussianCost()}
        pelt = ruptures.Pelt(min_size=case["shortest"], jump=1, **kind).fit(series)
        return pelt, pelt.predict(pen=case["penalty"])

    pelt, changes = divide()
    total = pelt.cost.sum_of_costs(changes)
    theirs, ours = changes[:-1], case["changes"]
    same = len(set(theirs) & set(ours))
    bill = (case["total"] + case["penalty"] * len(ours), total + case["penalty"] * len(theirs))
    table.append(
        f"| {case['series']} | {case['cost']} | {len(ours)} | {len(theirs)} | {same} | {bill[0]:.6f} | {bill[1]:.6f} |"
    )
    what, asked = f"{case['series']}: PELT, {case['cost']}, ruptures", f"{case['series']} {case['cost']}"
    turns.tell(what, case["rows"], asked, divide, rounds=3 if case["rows"] <= 2000 else 1)
    wrong = []
    if ours != theirs and not bill[0] < bill[1] - 1e-9 * abs(bill[1]):
        wrong.append("other change points, and no better ones")
    return wrong


def main():
    # That rounding makes a likelihood fall in its last digits.
    logging.getLogger("hmmlearn").setLevel(logging.ERROR)
    folder = Path(sys.argv[1])
    cases = json.loads((folder / "trueup.json").read_text())["cases"]
    models, changes, fast, wrong = [], [], [], []
    turns = Turns(sys.argv[2], fast)
    for case in cases:
        series = read(folder / f"{case['series']}.csv")
        told = hidden_markov if case["kind"] == "hidden_markov" else change_points
        found = told(case, series, models if told is hidden_markov else changes, turns)
        wrong += [f"{case['series']}: {what}" for what in found]
    versions = ", ".join(f"{name} {version(name)}" for name in ("hmmlearn", "ruptures", "numpy"))
    head = "|---|" + "---:|"
    print(f"# Regimes beside other libraries\n\nMade by `./x regimes`, with {versions}, on one machine in one run.\n")
    print("## Hidden Markov models\n\nOf the same parameters: how far log-likelihoods are apart (relative), how many rows the")
    print("likeliest paths agree in, how far smoothed probabilities are apart at most. Of fits: the log-likelihood each comes to")
    print("(hmmlearn from the true parameters, trueup from starts of its own) and how many rows the paths agree in.\n")
    print("| series | log-likelihood | path | posterior | fit: trueup | fit: hmmlearn | path of the fits |")
    print(head + "---:|" * 5)
    print("\n".join(models))
    print("\n## Change points\n\nOf the same cost, penalty and least length: number of changes, how many are the same, and cost with")
    print("penalties, of which less is better.\n")
    print("| series | cost | changes: trueup | changes: ruptures | same | total: trueup | total: ruptures |")
    print("|---|---|" + "---:|" * 5)
    print("\n".join(changes))
    print("\n## Time\n\nOf each thing both do it by turns, a twentieth of a second each, and the least of each turn counts. Told are the median")
    print(f"of {ROUNDS} turns, and the median ratio of turns, with the tenth and the last tenth of them.\n")
    print("| what | rows | trueup | other | times as fast |")
    print(head + "---:|" * 3)
    print("\n".join(fast))
    for told in wrong:
        print(f"error: {told}", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
