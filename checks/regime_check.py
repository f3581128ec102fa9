"""Holds regimes to hmmlearn, ruptures: the same series, the same answers, and how long each takes.

    cargo run --release --example regime_check -- out/regimes >out/regimes/trueup.json
    python checks/regime_check.py out/regimes >reports/regimes.md

Hidden Markov models: with the same parameters the same log-likelihood, path and posterior; a fit of each, of which trueup's must
be no less likely. Change points: the same cost, penalty and least length, the same rows. Exit code 1 where a row is not so.
"""

import csv
import json
import logging
import sys
import time
from importlib.metadata import version
from pathlib import Path

import numpy as np
import ruptures
from hmmlearn.hmm import GaussianHMM

ROUNDS = 5
SECONDS = 2.0


def read(path):
    with open(path) as file:
        return np.array([[float(cell) for cell in row] for row in list(csv.reader(file))[1:]])


def timed(run, rounds=ROUNDS):
    """What `run` gives, and the least and the most seconds it takes, of `rounds` and of SECONDS at least."""
    took = []
    while len(took) < rounds or sum(took) < SECONDS:
        started = time.perf_counter()
        given = run()
        took.append(time.perf_counter() - started)
    return given, (min(took), max(took))


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
    least, most = seconds
    unit, scale = ("s", 1) if least >= 1 else ("ms", 1e3) if least >= 1e-3 else ("µs", 1e6)
    return f"{least * scale:.3g} to {most * scale:.3g} {unit}"


def speeds(name, rows, ours, theirs, table):
    ratio = theirs[0] / ours[0]
    table.append(f"| {name} | {rows:,} | {duration(ours)} | {duration(theirs)} | {ratio:.0f} |")
    return ratio


def hidden_markov(case, series, table, fast):
    """A row of the table, and what is wrong with it."""
    made, wrong = peer(case["model"], case["full"]), []
    log, scored = timed(lambda: made.score(series))
    (path_log, path), decoded = timed(lambda: made.decode(series))
    posterior, smoothed = timed(lambda: made.predict_proba(series))
    relative = abs(log - case["log_likelihood"]) / abs(log)
    path_relative = abs(path_log - case["path_log"]) / abs(path_log)
    agree = float(np.mean(path == np.array(case["path"])))
    apart = float(np.max(np.abs(posterior[:, 0] - np.array(case["posterior"]))))
    # Twenty iterations from the same parameters.
    learner = peer(case["model"], case["full"], init_params="", n_iter=20, tol=-np.inf)
    rounds = [timed(lambda: learner.fit(series), 1)[1][0] / 20 for _ in range(ROUNDS)]
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
    for name, ours, theirs in (
        ("log-likelihood", case["seconds"]["log_likelihood"], scored),
        ("Viterbi", case["seconds"]["viterbi"], decoded),
        ("posterior", case["seconds"]["posterior"], smoothed),
        ("an iteration of Baum-Welch", case["seconds"]["iteration"], (min(rounds), max(rounds))),
    ):
        speeds(f"{case['series']}: {name}, hmmlearn", case["rows"], ours, theirs, fast)
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


def change_points(case, series, table, fast):
    def divide():
        kind = {"model": "l2"} if case["cost"] == "l2" else {"custom_cost": GaussianCost()}
        pelt = ruptures.Pelt(min_size=case["shortest"], jump=1, **kind).fit(series)
        return pelt, pelt.predict(pen=case["penalty"])

    (pelt, changes), seconds = timed(divide, 1 if case["rows"] > 2000 else ROUNDS)
    total = pelt.cost.sum_of_costs(changes)
    theirs, ours = changes[:-1], case["changes"]
    same = len(set(theirs) & set(ours))
    bill = (case["total"] + case["penalty"] * len(ours), total + case["penalty"] * len(theirs))
    table.append(
        f"| {case['series']} | {case['cost']} | {len(ours)} | {len(theirs)} | {same} | {bill[0]:.6f} | {bill[1]:.6f} |"
    )
    speeds(f"{case['series']}: PELT, {case['cost']}, ruptures", case["rows"], case["seconds"]["divide"], seconds, fast)
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
    for case in cases:
        series = read(folder / f"{case['series']}.csv")
        told = hidden_markov if case["kind"] == "hidden_markov" else change_points
        found = told(case, series, models if told is hidden_markov else changes, fast)
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
    print("\n## Time\n\nLeast and most of several rounds over two seconds at least; the ratio is of the least, which a busy machine disturbs less.\n")
    print("| what | rows | trueup | other | times as fast |")
    print(head + "---:|" * 3)
    print("\n".join(fast))
    for told in wrong:
        print(f"error: {told}", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
