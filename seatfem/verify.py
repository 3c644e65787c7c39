"""Verification against known answers, and comparison with published measurements.

A case has a known answer, our answer, the error and the verdict; the cases are in tests/known_answers and in the wheel.
A measured set is a file NAME.toml (source, geometry, fitted and predicted numbers) with a module NAME.py, whose
`predict` computes our numbers by public functions, to be compared within error bars; the sets are in tests/measured and
in the wheel.
"""

from __future__ import annotations

import importlib
import math
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any, Final

import rich.table
from pydantic import ConfigDict, Field
from rich.text import Text

from impact.notices import Progress, SeatfemError, silent
from seatfem.fields import Table, default
from seatfem.study.scene.tables import load_table

NAME: Final = "seatfem.known_answers"
KNOWN_ANSWERS: Final = (
    Path(__file__).with_name("known_answers"),
    Path(__file__).parents[1] / "tests" / "known_answers",
)
"""Folders of the cases, in an installed program and in its source tree."""


class VerificationError(SeatfemError, ValueError):
    """Error of missing or invalid cases or sets; the message names the remedy."""


@dataclass(frozen=True)
class Estimate:
    """Computed number, its absolute numerical uncertainty, observed and theoretical order of convergence if any."""

    value: float
    uncertainty: float = 0.0
    order: float | None = None
    theory: int | None = None


@dataclass(frozen=True)
class Case:
    """Problem with a known answer.

    Attributes:
        case, quantity: the problem, and the compared quantity with its unit (none: dimensionless).
        exact: known value.
        rtol: relative accuracy beyond the numerical uncertainty: of the known value, or of a fixed model.
        source: source of the known value.
        compute: function of a coefficient on one physical input that returns our value; 1 is the case itself. A plain
            number has no numerical uncertainty.
    """

    case: str
    quantity: str
    exact: float
    rtol: float
    source: str
    compute: Callable[[float], Estimate | float]


@dataclass(frozen=True)
class Row:
    """Result of a case. ``error`` and ``tolerance`` are relative to ``exact``; ``order`` is the observed order of
    convergence, ``theory`` the theoretical one."""

    case: str
    quantity: str
    exact: float
    ours: float
    error: float
    tolerance: float
    verdict: bool
    source: str
    order: float | None = None
    theory: int | None = None


def carry_out(case: Case, coefficient: float = 1.0) -> Row:
    """Return the result of a case; ``verdict``: |error| <= tolerance = rtol + numerical uncertainty."""
    computed = case.compute(coefficient)
    ours = computed if isinstance(computed, Estimate) else Estimate(computed)
    scale = abs(case.exact)
    error, tolerance = (ours.value - case.exact) / scale, case.rtol + ours.uncertainty / scale
    names, verdict = (case.case, case.quantity), abs(error) <= tolerance
    return Row(*names, case.exact, ours.value, error, tolerance, verdict, case.source, ours.order, ours.theory)


def known_answers() -> ModuleType:
    """Return the package of the cases, whose `PROVIDERS` make them. Raises as `load_cases`."""
    return load_cases(NAME, KNOWN_ANSWERS)


def load_cases(name: str, places: Sequence[Path]) -> ModuleType:
    """Return a package from the tests, or from the wheel, imported under a name of the program.

    Raises:
        VerificationError: it is in none of the folders.
    """
    if name in sys.modules:
        return sys.modules[name]
    folder = next((place for place in places if (place / "__init__.py").is_file()), None)
    if folder is None:
        raise VerificationError(f"there are no cases at {places[0]}: install seatfem from its wheel again")
    spec = spec_from_file_location(name, folder / "__init__.py", submodule_search_locations=[str(folder)])
    assert spec is not None
    assert spec.loader is not None
    package = module_from_spec(spec)
    sys.modules[name] = package
    spec.loader.exec_module(package)
    return package


def verification_cases() -> tuple[Case, ...]:
    """Return all cases of all providers. Raises as `known_answers`."""
    return tuple(case for provider in known_answers().PROVIDERS for case in provider())


