"""Diagnoses from files and from memory; simulators of Python; reconciliations; the benchmark; the registry."""

from __future__ import annotations

import numpy as np
import pytest

import trueup


def test_a_servo_is_diagnosed_the_same_from_files_and_from_memory(servo):
    from_files = trueup.diagnose(servo / "twin.toml", servo / "train.csv", servo / "test.csv")
    assert from_files.verdict == "named" and from_files.mechanisms
    assert "[[mechanism]]" in from_files.trued_toml
    train, test = trueup.Recording.read(servo / "train.csv"), trueup.Recording.read(servo / "test.csv")
    from_memory = trueup.diagnose(servo / "twin.toml", train, test)
    assert from_memory.mechanisms == from_files.mechanisms
    assert from_memory["effects"] == from_files["effects"] and from_memory["fit"] == from_files["fit"]


def test_what_is_not_known_is_not_named(servo, tmp_path):
    known = trueup.diagnose(servo / "twin.toml", [servo / "train.csv"], out=tmp_path / "told")
    assert {path.name for path in known.files} >= {"diagnosis.json", "trued.toml", "report.html"}
    without = trueup.diagnose(servo / "twin.toml", [servo / "train.csv"], without=known.mechanisms)
    assert not set(without.mechanisms) & set(known.mechanisms)
    with pytest.raises(trueup.InputError, match="no mechanism `friktion`"):
        trueup.diagnose(servo / "twin.toml", servo / "train.csv", without=["friktion"])


def test_errors_of_recordings_in_memory_name_them(servo):
    t = np.arange(200) * 0.01
    columns = {"t": t, "u": np.sin(t), "q": np.sin(t)}
    with pytest.raises(trueup.InputError, match="column `q`") as error:
        trueup.diagnose(servo / "twin.toml", trueup.Recording({key: columns[key] for key in ("t", "u")}, name="arm"))
    assert error.value.path == "arm.parquet" and "/tmp" not in str(error.value)
    broken = dict(columns, t=t[::-1].copy())
    with pytest.raises(trueup.InputError, match="<arm.parquet>") as error:
        trueup.diagnose(servo / "twin.toml", trueup.Recording(broken, name="arm"))
    assert error.value.row == 2
    with pytest.raises(trueup.InputError, match="fitted and held out"):
        trueup.diagnose(servo / "twin.toml", servo / "train.csv", servo / "train.csv")


def test_calibration_moves_parameters_alone(servo):
    calibration = trueup.calibrate(servo / "twin.toml", servo / "train.csv", servo / "test.csv")
    assert calibration.schema == "trueup.calibration/1"
    inertia = calibration["parameters"]["inertia"]
    assert inertia["unit"] == "kg m^2" and inertia["std"] > 0 and inertia["value"] != inertia["nominal"]
    assert "[[mechanism]]" not in calibration.calibrated_toml


def test_the_registry_has_units_and_bounds():
    rows = trueup.mechanisms()
    friction = next(row for row in rows if row["id"] == "coulomb_friction")
    assert friction["site"] == "plant" and friction["domains"] == ["robot"] and friction["source"]
    assert friction["forms"][0]["parameters"][0]["unit"]


def test_a_small_benchmark_is_sealed_and_scored(tmp_path):
    summary = trueup.prove(cases=2, seed=5, out=tmp_path / "proof")
    assert summary["cases"] == 2 or summary["schema"]
    assert (tmp_path / "proof" / "cases.jsonl").exists()
    with pytest.raises(trueup.InputError):
        trueup.prove("planets", cases=1)


def test_an_execution_log_in_memory_is_diagnosed_as_its_files_are(execution):
    pl = pytest.importorskip("polars")
    log = trueup.ExecutionLog(orders=pl.read_csv(execution / "orders.csv"), fills=pl.read_csv(execution / "fills.csv"))
    from_files = trueup.diagnose(execution / "twin.toml", execution)
    from_memory = trueup.diagnose(execution / "twin.toml", log)
    assert from_memory["effects"] == from_files["effects"] and from_files.effects


