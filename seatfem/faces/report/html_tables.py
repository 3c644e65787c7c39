"""Tables of the terminal, and plain rows, as HTML; all their text is escaped."""

from __future__ import annotations

import html
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table


def html_table(table: Table) -> str:
    """Return the cells of a table whose columns hold text, its sections, its bold rows as headings, and its caption."""
    columns, attributes = [], []
    for column in table.columns:
        columns.append([str(cell) for cell in column.cells])
        attributes.append(' class="number"' if column.justify == "right" else "")
    heads = [str(column.header) for column in table.columns]
    begins, rows = False, []
    for row, cells in zip(table.rows, zip(*columns, strict=True), strict=True):
        kind = " ".join(name for name, is_so in (("section", begins), ("heading", row.style == "bold")) if is_so)
        rows.append(_row("td", cells, attributes, kind))
        begins = row.end_section
    lines = "<br>".join(map(html.escape, str(table.caption or "").splitlines()))
    caption = f'<p class="soft">{lines}</p>' if lines else ""
    return _whole(_row("th", heads, attributes), rows) + caption


def html_rows(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return an HTML table of rows of text under their heads."""
    plain = [""] * len(heads)
    return _whole(_row("th", heads, plain), [_row("td", row, plain) for row in rows])


def _row(tag: str, cells: Sequence[str], attributes: Sequence[str], kind: str = "") -> str:
    inside = (f"<{tag}{with_}>{html.escape(cell)}</{tag}>" for cell, with_ in zip(cells, attributes, strict=True))
    return f'<tr class="{kind}">{"".join(inside)}</tr>'


def _whole(head: str, rows: Sequence[str]) -> str:
    return f'<div class="scroll"><table><thead>{head}</thead><tbody>{"".join(rows)}</tbody></table></div>'
