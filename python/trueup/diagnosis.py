"""Diagnoses, calibrations, the blind benchmark and the registry of mechanisms."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from . import _trueup
from .document import Document
from .recording import as_paths
from .run import Progress


class Diagnosis(Document):
    """What a twin leaves out (schema trueup.diagnosis/1).

    `verdict` is "named", "ambiguous", "no_mismatch", "unexplained" or "not_excited"; `effects` what was found, most certain first;
    `fit` the errors on held-out data of the twin as given, recalibrated and trued. `trued_toml` is the twin with what was found
    added, as text, and `files` where all was written, if it was.
    """

    trued_toml: str | None = None
    files: tuple[Path, ...] = ()

    @property
    def mechanisms(self) -> list[str]:
        """Ids of the mechanisms that were named, most certain first."""
        return [effect["mechanism"] for effect in self["effects"]]


class Calibration(Document):
    """The parameters of a twin, refitted (schema trueup.calibration/1): `parameters` by name, `fit` the errors on held-out data."""

    #: The calibrated twin, as text.
    calibrated_toml: str | None = None


def diagnose(
    twin: os.PathLike | str,
    recordings: Any,
    holdout: Any = None,
    *,
    without: Iterable[str] = (),
    out: os.PathLike | str | None = None,
    force: bool = False,
    seed: int = 0,
    progress: Progress | None = None,
) -> Diagnosis:
    """Find what a twin leaves out: locate, name, model, prove.

    Parameters
    ----------
    twin : path
        TWIN.toml, or a RUN.toml. For a simulator written in Python see `Simulator.diagnose`.
    recordings : path, Recording, ExecutionLog, table, or several of them
        What is fitted. Tables are mappings of arrays, DataFrames, or whatever speaks Arrow.
    holdout : the same, optional
        What no fit sees; without it the last 30 % in time of each recording.
    without : ids of mechanisms
        What is not to be known of the registry.
    out : path, optional
        Folder to write diagnosis.json, trued.toml and report.html into.
    seed : int
        Seed of placebos and resampling.

    Examples
    --------
    >>> diagnosis = trueup.diagnose("twin.toml", {"t": t, "u": u, "q": q})      # doctest: +SKIP
    >>> diagnosis.verdict, diagnosis.mechanisms                                # doctest: +SKIP
    ('named', ['coulomb_friction'])
    """
    with (
        as_paths(recordings) as fitted,
        as_paths(holdout) as held_out,
        tempfile.TemporaryDirectory(prefix="trueup-") as spare,
    ):
        folder = Path(spare) / "diagnosis" if out is None else Path(out)
        line = ["diagnose", os.fspath(twin), "--json", f"--seed={seed}", f"--out={folder}"]
        line += [f"--without={mechanism}" for mechanism in without]
        line += [f"--recording={path}" for path in fitted] + [f"--holdout={path}" for path in held_out]
        text, _ = _trueup.answer(line + ["--force"] * force, progress)
        diagnosis = Diagnosis.of_text(text)
        diagnosis.trued_toml = (folder / "trued.toml").read_text(encoding="utf-8")
        if out is not None:
            diagnosis.files = tuple(sorted(folder.iterdir()))
        return diagnosis


def calibrate(
    twin: os.PathLike | str,
    recordings: Any,
    holdout: Any = None,
    *,
    out: os.PathLike | str | None = None,
    force: bool = False,
    seed: int = 0,
    progress: Progress | None = None,
) -> Calibration:
    """Fit the parameters a twin has to recordings, and add nothing to it. Arguments are those of `diagnose`; `out` is a TOML file."""
    with (
        as_paths(recordings) as fitted,
        as_paths(holdout) as held_out,
        tempfile.TemporaryDirectory(prefix="trueup-") as spare,
    ):
        path = Path(spare) / "calibrated.toml" if out is None else Path(out)
        line = ["calibrate", os.fspath(twin), "--json", f"--seed={seed}", f"--out={path}"]
        line += [f"--recording={path}" for path in fitted] + [f"--holdout={path}" for path in held_out]
        text, _ = _trueup.answer(line + ["--force"] * force, progress)
        calibration = Calibration.of_text(text)
        calibration.calibrated_toml = path.read_text(encoding="utf-8")
        return calibration


def prove(
    domain: str = "robot",
    *,
    cases: int = 200,
    seed: int = 1,
    out: os.PathLike | str | None = None,
    force: bool = False,
    resume: bool = False,
    keep: bool = False,
    progress: Progress | None = None,
) -> Document:
    """Conceal effects in generated data, diagnose blind, unseal and score: how often a diagnosis is right.

    Gives ``summary.json``. With `out` the cases, figures and a report stay in that folder; `resume` goes on with the cases there.
    Seeds below 1000 are for development, those from 1000 on for tests.
    """
    with tempfile.TemporaryDirectory(prefix="trueup-") as spare:
        folder = Path(spare) / "proof" if out is None else Path(out)
        line = ["prove", f"--domain={domain}", f"--cases={cases}", f"--seed={seed}", f"--out={folder}", "--json"]
        line += ["--force"] * force + ["--resume"] * resume + ["--keep"] * keep
        text, _ = _trueup.answer(line, progress)
        return Document.of_text(text)


def mechanisms() -> list[dict[str, Any]]:
    """The registry: every mechanism that can be found missing, with id, domains, site, law, source, remedy, and forms, whose
    parameters have unit, nominal value and bounds (None: infinite)."""
    text, _ = _trueup.answer(["mechanisms", "--json"])
    return json.loads(text)["mechanisms"]