def verification_table(progress: Progress = silent, cases: Sequence[Case] = ()) -> tuple[Row, ...]:
    """Return the results of all cases, or of the given ones."""
    return _answer_each(carry_out, cases or verification_cases(), progress, "verifying")


def _answer_each(
    answer: Callable[[Any], Any], questions: Sequence[Any], progress: Progress, stage: str
) -> tuple[Any, ...]:
    """Return the answers to all questions, in their order, with the progress of this stage."""
    answers = []
    for number, question in enumerate(questions):
        progress(stage, number / len(questions))
        answers.append(answer(question))
    progress(stage, 1.0)
    return tuple(answers)


def verification_table_view(rows: Sequence[Row]) -> rich.table.Table:
    """Return a table of case, exact value, ours, relative error and verdict of each row."""
    table = rich.table.Table("case", "quantity", "exact", "ours", "error", "allowed", "verdict")
    for row in rows:
        verdict = Text("pass") if row.verdict else Text("FAIL", style="red")
        numbers = (f"{row.exact:.6g}", f"{row.ours:.6g}", f"{row.error:+.1e}", f"{row.tolerance:.1e}")
        table.add_row(row.case, row.quantity, *numbers, verdict)
    return table


PACKAGE: Final = "seatfem.measured_sets"
MEASURED_SETS: Final = (Path(__file__).with_name("measured_sets"), Path(__file__).parents[1] / "tests" / "measured")
"""Folders of the sets, in an installed program and in its source tree."""


class Source(Table):
    """A source is where a measurement is published."""

    title: str = Field(description="of the publication, with its authors")
    address: str = Field(description="of the publication")
    licence: str = Field(description="of its numbers")
    read: str = default("", "parts of it that were read")
    beside: str = default("", "another set, whose numbers this one uses")


class Prediction(Table):
    """Measured number that we predict."""

    name: str = Field(description="name of the quantity")
    value: float = Field(strict=True, description="measured value")
    uncertainty: float = Field(strict=True, ge=0, description="of the measured value")
    unit: str = Field(description="of value and uncertainty, and of our number")
    note: str = default("", "source of the uncertainty, or reason for a disagreement")
    agrees: bool = default(True, "whether our number and the measured one are known to overlap", strict=True)


class MeasuredSet(Table):
    """Published measurement: its source, what was measured, what is fitted and what is predicted. Tables besides these
    are data of its module."""

    model_config = ConfigDict(extra="allow")

    name: str = default("", "that of its file")
    about: str = default("", "what is compared")
    finding: str = default("", "the conclusion")
    source: Source = Field(description="where the measurement is published")
    geometry: dict[str, Any] = default({}, "geometry of the rig, as its module reads it")
    fitted: dict[str, Any] = default({}, "what each fitted number is fitted to")
    predicted: tuple[Prediction, ...] = Field(min_length=1, description="measured numbers that are compared")

    @property
    def data(self) -> Mapping[str, Any]:
        """Return the tables that only the set's module reads."""
        return self.model_extra or {}

    @property
    def counts(self) -> bool:
        """Return whether more is predicted than fitted: otherwise agreement proves nothing."""
        return len(self.fitted) < len(self.predicted)


@dataclass(frozen=True)
class Comparison:
    """Measured number and ours; ``overlap``: |measured - ours| <= uncertainty + bar."""

    published: Prediction
    ours: Estimate

    @property
    def overlap(self) -> bool:
        """Return whether both intervals have a common point."""
        distance = abs(self.published.value - self.ours.value)
        return distance <= self.published.uncertainty + self.ours.uncertainty

    @property
    def as_stated(self) -> bool:
        """Return whether they overlap, or not, as the set states."""
        return self.overlap == self.published.agrees


@dataclass(frozen=True)
class ComparedSet:
    """Measured set with our numbers, including those of its fits."""

    record: MeasuredSet
    rows: tuple[Comparison, ...]
    fits: Mapping[str, Estimate]


