"""JSON documents of the library, as objects of Python."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any


class Document(Mapping):
    """What a command answers, by the keys of its schema: ``document["verdict"]``, or ``document.verdict``."""

    def __init__(self, content: dict[str, Any]):
        self._content = content

    @classmethod
    def of_text(cls, text: str):
        return cls(json.loads(text))

    def __getitem__(self, key: str) -> Any:
        return self._content[key]

    def __iter__(self):
        return iter(self._content)

    def __len__(self) -> int:
        return len(self._content)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        try:
            return self._content[name]
        except KeyError:
            known = ", ".join(self._content)
            raise AttributeError(f"{type(self).__name__} has no `{name}`; there are {known}") from None

    def __dir__(self):
        return [*super().__dir__(), *self._content]

    def to_dict(self) -> dict[str, Any]:
        """The document as plain dicts and lists."""
        return self._content

    def to_json(self, indent: int | None = 2) -> str:
        """The document as text."""
        return json.dumps(self._content, indent=indent)

    def __repr__(self) -> str:
        summary = self._content.get("summary")
        return f"<trueup.{type(self).__name__}{': ' + summary if isinstance(summary, str) else ''}>"
