"""Universal files: datasets between lines of -1, their numbers in turn, and the units of dataset 164."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import BinaryIO, Final, TypeVar

from impact.files.safe_files import opened_file

Number = TypeVar("Number", int, float)
_BINARY: Final = re.compile(r"\s*58b\s+([12])\s+(\d+)\s", re.IGNORECASE)
_HEAD_OF_58: Final = 11  # lines of text before the values of dataset 58
SIZES: Final[Mapping[int, tuple[int, int]]] = MappingProxyType({2: (4, 1), 4: (8, 1), 5: (4, 2), 6: (8, 2)})
"""Bytes of a number and numbers of a value, by the ordinate data type of dataset 58."""


@dataclass
class Dataset:
    """Dataset of a file, read line by line; each error names the line.

    Attributes:
        number: its number, which is its kind.
        line: number of its first line in the file.
        binary: values of dataset 58b, with their byte order "<" or ">".
    """

    path: Path
    error: type[Exception]
    number: int
    line: int
    lines: list[str] = field(repr=False)
    binary: bytes = field(default=b"", repr=False)
    order: str = ""
    at: int = 0

    def fail(self, why: str) -> Exception:
        """Return the error of the line that was read last."""
        return self.error(f"{self.path}:{self.line + max(self.at - 1, 0)}: dataset {self.number}: {why}")

    @property
    def has_more(self) -> bool:
        return self.at < len(self.lines)

    def text(self) -> str:
        """Return the next line."""
        if not self.has_more:
            raise self.fail("a line is missing at its end; export the file again")
        self.at += 1
        return self.lines[self.at - 1]

    def integers(self, count: int) -> list[int]:
        """Return the next ``count`` whole numbers, which end with a line."""
        return self._numbers(int, count)

    def reals(self, count: int) -> list[float]:
        """Return the next ``count`` finite numbers, which end with a line; exponents may have the letter D."""
        return self._numbers(_real, count)

    def _numbers(self, read: Callable[[str], Number], count: int) -> list[Number]:
        numbers: list[Number] = []
        while len(numbers) < count:
            words = self.text().split()
            try:
                numbers += map(read, words)
            except ValueError:
                words = []
            if not words or len(numbers) > count:
                line = self.lines[self.at - 1].strip()[:80]
                raise self.fail(f"{line!r} must be one of the lines of {count} numbers; export the file again")
        return numbers


def _real(word: str) -> float:
    number = float(word.replace("D", "E").replace("d", "e"))
    if not math.isfinite(number):
        raise ValueError
    return number


def read_datasets(path: Path, most: int, error: type[Exception]) -> Iterator[Dataset]:
    """Yield the datasets of a file of at most ``most`` bytes. Raises ``error`` for lines outside of datasets, a dataset
    without number or end, and binary values that are not of IEEE format or of another size than stated."""
    with opened_file(path, most, error) as file:
        count = 0

        def line() -> str | None:
            nonlocal count
            count += 1
            raw = file.readline()
            return raw.decode("latin-1").rstrip("\r\n") if raw else None

        def fail(why: str) -> Exception:
            return error(f"{path}:{count}: {why}; export the universal file again")

        while (opening := line()) is not None:
            if not opening.strip():
                continue
            if opening.strip() != "-1":
                raise fail(f"{opening.strip()[:80]!r} stands outside of a dataset, which is enclosed by lines of -1")
            head = line() or ""
            binary = _BINARY.match(head)
            number = "58" if binary else head.strip()
            if not number.isdecimal() or len(number) > 6:
                raise fail(f"{number[:80]!r} must be the number of a dataset")
            dataset = Dataset(path, error, int(number), count + 1, [])
            if binary:
                dataset.lines = [line() or "" for _ in range(_HEAD_OF_58)]
                dataset.order = "<" if binary[1] == "1" else ">"
                dataset.binary = _values(file, dataset, binary[2])
            while (text := line()) is not None and (text.rstrip() != "    -1" if binary else text.strip() != "-1"):
                if binary and text:
                    raise fail("the values of dataset 58b must end at a line of -1")
                dataset.lines += [] if binary else [text]
            if text is None:
                raise fail(f"dataset {number} has no end, a line of -1")
            yield dataset


def _values(file: BinaryIO, dataset: Dataset, form: str) -> bytes:
    """Return the bytes of binary values, as many as the count and type in the sixth line after the names say."""
    if form != "2":
        raise dataset.fail(f"floating-point format {form} must be 2 (IEEE); export it so, or as text")
    words = dataset.lines[6].split()
    if len(words) < 3 or not all(word.isdecimal() for word in words[:3]) or int(words[0]) not in SIZES:
        raise dataset.fail(f"{dataset.lines[6][:80]!r} must begin with data type, count and spacing; export it again")
    (size, parts), uneven = SIZES[int(words[0])], words[2] == "0"
    return file.read(min(int(words[1]) * size * (parts + uneven), os.fstat(file.fileno()).st_size))


@dataclass(frozen=True)
class Units:
    """Metres and newtons per unit of a file."""

    metre: float
    newton: float


_LENGTHS: Final = {1: 1.0, 2: 3.28084, 3: 1.0, 4: 3.28084, 5: 1e3, 6: 1e2, 7: 39.3701, 8: 1e3, 10: 1e3}
_FORCES: Final = {1: 1.0, 2: 0.224809, 3: 0.101972, 4: 7.23301, 5: 1e3, 6: 1e2, 7: 0.224809, 8: 0.101972, 10: 1.0}
"""Units per metre and newton by the code of dataset 164; code 9 stands for others."""
USER_DEFINED: Final = 9


def read_units(dataset: Dataset, before: Units | None) -> Units:
    """Return the units of dataset 164: code, words and temperature mode, then factors from SI of length, force and
    temperature. Raises the dataset's error for factors that are not positive or contradict the code, and for other
    units than those of a dataset ``before``."""
    head = dataset.text()[:10].strip()
    code = int(head) if head.isdecimal() else 0
    factors = [*dataset.reals(3), *(dataset.reals(1) if dataset.has_more else ())]  # the last: offset of temperatures
    if dataset.has_more or (code != USER_DEFINED and code not in _LENGTHS):
        raise dataset.fail(f"the code of units is {head!r}, must be 1 to 10, with four factors; export the file again")
    for what, factor, of_code in zip(
        ("length", "force"), factors, (_LENGTHS.get(code), _FORCES.get(code)), strict=False
    ):
        if not factor > 0 or (of_code and not math.isclose(factor, of_code, rel_tol=1e-3)):
            meant = f"{of_code:g} by its code of units, {code}" if of_code else "positive"
            raise dataset.fail(f"the factor of {what} is {factor:g}, must be {meant}: correct code or factor")
    units = Units(1 / factors[0], 1 / factors[1])
    if before not in (None, units):
        raise dataset.fail("states other units than the one before; remove one")
    return units
