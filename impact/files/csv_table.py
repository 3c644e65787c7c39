"""CSV tables of other programs and analysers, read, and CSV tables of this program, written and read.

Columns are separated by tabs, semicolons, commas or blanks; numbers have a decimal point or comma; a header is ``name
[unit]``, ``name (unit)`` or ``name``, or has the units in a line beneath, and stands above the first rows of numbers;
lines before it are left aside. An ambiguous file is refused with a reason.
"""

import cmath
import csv
import io
import math
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from impact.files.safe_files import CSV_LIMIT, opened_file, write_whole
from impact.quantities import enumeration, finite_or_none

Array = NDArray[np.float64]

EXACT: Final = 0  # digits that restore the value
MOST_COLUMNS: Final = 64
MOST_LINES: Final = 2_000_000
LONGEST: Final = 100  # characters of a number
SEPARATORS: Final[Mapping[str, str]] = {"\t": "tabs", ";": "semicolons", ",": "commas", " ": "blanks"}
BINARY: Final = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")  # beginnings of .xlsx, .ods and .zip, and of .xls
_LOOKED_AT: Final = 200  # number of lines that determine separator and decimal mark
_NUMBER: Final = re.compile(r"\s*[+-]?(\d+([.,]\d*)?|[.,]\d+)([eEdD][+-]?\d+)?\s*")
_UNIT: Final = re.compile(
    r"(?:(?:[numckMGµμ]?(?:m|s|g|N|Pa|Hz|V|W|J|bar|rad)|lbf|psi|in|deg|sec|°|%|dB(?: re\.?)?|\d)(?![a-zA-Z])"
    r"|[-\s/()\[\]^*·⋅²])+"
)
"""Pattern of the units and signs that a line of units under the header holds."""
_COMPLEX: Final = re.compile(r"\(?[+-]?[\d.,]+([eEdD][+-]?\d+)? ?[-+,;] ?[ij]?[+-]?[\d.,]+([eEdD][+-]?\d+)? ?\*?[ij)]*")
_THOUSANDS: Final = re.compile(r"\s*[+-]?\d+[.,]\d{3}[.,]\d")
_SAME: Final = str.maketrans({"µ": "u", "μ": "u", "²": "^2", "·": " ", "*": " ", "⋅": " ", "°": "deg"})


@dataclass(frozen=True)
class Head:
    """Header of one column: its text, and the name and unit in it ("" without a unit)."""

    text: str
    name: str
    unit: str