def read_measured_set(path: Path) -> MeasuredSet:
    """Return the set in a file. Raises `SceneError` with all errors of the file."""
    return load_table(path, MeasuredSet).model_copy(update={"name": path.stem})


def measured_sets() -> tuple[MeasuredSet, ...]:
    """Return all sets by name. Raises as `read_measured_set`, and if there are none."""
    folder = Path(str(load_cases(PACKAGE, MEASURED_SETS).__file__)).parent
    return tuple(read_measured_set(path) for path in sorted(folder.glob("*.toml")))


def compare(record: MeasuredSet) -> ComparedSet:
    """Return a set with our numbers, from the `predict` of its module.

    Raises:
        VerificationError: the module lacks a predicted number.
    """
    load_cases(PACKAGE, MEASURED_SETS)
    predict: Callable[[MeasuredSet], Mapping[str, Estimate]] = importlib.import_module(
        f"{PACKAGE}.{record.name}"
    ).predict
    ours = predict(record)
    missing = [each.name for each in record.predicted if each.name not in ours]
    if missing:
        raise VerificationError(f"{record.name}.py must predict {', '.join(missing)}, as {record.name}.toml has it")
    rows = tuple(Comparison(each, ours[each.name]) for each in record.predicted)
    return ComparedSet(record, rows, {name: ours[name] for name in record.fitted if name in ours})


def measured_table(progress: Progress = silent, records: Sequence[MeasuredSet] = ()) -> tuple[ComparedSet, ...]:
    """Return all sets, or the given ones, with our numbers."""
    return _answer_each(compare, records or measured_sets(), progress, "comparing")


def with_uncertainty(value: float, uncertainty: float, unit: str) -> str:
    """Return "62.2 ± 1.2 Hz": the uncertainty to two digits, the value to the same place; only the value if the
    uncertainty is zero."""
    if not 1e-5 * abs(value) < uncertainty < math.inf:
        return f"{value:.6g} {unit}".rstrip()
    places = max(0, 1 - math.floor(math.log10(uncertainty)))
    return f"{value:.{places}f} ± {uncertainty:.{places}f} {unit}".rstrip()


def counted(compared: Sequence[ComparedSet]) -> str:
    """Return the numbers of sets that count, of fitted and predicted numbers in them, and of those that overlap."""
    sets = [each for each in compared if each.record.counts]
    rows = [row for each in sets for row in each.rows]
    fitted = sum(len(each.record.fitted) for each in sets)
    overlapping = sum(row.overlap for row in rows)
    return (
        f"{len(sets)} of {len(compared)} sets count: {fitted} numbers fitted, {len(rows)} predicted, "
        f"{overlapping} of them overlap"
    )


def measured_table_view(compared: Sequence[ComparedSet]) -> rich.table.Table:
    """Return a table of set, quantity, measured number, ours and whether they overlap, with the counts of each set."""
    table = rich.table.Table("set", "quantity", "measured", "ours", "overlap", caption=counted(compared))
    for each in compared:
        record = each.record
        verdict = "counts" if record.counts else "does not count: as many fits as predictions"
        table.add_row(record.name, f"fitted {len(record.fitted)}, predicted {len(each.rows)}", "", "", verdict)
        for name, fit in each.fits.items():
            of = record.fitted[name]
            unit = of.get("unit", "") if isinstance(of, Mapping) else ""
            table.add_row("", name, "fitted", with_uncertainty(fit.value, fit.uncertainty, unit), "")
        for row in each.rows:
            measured = with_uncertainty(row.published.value, row.published.uncertainty, row.published.unit)
            ours = with_uncertainty(row.ours.value, row.ours.uncertainty, row.published.unit)
            table.add_row("", row.published.name, measured, ours, _verdict(row))
        table.add_section()
    return table


def _verdict(row: Comparison) -> Text:
    word = "yes" if row.overlap else "no"
    return Text(word) if row.as_stated else Text(f"{word}, stated otherwise", style="red")
