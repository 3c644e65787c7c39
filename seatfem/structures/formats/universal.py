"""Universal files: datasets between lines of -1, their numbers in turn, and the units of dataset 164."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from impact.files.csv_table import real
from impact.files.safe_files import opened_file

Number = TypeVar("Number", int, float)
_BINARY: Final = re.compile(r"\s*58b\s+([12])\s+2\s", re.IGNORECASE)  # with the order of bytes, in IEEE format
_HEAD_OF_58: Final = 11  # lines of text before the values of dataset 58
_COUNTS: Final = re.compile(r"\s*([2456])\s+(\d{1,12})\s+([01])\s")  # its line 7: data type, count and even spacing
SIZES: Final[Mapping[int, tuple[int, int]]] = MappingProxyType({2: (4, 1), 4: (8, 1), 5: (4, 2), 6: (8, 2)})
"""Bytes of a number and numbers of a value, by the ordinate data type of dataset 58."""


@dataclass
class Dataset:
    """Dataset of a file, by its number and the number of its first line, read line by line; each error names the line.
    ``binary``: values of dataset 58b."""

    path: Path
    error: type[Exception]
    number: int
    line: int
    lines: list[str] = field(default_factory=list, repr=False)
    binary: NDArray[Any] | None = field(default=None, repr=False)
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
        return self._numbers(real, count)

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


def read_datasets(path: Path, most: int, error: type[Exception]) -> Iterator[Dataset]:
    """Yield the datasets of a file of at most ``most`` bytes. Raises ``error`` for lines outside of datasets, a dataset
    without number or end, and binary values that are not of IEEE format or of another size than stated."""
    with opened_file(path, most, error) as file:
        lines = ((number, raw.decode("latin-1").rstrip("\r\n")) for number, raw in enumerate(file, start=1))
        for number, opening in lines:
            if not opening.strip():
                continue
            _, head = next(lines, (0, ""))
            binary = _BINARY.match(head)
            kind = "58" if binary else head.strip()
            if opening.strip() != "-1" or not re.fullmatch("[0-9]{1,6}", kind):
                raise error(
                    f"{path}:{number}: {opening.strip()[:80]!r} and {head.strip()[:80]!r} must be a line of -1 and the "
                    "number of a dataset, 58b in IEEE format; export the universal file again"
                )
            dataset = Dataset(path, error, int(kind), number + 2)
            if binary:
                dataset.lines += [text for _, text in islice(lines, _HEAD_OF_58)]
                counts = _COUNTS.match("".join(dataset.lines[6:7]))
                if counts is None:
                    raise dataset.fail("line 7 must begin with data type, count and spacing; export it again")
                form, count, even = map(int, counts.groups())
                size, parts = SIZES[form]
                values = file.read(min(count * size * (parts + 1 - even), os.fstat(file.fileno()).st_size))
                order = "<" if binary[1] == "1" else ">"
                dataset.binary = np.frombuffer(values[: len(values) // size * size], f"{order}f{size}")
            for _, text in lines:
                if text.rstrip() == "    -1" if binary else text.strip() == "-1":
                    break
                dataset.lines += [text] if text or not binary else []
            else:
                raise dataset.fail("has no end, a line of -1; export the universal file again")
            yield dataset


@dataclass(frozen=True)
class Units:
    """Metres and newtons per unit of a file."""

    metre: float
    newton: float


_PER_SI: Final[Mapping[int, tuple[float, float]]] = MappingProxyType(
    {1: (1.0, 1.0), 2: (3.28084, 0.224809), 3: (1.0, 0.101972), 4: (3.28084, 7.23301), 5: (1e3, 1e3)}
    | {6: (1e2, 1e2), 7: (39.3701, 0.224809), 8: (1e3, 0.101972), 10: (1e3, 1.0)}
)
"""Units per metre and newton by the code of dataset 164; code 9 stands for others."""
USER_DEFINED: Final = 9


def read_units(dataset: Dataset, before: Units | None) -> Units:
    """Return the units of dataset 164: code, words and temperature mode, then factors from SI of length, force and
    temperature. Raises the dataset's error for factors that are not positive or contradict the code, and for other
    units than those of a dataset ``before``."""
    head = dataset.text()[:10].strip()
    code = int(head) if head.isdecimal() else 0
    factors = [*dataset.reals(3), *(dataset.reals(1) if dataset.has_more else ())]  # the last: offset of temperatures
    if dataset.has_more or (code != USER_DEFINED and code not in _PER_SI):
        raise dataset.fail(f"the code of units is {head!r}, must be 1 to 10, with four factors; export the file again")
    for what, factor, of_code in zip(("length", "force"), factors, _PER_SI.get(code, (0, 0)), strict=False):
        if not factor > 0 or (of_code and not math.isclose(factor, of_code, rel_tol=1e-3)):
            meant = f"{of_code:g} by its code of units, {code}" if of_code else "positive"
            raise dataset.fail(f"the factor of {what} is {factor:g}, must be {meant}: correct code or factor")
    units = Units(1 / factors[0], 1 / factors[1])
    if before not in (None, units):
        raise dataset.fail("states other units than the one before; remove one")
    return units