def test_a_backtest_reconciles_with_itself_and_not_with_another(bars_run, tmp_path):
    result = trueup.backtest(bars_run)
    result.write(tmp_path / "paper")
    bounds = {"unmatched": 0, "mean_price_bps": 0.5}
    assert trueup.assert_reconciles(result, tmp_path / "paper", tolerance=bounds).within
    log = trueup.ExecutionLog(result.orders.to_numpy(), result.fills.to_numpy())
    assert trueup.reconcile(result, log, tolerance=bounds, format="trueup").within
    dearer = trueup.backtest(bars_run, values={"mechanism.half_spread.bps": 10.0})
    with pytest.raises(trueup.Mismatch, match="mean_price_bps") as error:
        trueup.assert_reconciles(dearer, tmp_path / "paper", tolerance=bounds)
    assert isinstance(error.value, AssertionError) and not error.value.reconciliation.within
    with pytest.raises(trueup.InputError, match="no bound"):
        trueup.reconcile(result, tmp_path / "paper", tolerance={"unmatchd": 0})


# --- simulators of Python: a heater with Newton's law of cooling, whose controller output is delayed, and radiates.


def heater(parameters, time, inputs):
    """Temperature above the room [K] of a block: C dT/dt = k u - a T - radiation |T| T, by Euler from row to row."""
    temperature = np.empty(len(time))
    now = parameters["temperature"]
    lost, heat, capacity = parameters["loss"], parameters["power"], parameters["capacity"]
    bias = parameters.get("bias.offset", 0.0)
    radiation = parameters.get("quadratic_drag.coefficient", 0.0)
    power = inputs["u"]
    for row in range(len(time)):
        temperature[row] = now
        if row + 1 < len(time):
            step = time[row + 1] - time[row]
            now = now + step * (heat * power[row] - lost * now - radiation * abs(now) * now) / capacity
    return {"temperature": temperature + bias}


def heaters(parameters, time, inputs):
    """The same over lanes."""
    lanes = len(parameters["loss"])
    out = np.empty((lanes, len(time)))
    now = parameters["temperature"].copy()
    zero = np.zeros(lanes)
    radiation, bias = parameters.get("quadratic_drag.coefficient", zero), parameters.get("bias.offset", zero)
    for row in range(len(time)):
        out[:, row] = now
        if row + 1 < len(time):
            step = time[row + 1] - time[row]
            drive = parameters["power"] * inputs["u"][row] - parameters["loss"] * now
            now = now + step * (drive - radiation * np.abs(now) * now) / parameters["capacity"]
    return {"temperature": out + bias[:, None]}


def simulator(follow=heaters, vectorized=True, **changes):
    given = dict(
        follow=follow,
        parameters={
            "capacity": trueup.Parameter(50.0, "J/K", uncertainty=0.2, lower=1.0),
            "loss": trueup.Parameter(1.0, "W/K", uncertainty=0.2, lower=0.0),
            "power": trueup.Parameter(20.0, "W", uncertainty=0.0),
        },
        channels={"temperature": "K"},
        inputs={"u": ""},
        initial={"temperature": trueup.Initial("temperature", unit="K")},
        mechanisms={
            "quadratic_drag": {"coefficient": trueup.Parameter(0.0, "W/K^2", lower=0.0, upper=1.0, starts=[0.02])},
            "bias": {"offset": trueup.Parameter(0.0, "K", lower=-20.0, upper=20.0, starts=[0.5, -0.5])},
        },
        vectorized=vectorized,
        name="heater",
    )
    # The state and the channel may not be called the same as a parameter.
    given.update(changes)
    return trueup.Simulator(**given)


def recording(rng, radiation, rows=800):
    time = np.arange(rows) * 0.5
    switch = rng.integers(20, 60, size=200).cumsum()
    u = (np.searchsorted(switch, np.arange(rows)) % 2).astype(float) * rng.uniform(0.4, 1.0, size=200)[
        np.searchsorted(switch, np.arange(rows))
    ]
    truth = {"capacity": 46.0, "loss": 0.9, "power": 20.0, "temperature": 0.0, "quadratic_drag.coefficient": radiation}
    clean = heater(truth, time, {"u": u})["temperature"]
    return trueup.Recording({"t": time, "u": u, "temperature": clean + 0.02 * rng.normal(size=rows)}, name="run")


