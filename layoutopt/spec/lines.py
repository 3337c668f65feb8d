"""Where a key stands in a TOML text: the line numbers that ``tomllib`` does not give.

The scanner reads text that ``tomllib`` has accepted, so it does not judge; what it cannot follow it skips, and
a key without a line of its own gets the line of the nearest key above it.
"""

import contextlib
import re
import tomllib
from collections.abc import Mapping

KeyPath = tuple[str | int, ...]
"""Way from the root of a document to a value: keys, and numbers in lists from zero."""

_VOID = re.compile(r"(?:[ \t\r\n]+|#[^\n]*)*")
_BLANK = re.compile(r"[ \t]*")
_REST = re.compile(r"[^\n]*")
_SCALAR = re.compile(r"[^,\]}\r\n#]+")
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_STRINGS = (
    re.compile(r'"""(?:\\.|[^\\])*?"""(?:"{0,2})', re.DOTALL),
    re.compile(r"'''.*?'''(?:'{0,2})", re.DOTALL),
    re.compile(r'"(?:\\.|[^"\\\n])*"'),
    re.compile(r"'[^'\n]*'"),
)


def key_lines(text: str) -> Mapping[KeyPath, int]:
    r"""Return the line, from 1, of every key, table and list element that the scanner can find.

    Examples
    --------
    >>> lines = key_lines("a = 1\n[[zone]]\nname = 'dock'\n[[zone]]\nsize = [\n  1,\n  2]")
    >>> lines["zone", 0, "name"], lines["zone", 1, "size", 1]
    (3, 7)
    """
    scanner = _Scanner(text)
    # A text nested too deeply to be scanned was refused by tomllib before; the lines found so far still hold.
    with contextlib.suppress(RecursionError):
        scanner.document()
    return scanner.lines


def line_of(path: KeyPath, lines: Mapping[KeyPath, int]) -> int | None:
    """Return the line of a key, or of the nearest table above it that has one; ``None`` for the whole file."""
    for length in range(len(path), 0, -1):
        if path[:length] in lines:
            return lines[path[:length]]
    return None


def written(path: KeyPath) -> str:
    """Return a path as people write it.

    >>> written(("site", "zone", 1, "region"))
    'site.zone[1].region'
    """
    text = ""
    for part in path:
        if isinstance(part, int):
            text += f"[{part}]"
        else:
            shown = part if _BARE_KEY.fullmatch(part) else repr(part[:40])
            text += f".{shown}" if text else shown
    return text


def _unquoted(text: str) -> str:
    try:
        return str(tomllib.loads(f"key = {text}")["key"])
    except tomllib.TOMLDecodeError:
        return text


class _Scanner:
    """One pass over the text; ``at`` is where it has got to."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0
        self.lines: dict[KeyPath, int] = {}
        self._line, self._counted = 1, 0
        self._elements: dict[KeyPath, int] = {}

    def document(self) -> None:
        """Read every table and key of the text."""
        table: KeyPath = ()
        while self._skip(_VOID) < len(self.text):
            before = self.at
            if self.text.startswith("[[", self.at):
                self.at += 2
                table = self._table(self._key(), element=True)
                self._skip(_REST)
            elif self.text.startswith("[", self.at):
                self.at += 1
                table = self._table(self._key(), element=False)
                self._skip(_REST)
            else:
                self._pair(table)
            if self.at == before:
                self._skip(_REST)
                self.at = max(self.at, before + 1)

    def _pair(self, table: KeyPath) -> None:
        key = self._key()
        for length in range(1, len(key) + 1):
            self._mark(table + key[:length])
        self._skip(_BLANK)
        if self.text.startswith("=", self.at):
            self.at += 1
            self._value(table + key)

    def _value(self, path: KeyPath) -> None:
        self._skip(_BLANK)
        first = self.text[self.at : self.at + 1]
        if first == "[":
            self._list(path)
        elif first == "{":
            self._inline_table(path)
        elif first and first in "\"'":
            self._string()
        else:
            self._skip(_SCALAR)

    def _list(self, path: KeyPath) -> None:
        self.at += 1
        number = 0
        while self._skip(_VOID) < len(self.text) and self.text[self.at] != "]":
            before = self.at
            if self.text[self.at] != ",":
                self._mark((*path, number))
                self._value((*path, number))
                number += 1
            if self.text.startswith(",", self.at) or self.at == before:
                self.at += 1
        self.at += 1

    def _inline_table(self, path: KeyPath) -> None:
        self.at += 1
        while self._skip(_VOID) < len(self.text) and self.text[self.at] != "}":
            before = self.at
            if self.text[self.at] != ",":
                self._pair(path)
            if self.text.startswith(",", self.at) or self.at == before:
                self.at += 1
        self.at += 1

    def _key(self) -> tuple[str, ...]:
        parts: list[str] = []
        while True:
            self._skip(_BLANK)
            start = self.at
            if self.text[start : start + 1] in ("'", '"'):
                self._string()
                parts.append(_unquoted(self.text[start : self.at]))
            else:
                self._skip(_BARE_KEY)
                parts.append(self.text[start : self.at])
            self._skip(_BLANK)
            if not self.text.startswith(".", self.at):
                return tuple(parts)
            self.at += 1

    def _table(self, key: tuple[str, ...], *, element: bool) -> KeyPath:
        """Return the path of a table header: a name that is a list of tables means its last one."""
        path: KeyPath = ()
        for part in key[:-1]:
            path = (*path, part)
            self._mark(path)
            if path in self._elements:
                path = (*path, self._elements[path])
        path = (*path, key[-1])
        self._mark(path)
        if element:
            self._elements[path] = self._elements.get(path, -1) + 1
            path = (*path, self._elements[path])
            self._mark(path)
        return path

    def _string(self) -> None:
        for form in _STRINGS:
            match = form.match(self.text, self.at)
            if match is not None:
                self.at = match.end()
                return
        self._skip(_REST)

    def _skip(self, form: re.Pattern[str]) -> int:
        match = form.match(self.text, self.at)
        self.at = match.end() if match else self.at
        return self.at

    def _mark(self, path: KeyPath) -> None:
        # Counting on from the last mark keeps the whole scan linear in the text.
        self._line += self.text.count("\n", self._counted, self.at)
        self._counted = self.at
        self.lines.setdefault(path, self._line)
