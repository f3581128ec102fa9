"""What trueup raises. Every message gives the value found and where, and ends with ``hint:`` and the remedy."""

from __future__ import annotations

import errno


class InputError(ValueError):
    """Bad input: a file, a table, an argument.

    Attributes
    ----------
    hint : str or None
        What to do about it.
    path : str or None
        The file it is in.
    row : int or None
        Row of a table: of CSV the line an editor shows, of Parquet and Arrow the data row from 1.
    line : (int, int) or None
        Line and column of a text, both from 1.
    column : str or None
        Column of a table.
    found : str or None
        The value found.
    """

    def __init__(self, message="", *, hint=None, path=None, row=None, line=None, column=None, found=None):
        super().__init__(message)
        self.hint = hint
        self.path = path
        self.row = row
        self.line = line
        self.column = column
        self.found = found

    def __reduce__(self):
        return (_again, (type(self), str(self), dict(self.__dict__)))


class MissingFileError(InputError, FileNotFoundError):
    """A file that is not there; `errno` and `filename` are those of any `FileNotFoundError`."""

    def __init__(self, message="", **place):
        super().__init__(message, **place)
        self.errno = errno.ENOENT
        self.filename = self.path

    def __str__(self):
        return str(self.args[0]) if self.args else ""


class BugError(RuntimeError):
    """A bug of trueup itself."""


class Mismatch(AssertionError):
    """A backtest and a paper log that part further than they may; `reconciliation` is what was found."""

    def __init__(self, message, reconciliation=None):
        super().__init__(message)
        self.reconciliation = reconciliation


def _again(kind, message, place):
    error = kind(message)
    error.__dict__.update(place)
    if isinstance(error, OSError):
        error.filename = error.path
    return error