def test_a_simulator_of_python_is_calibrated(rng):
    calibration = simulator().calibrate(recording(rng, 0.0))
    assert calibration["values"]["capacity"] == pytest.approx(46.0, abs=5 * calibration["std"]["capacity"])
    assert calibration["values"]["loss"] == pytest.approx(0.9, abs=5 * calibration["std"]["loss"])
    assert calibration["values"]["power"] == 20.0


def test_what_a_simulator_of_python_leaves_out_is_named(rng):
    diagnosis = simulator().diagnose(recording(rng, 0.03))
    assert diagnosis.mechanisms == ["quadratic_drag"], diagnosis.summary
    assert diagnosis.trued["quadratic_drag.coefficient"] == pytest.approx(0.03, rel=0.1)
    fit = diagnosis["fit"][0]
    assert fit["trued_rmse"] < 0.5 * fit["recalibrated_rmse"]
    nothing = simulator().diagnose(recording(rng, 0.0))
    assert nothing.verdict == "no_mismatch" and nothing.mechanisms == []


def test_lanes_one_by_one_are_lanes_together(rng):
    made = recording(rng, 0.0, rows=300)
    one, many = simulator(heater, False).calibrate(made), simulator().calibrate(made)
    assert one["values"] == pytest.approx(many["values"], rel=1e-9)


def test_what_a_simulator_raises_reaches_the_caller(rng):
    def faulty(parameters, time, inputs):
        raise FloatingPointError("by intent")

    with pytest.raises(FloatingPointError, match="by intent"):
        simulator(faulty).diagnose(recording(rng, 0.0))


@pytest.mark.parametrize(
    ("follow", "words"),
    [
        (lambda p, t, u: {"speed": t}, "gave no channel `temperature`"),
        (lambda p, t, u: {"temperature": t[:-1]}, "has the shape"),
        (lambda p, t, u: {"temperature": 3.0}, "has the shape"),
    ],
)
def test_what_is_no_answer_of_a_simulator_is_said(rng, follow, words):
    with pytest.raises(trueup.InputError, match=words):
        simulator(follow, vectorized=False).calibrate(recording(rng, 0.0))
    with pytest.raises((trueup.InputError, ValueError)):
        simulator(lambda p, t, u: {"temperature": "warm"}, vectorized=False).calibrate(recording(rng, 0.0))


def test_what_cannot_be_declared_is_refused(rng):
    def refused(words, **changes):
        with pytest.raises(trueup.InputError, match=words) as error:
            simulator(**changes)
        assert error.value.hint

    refused("no mechanism `radiation`", mechanisms={"radiation": {"x": trueup.Parameter(0.0, starts=[1.0])}})
    refused("no start", mechanisms={"bias": {"offset": trueup.Parameter(0.0)}})
    refused("without channels", channels={}, initial={})
    refused("no channel", initial={"a": trueup.Initial("pressure")})
    refused("is a parameter and of the initial state", initial={"loss": trueup.Initial("temperature")})
    refused("is not within", parameters={"a": trueup.Parameter(2.0, upper=1.0)})
    refused("relative uncertainty", parameters={"a": trueup.Parameter(0.0)})
    refused("is NaN", parameters={"a": trueup.Parameter(float("nan"))})
    refused("give a callable", follow=3)
    made = recording(rng, 0.0)
    with pytest.raises(trueup.InputError, match="no column `u`"):
        simulator().calibrate({"t": made["t"], "temperature": made["temperature"]})
    with pytest.raises(trueup.InputError, match="does not increase"):
        simulator().calibrate({"t": made["t"][::-1], "u": made["u"], "temperature": made["temperature"]})
    with pytest.raises(trueup.InputError, match="in row 3"):
        simulator().calibrate({"t": made["t"], "u": np.where(np.arange(800) == 3, np.nan, made["u"]), "temperature": made["temperature"]})
