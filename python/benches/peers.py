"""Environments of others, made ready to be measured."""

from __future__ import annotations

import hashlib
import importlib.util
import io
import os
import re
import shutil
import subprocess
import sysconfig
import tarfile
import urllib.error
import urllib.parse
import urllib.request
from pathlib import Path

import numpy as np
from pip._internal.models.index import PyPI

#: The version of PufferLib whose cart-pole is measured.
PUFFER = "3.0.0"
_PLACE = Path("out/environments/puffer")
#: All that the cart-pole's source asks of the library that draws it: nothing is drawn here.
_RAYLIB = """
#pragma once
#include <stdbool.h>
typedef struct { unsigned char r, g, b, a; } Color;
typedef struct { float x, y; } Vector2;
enum { KEY_ESCAPE, KEY_TAB };
static inline void InitWindow(int w, int h, const char* t) {}
static inline void SetTargetFPS(int fps) {}
static inline void CloseWindow(void) {}
static inline bool IsKeyDown(int key) { return false; }
static inline bool IsKeyPressed(int key) { return false; }
static inline void ToggleFullscreen(void) {}
static inline void BeginDrawing(void) {}
static inline void EndDrawing(void) {}
static inline void ClearBackground(Color c) {}
static inline void DrawLine(int a, int b, int c, int d, Color e) {}
static inline void DrawRectangle(int a, int b, int c, int d, Color e) {}
static inline void DrawLineEx(Vector2 a, Vector2 b, float c, Color d) {}
static inline void DrawText(const char* t, int a, int b, int c, Color d) {}
static inline const char* TextFormat(const char* t, ...) { return t; }
"""


class Missing(Exception):
    """A peer that cannot be had here."""


def _puffer_source() -> Path:
    """The source of PufferLib's environments, as its package index has it, held to the index's own checksum."""
    place = _PLACE / f"pufferlib-{PUFFER}" / "pufferlib" / "ocean"
    if place.is_dir():
        return place
    index = f"{os.environ.get('PIP_INDEX_URL', PyPI.simple_url).rstrip('/')}/pufferlib/"
    try:
        with urllib.request.urlopen(index, timeout=60) as answer:
            listed = re.search(rf'href="([^"]*/pufferlib-{re.escape(PUFFER)}\.tar\.gz)#sha256=(\w+)"', answer.read().decode())
        if listed is None:
            raise Missing(f"the package index lists no source of {PUFFER}")
        with urllib.request.urlopen(urllib.parse.urljoin(index, listed[1]), timeout=300) as answer:
            packed = answer.read()
    except urllib.error.URLError as error:
        raise Missing(f"its source cannot be had ({error})") from None
    if hashlib.sha256(packed).hexdigest() != listed[2]:
        raise Missing("its source is not what the index says it is")
    wanted = (f"pufferlib-{PUFFER}/pufferlib/ocean/cartpole/", f"pufferlib-{PUFFER}/pufferlib/ocean/env_binding.h")
    with tarfile.open(fileobj=io.BytesIO(packed)) as archive:
        archive.extractall(_PLACE, [member for member in archive if member.name.startswith(wanted)], filter="data")
    return place


def _puffer():
    """PufferLib's binding of its cart-pole, compiled as its setup.py says."""
    built = _PLACE / f"binding{sysconfig.get_config_var('EXT_SUFFIX')}"
    if not built.exists():
        compiler = shutil.which("cc")
        if compiler is None:
            raise Missing("there is no C compiler")
        source = _puffer_source()
        (_PLACE / "raylib.h").write_text(_RAYLIB)
        include = [sysconfig.get_path("include"), np.get_include(), _PLACE]
        flags = ["-DNPY_NO_DEPRECATED_API=NPY_1_7_API_VERSION", "-DPLATFORM_DESKTOP", "-O2", "-flto", "-w", "-fPIC", "-shared"]
        command = [compiler, *flags, *(f"-I{place}" for place in include), source / "cartpole" / "binding.c", "-o", built, "-lm"]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            raise Missing(f"its source does not compile: {done.stderr.strip()[:200]}")
    spec = importlib.util.spec_from_file_location("binding", built)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class PufferCartPole:
    """PufferLib's cart-pole on its buffers, stepped as its class `Cartpole` does, but for the log, which that asks for at every step."""

    def __init__(self, lanes: int):
        self._binding = _puffer()
        self.observations = np.zeros((lanes, 4), np.float32)
        self.actions = np.zeros(lanes, np.float32)
        self.rewards = np.zeros(lanes, np.float32)
        self.terminals = np.zeros(lanes, np.bool_)
        self.truncations = np.zeros(lanes, np.bool_)
        buffers = (self.observations, self.actions, self.rewards, self.terminals, self.truncations)
        self._lanes = self._binding.vec_init(*buffers, lanes, 0, continuous=0)

    def reset(self, seed=None):
        self._binding.vec_reset(self._lanes, 0 if seed is None else seed)
        return self.observations, []

    def step(self, actions):
        self.actions[:] = actions
        self._binding.vec_step(self._lanes)
        return self.observations, self.rewards, self.terminals, self.truncations, []


#: Bars of the markets.
BARS = 5_000


def _bars():
    """Bars of a random walk."""
    import pandas as pd

    rng = np.random.default_rng(0)
    close = 100 * np.exp(np.cumsum(rng.normal(0, 1e-3, BARS)))
    bars = {"open": close, "high": close * 1.001, "low": close * 0.999, "close": close, "volume": rng.uniform(1, 2, BARS)}
    return pd.DataFrame(bars, index=pd.date_range("2024-01-01", periods=BARS, freq="h"))


def anytrading():
    """gym-anytrading's environment of stocks."""
    try:
        from gym_anytrading.envs import StocksEnv

        bars = _bars()
    except ImportError as error:
        raise Missing(f"it is not installed ({error})") from None
    table = bars.rename(columns=str.capitalize)
    return StocksEnv(df=table, window_size=10, frame_bound=(10, len(table)))


def trading_env():
    """gym-trading-env's environment, long or short."""
    try:
        from gym_trading_env.environments import TradingEnv

        table = _bars()
    except ImportError as error:
        raise Missing(f"it is not installed ({error})") from None
    table["feature_return"] = table["close"].pct_change().fillna(0.0)
    return TradingEnv(df=table, positions=[-1, 1], verbose=0)
