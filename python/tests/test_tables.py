"""Tables: to and from NumPy, pandas, polars and pyarrow; recordings in memory and in files."""

from __future__ import annotations

import numpy as np
import pytest

import trueup
from trueup.recording import columns_of


@pytest.fixture(scope="module")
def result(bars_run):
    return trueup.backtest(bars_run)


def test_a_table_passes_to_pyarrow_polars_and_pandas(result):
    pa = pytest.importorskip("pyarrow")
    table = pa.table(result.fills)
    assert table.column_names == result.fills.columns and table.num_rows == len(result.fills)
    assert str(table.schema.field("filled_at").type) == "timestamp[ns, tz=UTC]"
    assert np.array_equal(table["price"].to_numpy(), result.fills["price"])
    pl = pytest.importorskip("polars")
    frame = pl.DataFrame(result.equity)
    assert frame["equity"].to_list() == result.equity["equity"].tolist()
    pd = pytest.importorskip("pandas")
    assert pd.DataFrame(result.equity.to_numpy())["equity"].iloc[-1] == result.equity["equity"][-1]


def test_a_table_knows_its_columns(result):
    assert "price" in result.fills and "prcie" not in result.fills
    with pytest.raises(KeyError, match="there is no column `prcie`; there are order_id"):
        result.fills["prcie"]
    assert repr(result.fills).startswith("<trueup.Table of ")


def test_nanoseconds_keep_their_digits(tmp_path):
    pa = pytest.importorskip("pyarrow")
    pytest.importorskip("pyarrow.parquet")
    stamps = [1_722_951_031_605_537_605, None, 1_722_951_031_799_170_221]
    columns = columns_of(pa.table({"decided_at": stamps, "unsigned": pa.array(stamps, pa.uint64()), "qty": [1, None, 3]}))
    for name in ("decided_at", "unsigned"):
        assert columns[name].dtype == np.int64 and columns[name][[0, 2]].tolist() == [stamps[0], stamps[2]]
    assert columns["qty"].dtype == np.float64 and np.isnan(columns["qty"][1])
    trueup.recording.write_table(tmp_path / "stamps.parquet", columns)
    assert pa.parquet.read_table(tmp_path / "stamps.parquet")["decided_at"].to_pylist() == stamps


def test_columns_are_the_same_wherever_they_come_from(rng):
    pa, pl, pd = pytest.importorskip("pyarrow"), pytest.importorskip("polars"), pytest.importorskip("pandas")
    t, q = np.arange(10.0), rng.normal(size=10)
    q[3] = np.nan
    of = {
        "dict": {"t": t, "q": q, "n": np.arange(10)},
        "pandas": pd.DataFrame({"t": t, "q": q, "n": np.arange(10)}),
        "polars": pl.DataFrame({"t": t, "q": [None if np.isnan(v) else v for v in q], "n": np.arange(10)}),
        "pyarrow": pa.table({"t": t, "q": pa.array(q, from_pandas=True), "n": np.arange(10)}),
        "chunks": pa.concat_tables(
            [
                pa.table({"t": t[:4], "q": q[:4], "n": np.arange(4)}),
                pa.table({"t": t[4:], "q": q[4:], "n": np.arange(4, 10)}),
            ]
        ),
    }
    for name, table in of.items():
        columns = columns_of(table)
        assert list(columns) == ["t", "q", "n"], name
        for column, expected in (("t", t), ("q", q), ("n", np.arange(10))):
            assert np.array_equal(columns[column], expected, equal_nan=True), (name, column)


def test_what_lies_as_it_should_is_not_copied():
    values = np.arange(5.0)
    assert trueup.Recording({"t": values}).columns["t"] is values
    pd = pytest.importorskip("pandas")
    frame = pd.DataFrame({"t": values})
    assert np.shares_memory(trueup.Recording(frame).columns["t"], frame["t"].to_numpy())
    # Every second value does not lie in one piece.
    assert not np.shares_memory(trueup.Recording({"t": np.arange(10.0)[::2]}).columns["t"], values)


