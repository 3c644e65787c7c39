"""The verification table: problems with a known answer, our answer, the error, the verdict."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from rich.table import Table
from rich.text import Text

from impact.progress import Progress, silent
from seatfem.verification.beams import beam_cases
from seatfem.verification.case import Case, Row, carry_out
from seatfem.verification.compliant import compliant_cases, several_cases
from seatfem.verification.ground import ground_cases, rigid_face_cases
from seatfem.verification.half_space import half_space_cases, radiating_cases
from seatfem.verification.lumped import lumped_cases
from seatfem.verification.manufactured import manufactured_cases
from seatfem.verification.plates import plate_cases
from seatfem.verification.reeds import reed_cases
from seatfem.verification.rods import rod_cases
from seatfem.verification.round_bars import round_bar_cases
from seatfem.verification.solids import finite_element_cases, solid_cases
from seatfem.verification.spheres import sphere_cases
from seatfem.verification.stresses import stress_cases
from seatfem.verification.thick_plates import thick_plate_cases
from seatfem.verification.waves import wave_cases

# To add rows: a function that returns cases, here. Making the cases is cheap; only `Case.compute` works.
PROVIDERS: tuple[Callable[[], tuple[Case, ...]], ...] = (
    rod_cases,
    wave_cases,
    lumped_cases,
    several_cases,
    compliant_cases,
    radiating_cases,
    half_space_cases,
    stress_cases,
    beam_cases,
    reed_cases,
    finite_element_cases,
    manufactured_cases,
    solid_cases,
    sphere_cases,
    round_bar_cases,
    ground_cases,
    rigid_face_cases,
    plate_cases,
    thick_plate_cases,
)


def verification_cases() -> tuple[Case, ...]:
    """Return all cases of all providers."""
    return tuple(case for provider in PROVIDERS for case in provider())


def verification_table(progress: Progress = silent, cases: Sequence[Case] | None = None) -> tuple[Row, ...]:
    """Carry out every case, or those given."""
    cases = verification_cases() if cases is None else cases
    rows = []
    for number, case in enumerate(cases):
        progress("verifying", number / len(cases))
        rows.append(carry_out(case))
    progress("verifying", 1.0)
    return tuple(rows)


def markdown_table(rows: tuple[Row, ...]) -> str:
    """Return the rows as a Markdown table; errors and tolerances are relative, ``order`` is the observed one."""
    head = ("case", "quantity", "exact", "ours", "error", "tolerance", "order", "verdict", "source")
    body = [
        (
            row.case,
            row.quantity.replace("|", r"\|"),
            f"{row.exact:.8g}",
            f"{row.ours:.8g}",
            f"{row.error:+.1e}",
            f"{row.tolerance:.1e}",
            "" if row.order is None else f"{row.order:.2f}",
            "pass" if row.verdict else "FAIL",
            row.source,
        )
        for row in rows
    ]
    lines = [head, tuple("---" for _ in head), *body]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def verification_table_view(rows: Sequence[Row]) -> Table:
    """Return a table of case, exact value, ours, error, verdict. Errors are relative."""
    table = Table("case", "quantity", "exact", "ours", "error", "allowed", "verdict")
    for row in rows:
        verdict = Text("pass") if row.verdict else Text("FAIL", style="red")
        numbers = (f"{row.exact:.6g}", f"{row.ours:.6g}", f"{row.error:+.1e}", f"{row.tolerance:.1e}")
        table.add_row(row.case, row.quantity, *numbers, verdict)
    return table