@dataclass(frozen=True)
class CsvTable:
    """Table as text: ``heads`` beneath ``before`` lines, ``rows`` of cells in ``lines``; ``error`` is of the file."""

    path: Path
    error: type[Exception]
    heads: tuple[Head, ...]
    head_line: int
    lines: tuple[int, ...]
    rows: list[list[str]] = field(repr=False)
    separator: str = ","
    decimal: str = "."
    before: int = 0

    @property
    def dialect(self) -> str:
        """Return separator, decimal mark, and number of lines left aside, in words."""
        mark = "comma" if self.decimal == "," else "point"
        aside = f", {self.before} lines above the head left aside" if self.before else ""
        return f"divided by {SEPARATORS.get(self.separator, repr(self.separator))}, decimal {mark}{aside}"

    @property
    def header(self) -> str:
        """Return the header line, for quotation."""
        return self.separator.join(head.text for head in self.heads)

    def numbers(self, columns: Sequence[int] = ()) -> Array:
        """Return the columns (n, k), by default all. Raises ``error`` for rows of other lengths and cells that are no
        finite number."""
        return self._values(columns or range(len(self.heads)), real, "a finite number: write one, or delete the row")

    def complex_numbers(self, column: int) -> NDArray[np.complex128]:
        """Return a column (n,) of cells such as 1.2e-3+4.5e-4i or (1.2e-3, 4.5e-4). Raises ``error`` for others."""
        return self._values((column,), _complex, "a complex number, as 1.2e-3+4.5e-4i")[:, 0]

    def _values(self, columns: Sequence[int], parse: Callable[[str], complex], needed: str) -> NDArray[Any]:
        values = np.empty((len(self.rows), len(columns)), dtype=float if parse is real else complex)
        for row, line, cells in zip(values, self.lines, self.rows, strict=True):
            if len(cells) != len(self.heads):
                raise self.error(
                    f"{self.path}, line {line}: {len(cells)} columns, {len(self.heads)} are needed, {self.dialect}; "
                    "export it with semicolons or tabs, if commas stand in the numbers, too"
                )
            for place, column in enumerate(columns):
                try:
                    row[place] = parse(cells[column].replace(",", ".") if self.decimal == "," else cells[column])
                except ValueError:
                    raise self._fail(line, column, f"{cells[column].strip()[:80]!r} must be {needed}") from None
        return values

    def _fail(self, line: int, column: int, why: str) -> Exception:
        return self.error(f"{self.path}, line {line}, column {column + 1}: {why}")

    def column_of(self, role: str, names: Sequence[str], stated: Mapping[str, str]) -> int | None:
        """Return the number of the column that ``stated`` names for a role, otherwise one of the ``names``; ``None`` if
        absent. Raises ``error`` for a stated name that is no header, and for several columns."""
        names = (stated[role].strip().lower(),) if role in stated else names
        numbers = [
            k
            for k, head in enumerate(self.heads)
            if head.name.lower() in names or (role in stated and head.text.lower() in names)
        ]
        if len(numbers) > 1 or (not numbers and role in stated):
            words = f"columns.{role} = {stated[role]!r}" if role in stated else f"the name of {role}"
            raise self.error(
                f"{self.path}, line {self.head_line}: {words} is the head of {len(numbers)} columns; give columns = "
                f"{{ {role} = ... }} one of {', '.join(repr(head.text) for head in self.heads)}"
            )
        return numbers[0] if numbers else None

    def factor_of(self, column: int, role: str, units: Mapping[str, float], stated: Mapping[str, str] | None) -> float:
        """Return the factor of a column to SI, by its header, or by the unit ``stated`` if that of the header is
        unknown, as in "p [Bar]"; ``None``: no key can state one.

        Raises ``error`` for a missing or unknown unit, and for a stated unit that contradicts a known one.
        """
        head = self.heads[column]
        own, unit = normal_unit(head.unit), normal_unit((stated or {}).get(role, head.unit))
        if own in units and own != unit:
            why = f"the head says {own!r}, units.{role} = {unit!r}: remove the key, or correct the head"
            raise self._fail(self.head_line, column, why)
        if unit not in units:
            fault = f"unit {unit!r} is unknown" if unit else "has no unit"
            by_key = "" if stated is None else f", or give units = {{ {role} = ... }}"
            why = f"header {head.text!r} {fault}: write '{head.name} [unit]'{by_key}"
            raise self._fail(self.head_line, column, f"{why}, with the unit {', '.join(units)}")
        return units[unit]

    def quantities(
        self,
        known: Mapping[str, Mapping[str, float]],
        columns: Mapping[str, str] | None = None,
        units: Mapping[str, str] | None = None,
        hint: Callable[[str], str] = lambda name: "",
    ) -> tuple[Array, Array]:
        """Return the columns (n, k) of the roles in ``known``, each with its units, and their factors to SI (k,).

        ``columns`` and ``units``: names and units by role that the headers do not state, ``None`` where a scene has no
        such keys; ``hint``: function of the header at the position of a missing column, for the message. Raises
        ``error`` for other roles, a missing column, and as `column_of`, `factor_of` and `numbers`.
        """
        if unknown := sorted({*(columns or {}), *(units or {})} - {*known}):
            raise self.error(f"{self.path}: columns and units know {enumeration(known)}, not {unknown[0]}: remove it")
        numbers = []
        for place, (role, factors) in enumerate(known.items()):
            number = self.column_of(role, (role,), columns or {})
            if number is None:
                head = self.heads[place] if place < len(self.heads) else head_of("")
                units_known = f"'{role} [unit]' with the unit {', '.join(factors)}"
                by_key = f", or be named by columns = {{ {role} = {head.name or '...'!r} }}{hint(head.name.lower())}"
                words = f"header {head.text!r} must be {units_known}{': rename it' if columns is None else by_key}"
                raise self._fail(self.head_line, place, words)
            numbers.append(number)
        for role, unit in (units or {}).items():
            if other := next((each for each in known if each != role and normal_unit(unit) in known[each]), ""):
                raise self.error(f"{self.path}: units.{role} = {unit!r} is a unit of {other}; change or swap the two")
        scales = [self.factor_of(k, role, known[role], units) for k, role in zip(numbers, known, strict=True)]
        return self.numbers(numbers), np.array(scales)


def real(text: str) -> float:
    """Return a finite number, whose exponent may have the letter D. Raises `ValueError` for other text."""
    number = float(text.upper().replace("D", "E").replace("_", "?"))
    if not math.isfinite(number):
        raise ValueError
    return number


def _complex(text: str) -> complex:
    word = re.sub(r"[\s()*]", "", text).lower().replace("i", "j").replace("d", "e")
    if not word.endswith("j"):
        first, second = map(real, re.split("[,;]", word))
        return complex(first, second)
    if not cmath.isfinite(number := complex(word)):
        raise ValueError
    return number


