"""Simulators written in Python, identified and diagnosed as the library's own."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from . import _trueup
from .diagnosis import Diagnosis
from .document import Document
from .errors import InputError
from .recording import Recording
from .run import Progress


@dataclass(frozen=True)
class Parameter:
    """A number that a simulator depends on.

    Attributes
    ----------
    value : float
        As the simulator has it today; of a mechanism's parameter the value at which it does nothing.
    unit : str
    uncertainty : float or None
        Standard deviation relative to `value` (0: known exactly, no fit moves it; None: nothing is known of it).
    std : float or None
        The same in the parameter's unit, which counts where both are given.
    lower, upper : float
        Bounds.
    starts : sequence of float
        Where fits begin beside `value`. A parameter of a mechanism needs at least one, at which it does something.
    """

    value: float
    unit: str = ""
    uncertainty: float | None = 0.3
    std: float | None = None
    lower: float = -math.inf
    upper: float = math.inf
    starts: Sequence[float] = ()

    def _row(self, name: str, prior: bool = True) -> tuple:
        for key in ("value", "lower", "upper"):
            if math.isnan(getattr(self, key)):
                raise _wrong(f"parameter `{name}`: {key} is NaN", "give a number")
        if not self.lower <= self.value <= self.upper:
            raise _wrong(
                f"parameter `{name}`: {self.value} is not within [{self.lower}, {self.upper}]",
                "move the bounds, or the value",
            )
        std = self.std
        if std is None and prior and self.uncertainty is not None:
            std = abs(self.value) * self.uncertainty
            if std == 0 and self.uncertainty > 0:
                raise _wrong(
                    f"parameter `{name}` is 0 with a relative uncertainty",
                    "give std, or uncertainty=None where nothing is known",
                )
        if std is not None and not std >= 0:
            raise _wrong(f"parameter `{name}`: a standard deviation of {std}", "it is at least 0; 0 where the value is known exactly")
        return (
            name,
            self.unit,
            float(self.value),
            std,
            float(self.lower),
            float(self.upper),
            [float(start) for start in self.starts],
        )


@dataclass(frozen=True)
class Initial:
    """A number of the state that a run starts from, which belongs to the recording and is estimated beside the parameters.

    Attributes
    ----------
    channel : str or None
        The channel that it is read off at the row a run starts from; None: it is `value` there.
    derivative : bool
        Whether it is the derivative of that channel [its unit / s].
    std : float or None
        How far that may be off, one standard deviation [unit]; None: three tenths of how the channel spreads.
    """

    channel: str | None = None
    derivative: bool = False
    value: float = 0.0
    unit: str = ""
    std: float | None = None


@dataclass
class Simulator:
    """A simulator written elsewhere.

    Parameters
    ----------
    follow : callable
        ``follow(parameters, time, inputs)`` gives what it would have measured: a dict with an array of shape (rows,) for every
        channel, or the array alone where there is one channel. `parameters` maps the names of `parameters`, of `initial`, and of those
        mechanisms that are being tried (``"coulomb_friction.torque"``; absent means that it is not there) to floats; `time` has
        shape (rows,) [s]; `inputs` maps names to arrays of shape (rows,). An input in a row holds until the next; what is
        observed in a row is so before that row's input has acted. The same arguments have to give the same bits.
    parameters : mapping of Parameter
    channels : mapping
        Names of the channels to their units.
    inputs : mapping
        Names of what drives it to their units; the first is the command.
    initial : mapping of Initial
        The state a run starts from: a fit also starts runs in the midst of a recording.
    mechanisms : mapping of mapping of Parameter
        What `follow` can do beyond what the simulator does today: by the id of a mechanism of the registry (see
        ``trueup.mechanisms()``) its parameters, which at their `value` do nothing. A diagnosis names the ones that are missing.
    vectorized : bool
        Whether `follow` takes arrays of shape (lanes,) for parameters and gives arrays of shape (lanes, rows): one call then does
        what else are many.
    columns : mapping
        Columns of recordings that are called otherwise: ``{"position": "q"}``.
    name : str

    `follow` is called on other threads than the one that waits, one at a time for as long as Python has its lock. What it raises
    reaches the caller as it is.
    """

    follow: Callable[[dict[str, Any], np.ndarray, dict[str, np.ndarray]], Any]
    parameters: Mapping[str, Parameter]
    channels: Mapping[str, str]
    inputs: Mapping[str, str] = field(default_factory=dict)
    initial: Mapping[str, Initial] = field(default_factory=dict)
    mechanisms: Mapping[str, Mapping[str, Parameter]] = field(default_factory=dict)
    vectorized: bool = False
    columns: Mapping[str, str] = field(default_factory=dict)
    name: str = "simulator"

    def __post_init__(self):
        if not callable(self.follow):
            raise _wrong(f"follow is {self.follow!r}", "give a callable follow(parameters, time, inputs)")
        if not self.channels:
            raise _wrong("a simulator without channels", "name what it simulates, with units: channels={'position': 'rad'}")
        both = set(self.parameters) & set(self.initial)
        if both:
            raise _wrong(f"`{min(both)}` is a parameter and of the initial state", "give it another name")
        for name, initial in self.initial.items():
            if initial.channel is not None and initial.channel not in self.channels:
                raise _wrong(
                    f"the initial state `{name}` is read off `{initial.channel}`, which is no channel",
                    f"there are {', '.join(self.channels)}",
                )
        mechanisms = []
        for identity, parameters in self.mechanisms.items():
            rows = [parameter._row(name, prior=False) for name, parameter in parameters.items()]
            for name, parameter in parameters.items():
                if not any(start != parameter.value for start in parameter.starts):
                    raise _wrong(
                        f"`{identity}.{name}` has no start at which it does something",
                        "starts=[...], beside the value at which it does nothing",
                    )
            mechanisms.append((identity, rows))
        self._scripted = _trueup.ScriptedSimulator(
            self.follow,
            self.name,
            self.vectorized,
            list(self.channels.items()),
            list(self.inputs.items()),
            [parameter._row(name) for name, parameter in self.parameters.items()],
            [(name, i.unit, i.value, i.channel, i.derivative, i.std) for name, i in self.initial.items()],
            mechanisms,
        )

    def _rows(self, recordings: Any) -> list[tuple]:
        if recordings is None:
            return []
        if (
            isinstance(recordings, (str, Recording, Mapping))
            or hasattr(recordings, "__arrow_c_stream__")
            or hasattr(recordings, "__fspath__")
        ):
            recordings = [recordings]
        return [self._row(number, recording) for number, recording in enumerate(recordings)]

    def _row(self, number: int, recording: Any) -> tuple:
        if isinstance(recording, str) or hasattr(recording, "__fspath__"):
            recording = Recording.read(recording)
        elif not isinstance(recording, Recording):
            recording = Recording(recording, name=f"recording {number + 1}")

        def column(name: str) -> np.ndarray:
            wanted = self.columns.get(name, name)
            if wanted not in recording.columns:
                raise _wrong(
                    f"{recording.name}: there is no column `{wanted}`",
                    f"there are {', '.join(recording.columns)}; columns={{...}} says which is which",
                )
            return np.ascontiguousarray(recording.columns[wanted], dtype=np.float64)

        time = column("t")
        if len(time) < 2 or not np.all(np.isfinite(time)) or not np.all(np.diff(time) > 0):
            raise _wrong(
                f"{recording.name}: `t` does not increase from row to row, or is too short",
                "at least 2 rows, in seconds, strictly increasing",
            )
        inputs = [column(name) for name in self.inputs]
        for name, values in zip(self.inputs, inputs, strict=True):
            if not np.all(np.isfinite(values)):
                row = int(np.flatnonzero(~np.isfinite(values))[0])
                raise _wrong(
                    f"{recording.name}: input `{name}` is {values[row]} in row {row}",
                    "what drives a simulator is known in every row: leave such stretches out",
                )
        channels = [column(name) for name in self.channels]
        for name, values in zip(self.channels, channels, strict=True):
            if not np.any(np.isfinite(values)):
                raise _wrong(f"{recording.name}: channel `{name}` has no sample", "leave the channel out of the simulator")
        return (recording.name, time, inputs, channels)

    def diagnose(self, recordings: Any, holdout: Any = None, *, seed: int = 0, progress: Progress | None = None) -> ScriptDiagnosis:
        """Find what the simulator leaves out, among `mechanisms`. Arguments are those of `trueup.diagnose`."""
        outcome = json.loads(self._scripted.diagnose(self._rows(recordings), self._rows(holdout), seed, progress))
        diagnosis = ScriptDiagnosis(outcome["diagnosis"])
        trued = outcome["trued"]
        diagnosis.trued = dict(zip(trued["parameters"], trued["values"], strict=True))
        diagnosis.trued_std = dict(zip(trued["parameters"], trued["std"], strict=True))
        return diagnosis

    def calibrate(self, recordings: Any, holdout: Any = None, *, seed: int = 0, progress: Progress | None = None) -> Document:
        """Fit the simulator's parameters, and add nothing: `values` and `std` by name, `fit` the errors on held-out data."""
        outcome = json.loads(self._scripted.calibrate(self._rows(recordings), self._rows(holdout), seed, progress))
        names = outcome.pop("parameters")
        outcome["values"] = dict(zip(names, outcome["values"], strict=True))
        outcome["std"] = dict(zip(names, outcome["std"], strict=True))
        return Document(outcome)


class ScriptDiagnosis(Diagnosis):
    """A diagnosis of a simulator of Python. `trued` maps the names of all its parameters, with those of the mechanisms that were
    found, to their values; `trued_std` to their standard deviations."""

    trued: dict[str, float]
    trued_std: dict[str, float]


def _wrong(message: str, hint: str) -> InputError:
    return InputError(f"{message}\n  hint: {hint}", hint=hint)
