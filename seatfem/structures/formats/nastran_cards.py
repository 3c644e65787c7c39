"""Cards of a Nastran bulk data file: small, large and free fields, continuations."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from impact.files.input_files import MB, read_text
from seatfem.structures.mesh.io import MeshError

SMALL, LARGE = 8, 4  # data fields on a line
LIMIT = 512 * MB
MOST_OF_A_CARD = 1_000_000  # numbers that THRU may stand for


@dataclass(frozen=True)
class Card:
    """``fields``: after the name, blank ones as ""; continued lines one after the other without their markers."""

    name: str
    fields: Sequence[str]
    place: str

    def fail(self, why: str) -> MeshError:
        return MeshError(f"{self.place}: {self.name}: {why}")

    def field(self, at: int) -> str:
        return self.fields[at] if at < len(self.fields) else ""

    def integer(self, at: int, default: int | None = None) -> int:
        text = self.field(at)
        if not text and default is not None:
            return default
        try:
            return int(text)
        except ValueError:
            raise self.fail(f"field {at + 2} is {text!r}: must be a whole number") from None

    def real(self, at: int) -> float:
        """A number as Nastran writes it: 1.5, 1.5E-3, 1.5D-3, 1.5-3; a blank is 0."""
        text = self.field(at).upper().replace("D", "E")
        try:
            return float(re.sub(r"(?<=[0-9.])([+-])", r"E\1", text) or 0.0)
        except ValueError:
            raise self.fail(f"field {at + 2} is {self.field(at)!r}: must be a number") from None

    def integers(self, start: int) -> list[int]:
        """Whole numbers from a field on, "a THRU b" written out."""
        words = [word for word in self.fields[start:] if word]
        out: list[int] = []
        for at, word in enumerate(words):
            if word.upper() == "THRU":
                if not out or at + 1 >= len(words) or not words[at + 1].isdecimal():
                    raise self.fail("THRU must stand between two whole numbers")
                more = range(out[-1] + 1, int(words[at + 1]))
                if more.stop - more.start > MOST_OF_A_CARD:
                    raise self.fail(f"THRU spans {more.stop - more.start:.4g} numbers: at most {MOST_OF_A_CARD:.0e}")
                out.extend(more)
            elif word.isdecimal():
                out.append(int(word))
            else:
                raise self.fail(f"{word!r}: must be a whole number or THRU")
        return out


def read_cards(path: Path) -> Iterator[Card]:
    """The cards of the bulk data, to ENDDATA. Raises `MeshError` for INCLUDE."""
    name, fields, place = "", [""], ""
    for number, raw in _bulk(path):
        head, data = _split(raw)
        if head == "" or head[0] in "+*":
            fields.extend(data)
            continue
        if name:
            yield Card(name, fields, place)
        name, fields, place = head.rstrip("*").upper(), data, f"{path}:{number}"
        if name.startswith("INCLUDE"):
            raise MeshError(f"{place}: INCLUDE: not supported; write one file")
    if name:
        yield Card(name, fields, place)


def _bulk(path: Path) -> list[tuple[int, str]]:
    """Numbered lines between BEGIN BULK, where there is one, and ENDDATA; without comments and blank lines."""
    lines: list[tuple[int, str]] = []
    for number, raw in enumerate(read_text(path, LIMIT, MeshError, errors="replace").splitlines(), start=1):
        line = raw.partition("$")[0].rstrip()
        word = line.strip().upper()
        if word.startswith("BEGIN") and "BULK" in word:
            lines = []
        elif word.startswith("ENDDATA"):
            return lines
        elif word:
            lines.append((number, line))
    return lines


def _split(line: str) -> tuple[str, list[str]]:
    """Name or continuation marker, and the data fields padded to a whole line."""
    if "," in line:
        head, *data = (word.strip() for word in line.split(","))
        width = LARGE if "*" in head else SMALL
    else:
        line = line.expandtabs(8)
        head = line[:8].strip()
        width = LARGE if "*" in head else SMALL
        size = 64 // width
        data = [line[8 + size * k : 8 + size * (k + 1)].strip() for k in range(width)]
    return head, [*data[:width], *[""] * (width - len(data))]
