"""Text of decks: lines with their places, the files that a deck includes, and cards with their numbers."""

import os
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from impact.files.safe_files import MB, read_bytes, read_text
from seatfem.structures.errors import MeshError

MOST_FILES = 200
LONGEST = 4096  # largest number of characters of a line with those that it goes on in
MOST_BYTES = 512 * MB  # largest size of all files of a deck [bytes]
_NAME = r"""\s*(?:['"]([^'"]{1,4096})['"]|([^'",\n]+))"""
_BY_KEYWORD = re.compile(
    rf"^\*\s*(?:INCLUDE|NODE|ELEMENT|NSET|ELSET)\s*,(?:[^*]*?,)?\s*(?:INPUT|FILE)\s*={_NAME}", re.I | re.M
)
_BY_ENTRY = re.compile(rf"^[ \t]*INCLUDE\b{_NAME}", re.I | re.M)
_WHOLE = re.compile("[0-9]{1,9}")
_REAL = re.compile(r"([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))(?:(?:[EeDd]|(?=[+-]))([+-]?[0-9]{1,4}))?")


@dataclass(frozen=True)
class Card:
    """Card, or keyword with its lines: file and line where it stands, and name."""

    place: str
    name: str

    def fail(self, why: str) -> MeshError:
        return MeshError(f"{self.place}: {self.name}: {why}")

    def integers(self, words: Sequence[str]) -> list[int]:
        """Return whole numbers of up to nine digits."""
        if not all(map(_WHOLE.fullmatch, words)):
            raise self.fail(f"{', '.join(words)[:80]!r}: must be whole numbers of up to nine digits")
        return [int(word) for word in words]

    def reals(self, words: Sequence[str]) -> list[float]:
        """Return numbers: 1.5, 1.5E-3, 1.5D-3, 1.5-3; blank is 0."""
        matches = [_REAL.fullmatch(word or "0") for word in words]
        if wrong := [word for word, match in zip(words, matches, strict=True) if not match]:
            raise self.fail(f"{', '.join(words)[:80]}: {wrong[0][:80]!r} must be a number")
        return [float(f"{match[1]}e{match[2] or 0}") for match in matches if match]


def _including(deck: Path) -> re.Pattern[str]:
    """Return the pattern of lines by which a deck includes a file."""
    return _BY_KEYWORD if deck.suffix.lower() == ".inp" else _BY_ENTRY


def _inside(match: re.Match[str], deck: Path, beside: Path) -> Path | None:
    """Return a file of the deck's folder or that of what includes it; ``None``: it is missing, outside, or a link."""
    name, top = re.sub(r"\n\s*", "", match[1] or match[2]).strip(), deck.parent.resolve()
    for folder in (top, beside.parent.resolve()):
        path = Path(os.path.normpath(folder / name.replace("\\", "/")))
        if path.is_file() and path.is_relative_to(top) and path == path.resolve():
            return path
    return None


@dataclass
class Deck:
    """Deck and its files that may still be read, in number and size; each counts as often as it is included.

    ``content``: a line without comments; ``goes_on``: whether the next line belongs to it.
    """

    path: Path
    content: Callable[[str], str]
    goes_on: Callable[[str], bool]
    files: int = MOST_FILES
    size: int = MOST_BYTES

    def lines(self, path: Path | None = None) -> Iterator[tuple[str, str]]:
        """Yield place (file and number) and text of every line with content, those of included files in place.

        Raises `MeshError`: too many or too large files, one that is not in the deck's folder, a line without end.
        """
        path = path or self.path
        if self.files == 0:
            raise MeshError(f"{path}: is included after {MOST_FILES} other files, the most of a deck; write one file")
        data = read_bytes(path, self.size, MeshError)
        self.files -= 1
        self.size -= len(data)
        whole, place, including = "", "", _including(self.path)
        for number, line in enumerate(data.decode("utf-8-sig", errors="replace").splitlines(), start=1):
            line = self.content(line)
            if line.strip():
                place, whole = (place, whole + line.strip()) if whole else (f"{path}:{number}", line)
            if whole and not self.goes_on(whole):
                yield place, whole
                if match := including.match(whole):
                    file = _inside(match, self.path, path)
                    if file is None:
                        why = "which is no file within the deck's folder (a link is none); copy it there"
                        raise MeshError(f"{place}: includes {(match[1] or match[2])[:80]!r}, {why}, or write one file")
                    yield from self.lines(file)
                whole = ""
            elif len(whole) > LONGEST:
                raise MeshError(f"{place}: goes on for more than {LONGEST} characters; shorten it")
        if whole:
            raise MeshError(f"{place}: goes on after the end of the file; remove its last comma, or close its quotes")


def with_included(path: Path) -> tuple[Path, ...]:
    """Return ``path`` and, for a deck, every file that it includes, at any depth; missing ones are omitted."""
    files: dict[Path, None] = {}  # in order
    waiting = [path]
    while waiting and len(files) <= MOST_FILES:  # reading refuses a deck of more files
        file = waiting.pop().resolve()
        if file in files or not file.is_file():
            continue
        files[file] = None
        if path.suffix.lower() in (".inp", ".bdf", ".nas", ".dat", ".fem"):
            text = read_text(file, MOST_BYTES, MeshError, errors="replace")
            matches = islice(_including(path).finditer(text), MOST_FILES)
            waiting += filter(None, (_inside(match, path, file) for match in matches))
    return tuple(files)
