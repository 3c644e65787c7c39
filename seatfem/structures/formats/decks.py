"""Text of decks: lines with their places, the files that a deck includes, and its numbers."""

import os
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from impact.files.safe_files import MB, read_bytes, read_text
from seatfem.structures.mesh.io import MeshError

MOST_FILES = 200
LONGEST = 4096  # largest number of characters of a line with those that it goes on in
MOST_BYTES = 512 * MB  # largest size of all files of a deck [bytes]
_INCLUDED = re.compile(
    r"""^(?:\*[^*]*?\b(?:INPUT|FILE)\s*=|[ \t]*INCLUDE)\s*(?:['"]([^'"]{1,4096})['"]|([^'",\n]+))""",
    re.IGNORECASE | re.MULTILINE,
)
_PLAIN = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[Ee][+-]?[0-9]{1,4})?")
_EXPONENT = re.compile(r"(?<=[0-9.])(?:[Dd]|(?=[+-]))")


def number(text: str) -> float:
    """Return the number in a field: 1.5, 1.5E-3, 1.5D-3, 1.5-3; blank is 0. Raises `ValueError`."""
    plain = text or "0"
    if not _PLAIN.fullmatch(plain):
        plain = _EXPONENT.sub("E", text, count=1)
        if not _PLAIN.fullmatch(plain):
            raise ValueError(f"{text[:80]!r} must be a number")
    return float(plain)


def _inside(name: str, deck: Path, beside: Path) -> Path | None:
    """Return an included file, from the deck's folder or else from that of the file that includes it.

    ``None``: it is missing, outside the deck's folder, or a link.
    """
    top = deck.parent.resolve()
    for folder in (top, beside.parent.resolve()):
        path = Path(os.path.normpath(folder / name.strip().replace("\\", "/")))
        if path.is_file() and path.is_relative_to(top) and path == path.resolve():
            return path
    return None


@dataclass
class Deck:
    """Deck and its files that may still be read, in number and size; each counts as often as it is included.

    ``content``: a line without comments; ``goes_on``: whether the next line belongs to it; ``included``: the file that
    it names.
    """

    path: Path
    content: Callable[[str], str]
    goes_on: Callable[[str], bool]
    included: Callable[[str], str | None]
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
        whole = place = ""
        for number, line in enumerate(data.decode("utf-8-sig", errors="replace").splitlines(), start=1):
            line = self.content(line)
            if line.strip():
                place, whole = (place, whole + line.strip()) if whole else (f"{path}:{number}", line)
            if whole and not self.goes_on(whole):
                yield place, whole
                yield from self._lines_named_by(whole, place, path)
                whole = ""
            elif len(whole) > LONGEST:
                raise MeshError(f"{place}: goes on for more than {LONGEST} characters; shorten it")
        if whole:
            raise MeshError(f"{place}: goes on after the end of the file; remove its last comma, or close its quotes")

    def _lines_named_by(self, line: str, place: str, path: Path) -> Iterator[tuple[str, str]]:
        if name := self.included(line):
            file = _inside(name, self.path, path)
            if file is None:
                raise MeshError(
                    f"{place}: includes {name[:80]!r}, which is no file within the deck's folder (a link is none); "
                    "copy it there, or write one file"
                )
            yield from self.lines(file)


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
            names = _INCLUDED.findall(read_text(file, MOST_BYTES, MeshError, errors="replace"))[:MOST_FILES]
            waiting += filter(None, (_inside(re.sub(r"\n\s*", "", "".join(name)), path, file) for name in names))
    return tuple(files)
