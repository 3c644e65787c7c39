"""The verification table: problems with a known answer, our answer, the error, the verdict.

The cases are no part of the program: they lie among its tests, in tests/known_answers, and travel in the wheel.
"""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Final

from rich.table import Table
from rich.text import Text

from impact.notices import Progress, silent

NAME: Final = "seatfem.known_answers"
PLACES: Final = (Path(__file__).with_name("known_answers"), Path(__file__).parents[1] / "tests" / "known_answers")
"""Where the cases lie in an installed program, and in its source tree."""


class VerificationError(ValueError):
    """Known answers that are not there; the message names the remedy."""


@dataclass(frozen=True)
class Estimate:
    """A computed number, its absolute numerical uncertainty, observed and theoretical order of convergence if any."""

    value: float
    uncertainty: float = 0.0
    order: float | None = None
    theory: int | None = None


@dataclass(frozen=True)
class Case:
    """A problem with a known answer.

    Attributes:
        case, quantity: what is solved, what is compared (with its unit; none: dimensionless).
        exact: the known value.
        rtol: relative accuracy claimed beyond the numerical uncertainty: of the known value, or of a fixed model.
        source: of the known value.
        compute: our value when one physical input is multiplied by the given coefficient; 1 is the case itself. A
            plain number has no numerical uncertainty.
    """

    case: str
    quantity: str
    exact: float
    rtol: float
    source: str
    compute: Callable[[float], Estimate | float]


@dataclass(frozen=True)
class Row:
    """A case, carried out. ``error`` and ``tolerance`` are relative to ``exact``; ``order`` is the observed one.

    ``theory`` is the order that it tends to.
    """

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
    """Compute the case; ``verdict``: |error| <= tolerance = rtol + numerical uncertainty."""
    computed = case.compute(coefficient)
    ours = computed if isinstance(computed, Estimate) else Estimate(computed)
    scale = abs(case.exact)
    error, tolerance = (ours.value - case.exact) / scale, case.rtol + ours.uncertainty / scale
    names, verdict = (case.case, case.quantity), abs(error) <= tolerance
    return Row(*names, case.exact, ours.value, error, tolerance, verdict, case.source, ours.order, ours.theory)


def known_answers() -> ModuleType:
    """Return the package of the cases, whose `PROVIDERS` make them. Raises as `load_cases`."""
    return load_cases(NAME, PLACES)


def load_cases(name: str, places: Sequence[Path]) -> ModuleType:
    """Return a package that lies among the tests, or in the wheel, under a name of the program.

    Raises:
        VerificationError: it is in none of the places.
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


def verification_table(progress: Progress = silent, cases: Sequence[Case] | None = None) -> tuple[Row, ...]:
    """Carry out every case, or those given."""
    cases = verification_cases() if cases is None else cases
    rows = []
    for number, case in enumerate(cases):
        progress("verifying", number / len(cases))
        rows.append(carry_out(case))
    progress("verifying", 1.0)
    return tuple(rows)


def verification_table_view(rows: Sequence[Row]) -> Table:
    """Return case, exact value, ours, error and verdict of each row. Errors are relative."""
    table = Table("case", "quantity", "exact", "ours", "error", "allowed", "verdict")
    for row in rows:
        verdict = Text("pass") if row.verdict else Text("FAIL", style="red")
        numbers = (f"{row.exact:.6g}", f"{row.ours:.6g}", f"{row.error:+.1e}", f"{row.tolerance:.1e}")
        table.add_row(row.case, row.quantity, *numbers, verdict)
    return table