def read_csv(path: Path, error: type[Exception], *, most: int = CSV_LIMIT) -> CsvTable:
    """Return the table in a file without lines that begin with #; one without heads if no line has content.

    Raises ``error``: no regular file, larger than ``most`` bytes, no text, too many columns or lines, ambiguous commas
    or points in numbers.
    """
    with opened_file(path, most, error) as file:
        data = file.read()
    if data.startswith(BINARY):
        raise error(f"{path}: is a spreadsheet or an archive, and must be CSV text: export it as CSV")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as problem:  # code page of Western Windows, if there are no control characters
        if re.search(rb"[\x00-\x08]", data):
            raise error(f"{path}: is no CSV text in UTF-8 ({problem}); save it as such") from problem
        text = data.decode("cp1252", errors="replace")
    separator = _separator_of(text[: 1 << 20])
    lines: list[int] = []
    rows: list[list[str]] = []
    remark: tuple[int, list[str]] = 0, []  # the last one above the rows
    try:
        for number, row in _rows(io.StringIO(text, newline=""), separator):
            if row and row[0].strip()[:1] == "#":
                remark = remark if rows else (number, [row[0].strip(" #"), *row[1:]])
            elif any(cell.strip() for cell in row):
                lines.append(number)
                rows.append(row)
            if len(row) > MOST_COLUMNS or len(rows) > MOST_LINES:
                raise error(
                    f"{path}, line {number}: {len(row)} columns, {len(rows)} lines; at most "
                    f"{MOST_COLUMNS} and {MOST_LINES} are read: resample the record, or cut it"
                )
    except csv.Error as problem:
        raise error(f"{path}: is no CSV text ({problem}); save it as such") from problem
    if not rows:
        return CsvTable(path, error, (), 1, (), [])
    if _are_data(*rows[:2]) and len(remark[1]) == len(rows[0]):  # the head is a remark
        lines, rows = [remark[0], *lines], [remark[1], *rows]
    head, units = _head_of(rows)
    width, body = len(rows[head]), rows[units + 1 :]
    if width > 1 and not rows[head][-1].strip() and all(len(row) == width and not row[-1].strip() for row in body):
        width, body = width - 1, [row[:-1] for row in body]  # an empty last column, left by separators at line ends
    cells = zip(rows[head][:width], rows[units] if units > head else [""] * width, strict=False)
    heads = tuple(_with_unit(head_of(cell), unit) for cell, unit in cells)
    table = CsvTable(path, error, heads, lines[head], tuple(lines[units + 1 :]), body, separator, before=head)
    return replace(table, decimal=_decimal_of(table))


