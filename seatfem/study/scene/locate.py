"""Lines on which the keys of a TOML text are written, which tomllib does not report.

The text is known to be valid TOML (tomllib has read it), so this reader only follows its structure.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from dataclasses import dataclass, field
from typing import Final

KeyPath = tuple[str | int, ...]

_BLANK: Final = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_KEY: Final = re.compile(r"""\s*(?:([A-Za-z0-9_-]+)|"((?:\\.|[^"\\])*)"|'([^']*)')[ \t]*""")
_STRING: Final = re.compile(r'''"""(?:\\.|[^\\])*?"{3,5}|\'\'\'.*?\'{3,5}|"(?:\\.|[^"\\\n])*"|'[^'\n]*\'''', re.DOTALL)
_BARE: Final = re.compile(r"[^,\]}#\n]+")


def key_lines(text: str) -> dict[KeyPath, int]:
    """Return the line (from 1) of each key, e.g. {("seat",): 2, ("seat", "material", "young"): 5}."""
    reader = _Reader(text)
    reader.document()
    return reader.lines


def single(path: KeyPath) -> KeyPath:
    """Return the place with every dotted name in parts, however quoted: ("vary", "reed.length") in three."""
    return tuple(part for each in path for part in (each.split(".") if isinstance(each, str) else [each]))


@dataclass
class _Reader:
    text: str
    at: int = 0
    lines: dict[KeyPath, int] = field(default_factory=dict)
    ends: list[int] = field(init=False)  # of lines

    def __post_init__(self) -> None:
        self.ends = [newline.start() for newline in re.finditer("\n", self.text)]

    def document(self) -> None:
        table: KeyPath = ()
        counts: dict[KeyPath, int] = {}
        while self.skip_blank() < len(self.text):
            if not self.text.startswith("[", self.at):
                self.assignment(table)
                continue
            several = self.text.startswith("[[", self.at)
            line = self.line()
            self.at += 2 if several else 1
            table = self.key()
            self.at += 2 if several else 1
            self.note((), table, line)
            if several:
                counts[table] = counts.get(table, -1) + 1
                table = (*table, counts[table])
                self.lines[table] = line

    def assignment(self, table: KeyPath) -> None:
        line = self.line()
        key = self.key()
        self.note(table, key, line)
        self.at += 1  # the equals sign
        self.value(table + key)

    def value(self, path: KeyPath) -> None:
        self.skip_blank()
        opening = self.text[self.at]
        if opening in "{[":
            self.at += 1
            index = 0
            while self.text[self.skip_blank()] not in "}]":
                if self.text[self.at] == ",":
                    self.at += 1
                elif opening == "{":
                    self.assignment(path)
                else:
                    self.lines[*path, index] = self.line()
                    self.value((*path, index))
                    index += 1
            self.at += 1
        elif plain := _STRING.match(self.text, self.at) or _BARE.match(self.text, self.at):
            self.at = plain.end()

    def key(self) -> KeyPath:
        parts: list[str] = []
        while match := _KEY.match(self.text, self.at):
            parts.append(next(group for group in match.groups() if group is not None))
            self.at = match.end()
            if not self.text.startswith(".", self.at):
                break
            self.at += 1
        return tuple(parts)

    def note(self, table: KeyPath, key: KeyPath, line: int) -> None:
        for length in range(1, len(key) + 1):
            self.lines.setdefault(table + key[:length], line)

    def skip_blank(self) -> int:
        match = _BLANK.match(self.text, self.at)
        assert match is not None  # the pattern matches the empty string
        self.at = match.end()
        return self.at

    def line(self) -> int:
        return bisect_left(self.ends, self.at) + 1
