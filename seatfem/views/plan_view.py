"""A plan, for the terminal."""

from __future__ import annotations

from rich.table import Table

from seatfem.planning.plan import Plan


def choices_table(plan: Plan) -> Table:
    """Key, value, whether the file says so, reason."""
    table = Table("key", "value", "", "reason")
    for choice in plan.choices:
        table.add_row(choice.key, choice.value, "given" if choice.given else "chosen", choice.reason)
    return table