def test_arrow_types_of_all_kinds_are_read(rng):
    pa = pytest.importorskip("pyarrow")
    kinds = [
        pa.float32(),
        pa.float16(),
        pa.int8(),
        pa.int16(),
        pa.int32(),
        pa.int64(),
        pa.uint8(),
        pa.uint16(),
        pa.uint32(),
        pa.uint64(),
    ]
    for kind in kinds:
        values = np.array([1, 2, 3]) if not pa.types.is_float16(kind) else np.array([1, 2, 3], np.float16)
        table = pa.table({"a": pa.array(values, type=kind)})
        assert columns_of(table)["a"].tolist() == [1.0, 2.0, 3.0], kind
    assert columns_of(pa.table({"a": pa.array([True, None, False])}))["a"].tolist()[::2] == [1.0, 0.0]
    assert np.isnan(columns_of(pa.table({"a": pa.nulls(2)}))["a"]).all()
    for unit in ("s", "ms", "us", "ns"):
        times = columns_of(pa.table({"a": pa.array([1, None], type=pa.timestamp(unit))}))["a"]
        assert times.dtype == "datetime64[ns]" and np.isnat(times[1]) and times[0] == np.datetime64(1, unit), unit
    for kind in (pa.string(), pa.large_string(), pa.string_view()):
        assert columns_of(pa.table({"a": pa.array(["x", None], type=kind)}))["a"] == ["x", None], kind
    with pytest.raises(trueup.InputError, match="column `a` holds"):
        columns_of(pa.table({"a": pa.array([[1]], type=pa.list_(pa.int64()))}))
    assert columns_of(pa.table({"a": pa.array([], type=pa.float64())}))["a"].shape == (0,)


def test_a_stream_that_breaks_or_is_none_is_refused():
    pa = pytest.importorskip("pyarrow")

    def batches():
        yield pa.record_batch({"a": [1.0]})
        raise OSError("torn")

    reader = pa.RecordBatchReader.from_batches(pa.schema([("a", pa.float64())]), batches())
    with pytest.raises(trueup.InputError, match="torn"):
        columns_of(reader)

    class Wrong:
        def __arrow_c_stream__(self, requested_schema=None):
            return 3

    with pytest.raises(TypeError):
        columns_of(Wrong())
    reader = pa.RecordBatchReader.from_batches(pa.schema([("a", pa.float64())]), iter(()))
    capsule = reader.__arrow_c_stream__()

    class Spent:
        def __arrow_c_stream__(self, requested_schema=None):
            return capsule

    columns_of(Spent())
    with pytest.raises(trueup.InputError, match="Arrow stream"):
        columns_of(Spent())


def test_tables_are_written_and_read(tmp_path, rng):
    columns = {"t": np.arange(5.0), "q": np.array([1.0, np.nan, 2.5, -0.0, 1e-300])}
    for name in ("a.csv", "a.parquet"):
        trueup.write_table(tmp_path / name, columns)
        back = trueup.Recording.read(tmp_path / name)
        assert back.name == name and len(back) == 5
        for key, values in columns.items():
            assert np.array_equal(back[key], values, equal_nan=True), (name, key)
        with pytest.raises(trueup.InputError, match="exists already"):
            trueup.write_table(tmp_path / name, columns)
    with pytest.raises(trueup.InputError, match=r"\.csv or \.parquet"):
        trueup.write_table(tmp_path / "a.xlsx", columns)
    with pytest.raises(FileNotFoundError):
        trueup.Recording.read(tmp_path / "b.csv")


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ({}, "without columns"),
        ({"t": [1, 2], "q": [1]}, "differ in length"),
        ({"t": np.zeros((2, 2))}, "shape"),
        ({"t": [object()]}, "neither numbers nor times nor texts"),
        (3, "a table is expected"),
        ("recording.csv", "a table is expected"),
    ],
)
def test_what_is_no_recording_is_refused(columns, words):
    with pytest.raises(trueup.InputError, match=words) as error:
        trueup.Recording(columns)
    assert error.value.hint
