"""trueup: locates, names, models and proves what a simulator left out, for robots and for markets.

- `backtest`, `audit`: a strategy, compiled in or of Python, on past data; whether it sees the future.
- `diagnose`, `calibrate`, `prove`, `mechanisms`: what a twin leaves out; `Simulator` for one written in Python.
- `reconcile`, `assert_reconciles`: a backtest beside a paper log.
- `trueup.envs`: environments for reinforcement learning, as Gymnasium has them, where that is installed.

Long work runs without Python's lock and ends on Ctrl-C. What is wrong with an input is an `InputError` with a `hint`.
"""

from ._trueup import Bars, Orders, Table, View, __version__
from .diagnosis import Calibration, Diagnosis, calibrate, diagnose, mechanisms, prove
from .document import Document
from .errors import BugError, InputError, Mismatch, MissingFileError
from .reconciliation import Reconciliation, assert_reconciles, reconcile
from .recording import ExecutionLog, Recording, write_table
from .run import Audit, Backtest, audit, backtest
from .simulator import Initial, Parameter, ScriptDiagnosis, Simulator
from .strategy import Strategy

__all__ = [
    "Audit",
    "Backtest",
    "Bars",
    "BugError",
    "Calibration",
    "Diagnosis",
    "Document",
    "ExecutionLog",
    "Initial",
    "InputError",
    "Mismatch",
    "MissingFileError",
    "Orders",
    "Parameter",
    "Reconciliation",
    "Recording",
    "ScriptDiagnosis",
    "Simulator",
    "Strategy",
    "Table",
    "View",
    "__version__",
    "assert_reconciles",
    "audit",
    "backtest",
    "calibrate",
    "diagnose",
    "mechanisms",
    "prove",
    "reconcile",
    "write_table",
]


try:
    # Gymnasium looks for environments in what was imported: `import trueup; gymnasium.make("trueup/CartPole-v0")`.
    from . import envs as envs
except ImportError:
    # There is no gymnasium: all but the environments is there, and `import trueup.envs` says why they are not.
    pass
