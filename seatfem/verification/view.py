"""The rows of the verification table on a terminal, which takes no markup: messages have brackets."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table
from rich.text import Text

from seatfem.verification.case import Row


def verification_table_view(rows: Sequence[Row]) -> Table:
    """Case, exact value, ours, error, verdict. Errors are relative."""
    table = Table("case", "quantity", "exact", "ours", "error", "allowed", "verdict")
    for row in rows:
        verdict = Text("pass") if row.verdict else Text("FAIL", style="red")
        numbers = (f"{row.exact:.6g}", f"{row.ours:.6g}", f"{row.error:+.1e}", f"{row.tolerance:.1e}")
        table.add_row(row.case, row.quantity, *numbers, verdict)
    return table