def _rows(text: io.StringIO, separator: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the number and the cells of each line; between words blanks stand in twos or more."""
    if separator != " ":
        reader = csv.reader(text, delimiter=separator)
        yield from ((reader.line_num, row) for row in reader)
        return
    for number, line in enumerate(text, start=1):
        words = line.split()
        yield number, words if all(map(_NUMBER.fullmatch, words)) else re.split(r"\s{2,}", line.strip())


def _head_of(rows: list[list[str]]) -> tuple[int, int]:
    """Return the places of the header and of the units beneath it, which are one without such a line: the last rows
    without a number before the first two of numbers."""
    first = next((k for k, pair in enumerate(pairwise([*rows, rows[-1]])) if _are_data(*pair)), 1)
    last = max((k for k in range(first) if not any(map(_is_number, rows[k]))), default=0)
    texts = [cell.strip() for cell in rows[last] if cell.strip()]
    is_beneath = last > 0 and len(rows[last - 1]) == len(rows[last]) and all(map(_UNIT.fullmatch, texts))
    return last - is_beneath, last


def _are_data(*rows: list[str]) -> bool:
    """Return whether rows are equally long, and numbers more than half of the cells of each that are not empty."""
    cells = [[cell for cell in row if cell.strip()] for row in rows]
    numbers = (sum(_is_number(cell) for cell in row) for row in cells)
    return len({len(row) for row in rows}) == 1 and all(2 * n > len(row) for n, row in zip(numbers, cells, strict=True))


def _is_number(cell: str) -> bool:
    return len(cell) <= LONGEST and bool(_NUMBER.fullmatch(cell) or _COMPLEX.fullmatch(cell.strip()))


def _with_unit(head: Head, cell: str) -> Head:
    """Return a head with the unit in the line beneath it; with both, which is no unit, where they differ."""
    bare = head_of(cell)
    unit = (bare.text if bare.name else bare.unit).strip("-")
    both = f"{head.unit}, {unit}" if head.unit and normal_unit(unit) != normal_unit(head.unit) else unit
    return Head(f"{head.name} [{both}]", head.name, both) if unit else head


def read_needed_csv(path: str | os.PathLike[str], error: type[Exception], like: str) -> CsvTable:
    """Return the table in a file as `read_csv`; raises ``error`` if the file is missing or empty, too."""
    if not Path(path).exists():
        raise error(f"{path}: no such file; check the path")
    if not (table := read_csv(Path(path), error)).heads:
        raise error(f"{path}: is empty; the first line must be like {like}")
    return table


def head_of(cell: str) -> Head:
    """Return text, name and unit of a header; the unit is in the last pair of brackets or parentheses."""
    text = cell.strip()
    opening = {"]": "[", ")": "("}.get(text[-1:])
    depth = 0
    for start in range(len(text) - 1, -1, -1) if opening else ():
        depth += (text[start] == text[-1]) - (text[start] == opening)
        if depth == 0:
            return Head(text, text[:start].strip(), text[start + 1 : -1].strip())
    return Head(text, text, "")


def normal_unit(unit: str) -> str:
    """Return a unit in the notation of tables of units: u for micro, ^2 for a square, one space for a product."""
    squares = re.sub(r"(?<=[A-Za-z])(\*\*)?2\b", "^2", unit)
    return " ".join(re.sub(r"\bsec\b", "s", squares).translate(_SAME).split())


def _separator_of(first: str) -> str:
    """Return the separator that divides most of the last lines into numbers; without numbers the first one that occurs
    in each line; a comma if there is none."""
    lines = [line for line in first.splitlines() if line.strip() and line.lstrip()[:1] != "#"]
    whole = (lines[:-1] if len(lines) > 2 else lines)[-_LOOKED_AT:]  # the last line may be truncated
    counts = dict.fromkeys(SEPARATORS, 0)
    for mark in SEPARATORS:
        rows = (line.split() if mark == " " else line.replace('"', "").split(mark) for line in whole)
        counts[mark] = sum(len(row) > 1 and _are_data(row) for row in rows)
    if any(counts.values()):
        return max(counts, key=counts.__getitem__)
    return next((mark for mark in "\t;," if whole and all(mark in line for line in whole)), ",")


def _decimal_of(table: CsvTable) -> str:
    """Return the decimal mark of all cells. Raises the table's ``error`` for two of them, and marks of thousands."""
    seen: dict[str, tuple[int, str]] = {}
    for line, row in zip(table.lines, table.rows, strict=True):
        for cell in row:
            marks = [mark for mark in ",." if mark in cell]
            has_thousands = bool(marks and _THOUSANDS.match(cell))
            if not has_thousands and (not marks or ")" in cell or not _is_number(cell)):
                continue
            for mark in marks:
                seen.setdefault(mark, (line, cell.strip()[:80]))
            if has_thousands or len(seen) > 1:
                cells = ", ".join(f"{text!r} (line {at})" for at, text in seen.values())
                raise table.error(
                    f"{table.path}, line {line}: {cell.strip()[:80]!r} stands beside {cells}: write all numbers with "
                    "one decimal mark, without marks of thousands"
                )
    return "," if "," in seen else "."


Row = Mapping[str, float]


def csv_text(heads: Iterable[object], rows: Iterable[Iterable[object]], digits: int = EXACT) -> str:
    """Return headers and rows as comma-separated values: true and false as in JSON, an empty field for unknown values.

    ``digits``: significant digits of floats; `EXACT`: as many as restore the value.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(heads)
    writer.writerows([_cell(value, digits) for value in row] for row in rows)
    return text.getvalue()


def _cell(value: object, digits: int) -> str:
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return ""
    if isinstance(value, float) and digits != EXACT:
        return f"{value:.{digits}g}"
    return str(value).lower() if isinstance(value, bool) else str(value)


def write_csv(
    path: str | os.PathLike[str], heads: Iterable[object], rows: Iterable[Iterable[object]], digits: int = EXACT
) -> Path:
    """Write the text of `csv_text` to a file, complete or not at all, and return the path."""
    write_whole(path, csv_text(heads, rows, digits).encode("utf-8"))
    return Path(path)


def read_rows(path: str | os.PathLike[str]) -> list[Row]:
    """Return rows of numbers by header. Raises `ValueError` that names file and line."""
    table = read_csv(Path(path), ValueError)
    return [dict(zip((head.text for head in table.heads), row, strict=True)) for row in table.numbers().tolist()]


def without_nan(value: object) -> object:
    """Return nested mappings, lists and tuples with ``None`` in place of every number that is not finite, for JSON."""
    if isinstance(value, Mapping):
        return {key: without_nan(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [without_nan(item) for item in value]
    return finite_or_none(value) if isinstance(value, float) else value
