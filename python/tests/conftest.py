"""Paths and small data that tests share."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def bars_run() -> Path:
    return ROOT / "data" / "bars" / "run.toml"


@pytest.fixture(scope="session")
def servo() -> Path:
    return ROOT / "data" / "servo"


@pytest.fixture(scope="session")
def execution() -> Path:
    return ROOT / "data" / "execution"


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20_26)
